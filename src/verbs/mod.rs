//! The verbs of the command line.

mod atlas;
pub mod check;
pub mod check_config;
pub mod check_mesh;
mod finer;
pub mod info;
pub mod job;
pub mod lift;
mod planar_input;
pub mod retry;
pub mod run;
pub mod status;
pub mod transfer;
pub mod watch;

use std::io::Write;

/// What is said where the stages cannot be started.
fn no_threads(error: &std::io::Error) -> String {
    format!("cannot start the threads of the stages: {error}; give a lower --jobs, or raise the limit of processes")
}

/// What is said where results have no place.
const NO_OUT: &str = "no output folder: give --out DIR (or out = \"DIR\" in planish.toml)";

/// Prints a line on standard output. That nobody reads it (a closed pipe, a full disk) is no reason to stop: the
/// exit code and the files tell the result.
fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{}", printable_lines(line));
}

/// Prints a line of JSON.
fn say_json(value: &impl serde::Serialize) -> serde_json::Result<()> {
    let json = printable_json(&serde_json::to_string(value)?);
    let _ = writeln!(std::io::stdout(), "{json}");
    Ok(())
}

/// Prints a line on standard error, where somebody reads it.
pub fn eprint_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "planish: {}", printable_lines(line));
}

use crate::system::escape::{escape, printable_json, printable_lines};

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
