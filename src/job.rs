//! One input as it travels: which file, under which name, whether it is still wanted, and how it ended.

use crate::look::Look;
use crate::outcome::Reason;
use crate::publish::PublishError;
use crate::regular::{self, OpenError};
use crate::report::Report;
use blake3::Hash;
use parking_lot::Mutex;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// An input with the name of its result.
#[derive(Debug)]
pub struct Job {
    /// The file.
    pub path: PathBuf,
    /// Where its result goes, below the output folder: its whole name, perhaps behind that of a sub-folder.
    pub name: PathBuf,
    /// Its size as it was seen, for the order among jobs.
    pub bytes: u64,
    /// What the file must look like; nothing where it could not be looked at.
    pub look: Option<Look>,
    /// Since when it looks like that, where it lies in an inbox.
    pub since: Option<Instant>,
    /// The folder out of which no link may lead; none where the user named the file itself.
    pub within: Option<PathBuf>,
    /// The hash of its content when it was done: the job is to see whether it still is that.
    pub doubted: Option<Hash>,
    unwanted: AtomicBool,
    beside: Mutex<Vec<String>>,
}

/// The stages, as progress is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Reading bytes and decoding them.
    Read,
    /// Repair and decomposition.
    Decompose,
    /// Linear and harmonic maps.
    Map,
    /// Untangling and proving.
    Untangle,
    /// Measuring, encoding, publishing.
    Write,
    /// Commands run on the result.
    Chain,
}

impl Stage {
    /// All stages, in their order.
    const ALL: [Self; 6] = [Self::Read, Self::Decompose, Self::Map, Self::Untangle, Self::Write, Self::Chain];

    /// The stage of this name.
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.name() == name)
    }

    /// The name of the stage.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Decompose => "decompose",
            Self::Map => "map",
            Self::Untangle => "untangle",
            Self::Write => "write",
            Self::Chain => "chain",
        }
    }
}

/// Why work on a job stopped.
#[derive(Clone, Debug, PartialEq)]
pub enum Stopped {
    /// It is refused, or failed.
    For(Reason),
    /// Nobody wants the result any more.
    Unwanted,
}

impl From<Reason> for Stopped {
    fn from(reason: Reason) -> Self {
        Self::For(reason)
    }
}

/// How a job ended.
#[derive(Debug)]
pub enum End {
    /// Its result stands in the output folder.
    Done(Done),
    /// Its result stands, but its input is to be put away, and it is too early for that: not before then.
    Later(Done, Instant),
    /// Its result stands, but its input is not put away, for this reason, which passes.
    Held(Done, &'static str),
    /// Its result stands, but when its input was to be put away, that was something else: it is to be processed again.
    Outdated(Done),
    /// It was doubted, and is what it was.
    Same,
    /// It was no longer wanted: nothing was published.
    Unwanted,
    /// The file is not what was seen, or gone: nothing was published.
    Changed,
    /// The file names another one that is not there, or not yet as long as it says: nothing was published.
    Waiting(Reason),
    /// The system got in the way, for a reason that passes: nothing was published, and it is to be tried again.
    Again(Reason),
    /// The result could not be written.
    Unwritten(PublishError),
    /// A stage broke down outside the work on this job: a fault of planish. Nothing was published.
    Lost,
    /// The result was made, and then moved or removed by a command that ran on it: to make it again would only have it
    /// taken again.
    Taken(Done, String),
    /// The result stands, but the commands on it could not be run, or the input not be put away.
    Unchained(Done, String),
}

impl End {
    /// The result that stands, or has stood, whatever became of what should follow it.
    pub fn standing(&self) -> Option<&Done> {
        match self {
            Self::Done(done) | Self::Later(done, _) | Self::Held(done, _) | Self::Outdated(done) => Some(done),
            Self::Taken(done, _) | Self::Unchained(done, _) => Some(done),
            Self::Same
            | Self::Unwanted
            | Self::Changed
            | Self::Waiting(_)
            | Self::Again(_)
            | Self::Unwritten(_)
            | Self::Lost => None,
        }
    }
}

/// What became of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Done {
    /// The report, as it stands on disk.
    pub report: Report,
    /// Whether an older result was up to date.
    pub up_to_date: bool,
}

impl Job {
    /// The job for a file whose result goes to `name`.
    pub fn new(path: PathBuf, name: PathBuf, bytes: u64) -> Self {
        let (unwanted, beside) = (AtomicBool::new(false), Mutex::default());
        Self { path, name, bytes, look: None, since: None, within: None, doubted: None, unwanted, beside }
    }

    /// The job for a file that is named: its result has its name.
    pub fn of_file(path: PathBuf) -> Self {
        let name = path.file_name().map(PathBuf::from).unwrap_or_default();
        let look = Look::at(&path).ok().flatten();
        Self { look, ..Self::new(path, name, look.map_or(0, |look| look.bytes)) }
    }

    /// The job for a file in a folder that is named.
    pub fn of_folder(folder: &Path, path: PathBuf) -> Self {
        Self { within: Some(folder.to_owned()), ..Self::of_file(path) }
    }

    /// The job for a file that was seen in the folder `inbox` under the relative path `name`, and has not changed `since`.
    pub fn of_inbox(inbox: &Path, name: &Path, look: Look, since: Instant) -> Self {
        let (path, look, since, within) = (inbox.join(name), Some(look), Some(since), Some(inbox.to_owned()));
        Self { since, within, look, ..Self::new(path, name.to_owned(), look.map_or(0, |look| look.bytes)) }
    }

    /// This job, if it is only to see whether the file still has the content with this hash.
    pub fn doubting(self, hash: Hash) -> Self {
        Self { doubted: Some(hash), ..self }
    }

    /// Opens the file.
    ///
    /// # Errors
    /// Where it is none, or must not be opened.
    pub fn open(&self) -> Result<File, OpenError> {
        match &self.within {
            Some(folder) => regular::open_inside(folder, &self.path),
            None => regular::open(&self.path),
        }
    }

    /// Nobody wants the result any more: work ends at the next safe point, and nothing is published.
    pub fn cancel(&self) {
        self.unwanted.store(true, Ordering::Relaxed);
    }

    /// Whether the result is still wanted.
    pub fn is_wanted(&self) -> bool {
        !self.unwanted.load(Ordering::Relaxed)
    }

    /// The names of the files beside it that it asked for when it was read.
    pub fn beside(&self) -> Vec<String> {
        self.beside.lock().clone()
    }

    /// Tells which files beside it it asked for.
    pub fn set_beside(&self, names: Vec<String>) {
        *self.beside.lock() = names;
    }

    /// Whether the file still is what was seen; always, where nothing was.
    pub fn is_unchanged(&self) -> bool {
        self.look.is_none_or(|seen| Look::at(&self.path).is_ok_and(|now| now == Some(seen)))
    }
}
