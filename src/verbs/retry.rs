//! `planish retry`: results that are not certified are removed, so that their inputs are done again: by the daemon that
//! runs, which looks for results that were removed, or by the next one.

use super::{Exit, eprint_line, say};
use crate::operating::status;
use crate::outcome::Status;
use crate::output::begun;
use crate::output::ledger::Entry;
use crate::output::withdraw::{Standing, WithdrawError};
use crate::result_files;
use crate::settings::Settings;
use crate::system::escape::escape;
use crate::system::safe_open;
use std::io;
use std::path::{Path, PathBuf};

/// A longer report is none.
const LONGEST: u64 = 1 << 30;

/// Why an input is not done again.
#[derive(Debug, thiserror::Error)]
enum Refused {
    #[error("there is no such result; `planish status` names those that are not certified")]
    Unknown,
    #[error("it is certified; `planish run --force` does it again all the same")]
    Certified,
    #[error(
        "there are files in its result that planish did not write, and without its report a newer result could not take \
         its place: move them away first"
    )]
    Foreign,
    #[error("its result cannot be removed: {0}")]
    Io(#[from] io::Error),
}

impl From<WithdrawError> for Refused {
    fn from(error: WithdrawError) -> Self {
        match error {
            WithdrawError::NoResult => Self::Unknown,
            WithdrawError::Io(error) => Self::Io(error),
        }
    }
}

/// Has inputs done again, by the names of their results.
///
/// # Errors
/// Wrong usage.
pub fn retry(names: &[PathBuf], settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let out = settings.out.as_deref().ok_or(super::NO_OUT)?;
    let by_whom = if status::is_running(out) { "the daemon does it again" } else { "the next daemon does it again" };
    let mut exit = Exit::Success;
    for name in names {
        match remove(out, name) {
            Ok(()) if settings.quiet => {}
            Ok(()) => say(&format!("{}: {by_whom}, if it is still in the inbox", escape(name))),
            Err(refused) => {
                eprint_line(&format!("{}: {refused}", escape(name)));
                exit = Exit::Refused;
            }
        }
    }
    Ok(exit)
}

/// Removes a result that is not certified, and forgets who died of its input.
fn remove(out: &Path, name: &Path) -> Result<(), Refused> {
    let standing = Standing::find(out, name)?;
    if entry(out, name).ok_or(Refused::Unknown)?.status == Status::Certified {
        return Err(Refused::Certified);
    }
    if standing.holds_foreign()? {
        return Err(Refused::Foreign);
    }
    // First: the daemon may look at any moment.
    begun::forgive(out, name);
    standing.remove()?;
    Ok(())
}

/// What the report of a result says.
fn entry(out: &Path, name: &Path) -> Option<Entry> {
    safe_open::read_json(safe_open::open_below(out, &name.join(result_files::REPORT)), LONGEST)
}
