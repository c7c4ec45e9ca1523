//! The bytes of an input: read or hashed, from the very file that was seen.

use super::job::Job;
use crate::outcome::{Code, Reason};
use crate::settings::Settings;
use crate::system::fingerprint::Fingerprint;
use crate::system::passing;
use crate::system::safe_open::{self, OpenError};
use std::fs::File;
use std::path::Path;

/// Why an input is not read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unread {
    /// The reason.
    pub reason: Reason,
    /// Whether it says nothing about the input itself, and passes.
    pub passes: bool,
}

impl From<OpenError> for Unread {
    fn from(error: OpenError) -> Self {
        let passes = matches!(&error, OpenError::Io(error) if passing::passes(error));
        Self { reason: unreadable(error), passes }
    }
}

/// Reads an input, as far as it is not too large. What is read is the file that was seen, whatever took its name since.
///
/// # Errors
/// Why not.
pub fn read_input(job: &Job, settings: &Settings) -> Result<Vec<u8>, Unread> {
    Ok(safe_open::read(&open_input(job)?, settings.limits.file)?)
}

/// The hash of an input, and its size in bytes; as [`read_input`], but nothing of it is kept.
///
/// # Errors
/// Why not.
pub fn hash_input(job: &Job, settings: &Settings) -> Result<(blake3::Hash, u64), Unread> {
    Ok(safe_open::hash(&open_input(job)?, settings.limits.file)?)
}

fn open_input(job: &Job) -> Result<File, Unread> {
    let file = job.open()?;
    let is_seen = |seen: &Fingerprint| file.metadata().is_ok_and(|m| Fingerprint::of(&m) == *seen);
    if job.look.as_ref().is_none_or(is_seen) {
        return Ok(file);
    }
    let reason = Reason::new(Code::Unreadable, "the file changed when it was opened; try again");
    Err(Unread { reason, passes: false })
}

/// Reads a regular file whole. Anything else (a folder, a pipe, a device) could block for ever.
///
/// # Errors
/// Why it cannot be read.
pub fn read_file(path: &Path) -> Result<Vec<u8>, Reason> {
    let mut bytes = Vec::new();
    read_file_into(path, &mut bytes)?;
    Ok(bytes)
}

/// As [`read_file`], in the place of what `bytes` hold: memory that is there is used again.
///
/// # Errors
/// As [`read_file`].
pub fn read_file_into(path: &Path, bytes: &mut Vec<u8>) -> Result<(), Reason> {
    safe_open::open(path).and_then(|file| safe_open::read_into(&file, u64::MAX, bytes)).map_err(unreadable)
}

fn unreadable(error: OpenError) -> Reason {
    match error {
        OpenError::TooLarge { size, most } => {
            let remedy = "split or decimate it, or raise `file` in the table [limits] of planish.toml";
            Reason::new(Code::TooLarge, format!("the file has {size} bytes, more than {most}: {remedy}"))
        }
        other => Reason::new(Code::Unreadable, format!("cannot read the file: {other}")),
    }
}
