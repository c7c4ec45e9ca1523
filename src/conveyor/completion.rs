//! How a job ended: told exactly once.

use crate::input::job::Job;
use crate::outcome::Reason;
use crate::output::publish::PublishError;
use crate::report::Report;
use std::sync::Arc;
use std::time::Instant;

/// A job that has ended.
#[derive(Debug)]
pub struct Completion {
    /// The job.
    pub job: Arc<Job>,
    /// How it ended.
    pub end: End,
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
