//! What the process of a single job and its parent say to each other: a line of JSON each, on the job's standard input
//! and output.

use crate::conveyor::stage::Stage;
use crate::formats::Limits;
use crate::outcome::Reason;
use crate::output::begun::Entry;
use crate::report::ResultSettings;
use crate::settings::Settings;
use serde::{Deserialize, Serialize};
use std::io::{self, Write};

/// The first line that the parent says: what is to be done.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Order {
    /// The settings that decide the result.
    pub settings: ResultSettings,
    /// What is too much for an input.
    pub limits: Limits,
    /// How much may be computed at once, if there are places for it.
    pub jobs: usize,
    /// The most memory that the process may take, in bytes.
    pub memory: Option<u64>,
    /// The memory of the machine, in bytes.
    pub machine: u64,
    /// What the mark of the input says.
    pub mark: Option<Entry>,
}

impl Order {
    /// These settings, as far as they are not ordered.
    pub fn applied_to(self, settings: Settings) -> Settings {
        let Self { settings: result, limits, jobs, memory, machine, .. } = self;
        Settings { limits, jobs, job_memory: memory, machine_memory: machine, ..result.applied_to(settings) }
    }
}

/// What the parent says later.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Told {
    /// A place to compute is yours.
    Place,
    /// Somebody waits who is ahead of you.
    YieldTo,
    /// The answer to a request for memory.
    Answer {
        /// Of which request.
        ticket: u64,
        /// Whether it is granted.
        granted: bool,
    },
}

/// What the job says.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Said {
    /// It wants one more place.
    Want,
    /// It gives a place back.
    Leave,
    /// It asks whether there is memory.
    TryTake {
        /// To know the answer by.
        ticket: u64,
        /// How much.
        bytes: u64,
    },
    /// It waits for memory.
    Take {
        /// To know the answer by.
        ticket: u64,
        /// How much.
        bytes: u64,
    },
    /// It gives memory back.
    GiveBack {
        /// How much.
        bytes: u64,
    },
    /// How far it is.
    Progress {
        /// The last stage that it has reached.
        stage: Stage,
        /// Its charts that are certified.
        charts_done: usize,
        /// All its charts, as far as they are known.
        charts: usize,
        /// What keeps it from going on.
        trouble: Option<String>,
    },
    /// It asked for these files beside the input.
    Beside {
        /// Their names.
        names: Vec<String>,
    },
    /// It has ended.
    Ended(Ending),
}

/// How a job ended in its process.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// The files of its result are in the folder, on disk.
    Made,
    /// The input is not what was seen.
    Changed,
    /// It names a file that is not there.
    Waiting(Reason),
    /// The system gets in the way, and may not do so later.
    Again(Reason),
    /// Its files cannot be written.
    Unwritten {
        /// What is wrong and what to do.
        message: String,
        /// Whether it stays as long as nobody changes something.
        lasts: bool,
    },
    /// A stage broke down.
    Lost,
}

/// Says something, on a line of its own.
///
/// # Errors
/// Nobody listens.
pub fn say(to: &mut impl Write, what: &impl Serialize) -> io::Result<()> {
    let mut line = serde_json::to_vec(what)?;
    line.push(b'\n');
    to.write_all(&line)?;
    to.flush()
}
