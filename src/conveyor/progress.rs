//! What is on its way, as it is told to people.

use super::stage::Stage;
use crate::input::job::Job;
use parking_lot::Mutex;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// A job on its way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Running {
    /// The name of its result.
    pub name: PathBuf,
    /// The last stage that it has reached.
    pub stage: Stage,
    /// Its charts that are certified.
    pub charts_done: usize,
    /// All its charts, as far as they are known.
    pub charts: usize,
    /// When it was taken up.
    pub since: Instant,
    /// What keeps it from going on, for people.
    pub trouble: Option<String>,
}

/// All jobs on their way, in the order in which they were taken up.
#[derive(Debug, Default)]
pub struct Progress(Mutex<Entries>);

#[derive(Debug, Default)]
struct Entries {
    taken_up: u64,
    running: BTreeMap<u64, Running>,
}

impl Progress {
    /// A job is taken up: returns its number.
    pub(super) fn add(&self, job: &Job) -> u64 {
        let mut entries = self.0.lock();
        entries.taken_up += 1;
        let number = entries.taken_up;
        let (stage, since) = (Stage::Read, Instant::now());
        let name = job.name.clone();
        entries.running.insert(number, Running { name, stage, charts_done: 0, charts: 0, since, trouble: None });
        number
    }

    /// A job has got further.
    pub(super) fn update(&self, number: u64, change: impl FnOnce(&mut Running)) {
        if let Some(running) = self.0.lock().running.get_mut(&number) {
            change(running);
        }
    }

    /// A job has ended.
    pub(super) fn remove(&self, number: u64) {
        self.0.lock().running.remove(&number);
    }

    /// All jobs on their way.
    pub fn running(&self) -> Vec<Running> {
        self.0.lock().running.values().cloned().collect()
    }
}
