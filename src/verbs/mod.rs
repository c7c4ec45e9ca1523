//! The verbs of the command line.

pub mod check;
pub mod info;
pub mod run;

/// Every verb says how it ended: the exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All certified, nothing refused.
    Success,
    /// At least one input refused or failed, or one result not proven.
    Refused,
    /// Wrong usage.
    Usage,
}

impl From<Exit> for std::process::ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(match exit {
            Exit::Success => 0,
            Exit::Refused => 1,
            Exit::Usage => 2,
        })
    }
}
