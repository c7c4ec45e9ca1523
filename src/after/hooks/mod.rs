//! Commands that run when an input is done: `[[on_certified]]` and `[[on_refused]]` of planish.toml.
//!
//! The commands of a result are a chain: they run one after another, in the result folder, and where one does not
//! succeed the ones after it are skipped. What they did stands in `hooks.json` beside the report (docs/hooks.md). A
//! chain that was broken off because its result is no longer wanted leaves no account and runs again, from its
//! beginning, at the next opportunity: commands run **at least once** for each report, and again when they are
//! configured anew; a failure is not repeated. Nor is a chain one of whose commands takes the result away: there is no
//! place for its account, and what was taken would only be made again for it.
//!
//! That the system has no process or handle to spare at the moment says nothing about a command: the chain is broken
//! off, too.
//!
//! No shell is involved: a file name is one argument, whatever it holds. What a command leaves running in its process
//! group is ended with it, and what a killed planish has left running is ended before anything runs again
//! ([`orphans::end_those_of`]).

mod account;
mod fill;
mod output;
mod process;

use crate::input::read_file;
use crate::result_files;
use crate::settings::Hook;
use crate::system::disk::{self, Disk, System};
use crate::system::escape::{escape, printable, printable_json};
use crate::system::orphans::{self, GRACE};
use crate::system::passing;
pub use account::{Account, Outcome, Ran, SCHEMA};
use process::{Limits, Trouble};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A command may print this much, in bytes, on standard output and on standard error. By experience:
/// less would end programs that tell all that they do, more lets one run on that prints without end.
const OUTPUT: u64 = 256 << 20;

/// The result for which commands run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    input: PathBuf,
    folder: PathBuf,
    code: String,
}

impl Target {
    /// The result of the file `input` in `folder`.
    ///
    /// # Errors
    /// [`HookError`] where a path is empty, or relative to a folder that is gone.
    pub fn new(input: &Path, folder: &Path) -> Result<Self, HookError> {
        let absolute = |path: &Path| std::path::absolute(path).map_err(at(path));
        Ok(Self { input: absolute(input)?, folder: absolute(folder)?, code: String::new() })
    }

    /// The result of an input that was refused, or failed, for this reason.
    pub fn with_code(self, code: String) -> Self {
        Self { code, ..self }
    }

    /// The input file, by its absolute path.
    pub fn input(&self) -> &Path {
        &self.input
    }

    /// The result folder, by its absolute path.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The code of the reason; empty for a certified input.
    pub fn code(&self) -> &str {
        &self.code
    }

    /// Whether the result is where it was published.
    pub fn is_there(&self) -> bool {
        self.report().is_some()
    }

    /// The hash of the report.
    fn report(&self) -> Option<String> {
        let bytes = read_file(&self.folder.join(result_files::REPORT)).ok()?;
        Some(blake3::hash(&bytes).to_hex().to_string())
    }
}

/// Why commands could not run, or their account not be written. What a command itself does wrong is told by the
/// account.
#[derive(Debug, thiserror::Error)]
pub enum HookError {
    /// The system refuses.
    #[error(
        "commands cannot run: {}: {error}; check that the disk has room and the folder may be written",
        escape(.path)
    )]
    Io {
        /// Where.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// There is no result.
    #[error("commands cannot run: {} holds no report.json that can be read; process its input again", escape(.0))]
    NoReport(PathBuf),
    /// The system has no room for another process at the moment.
    #[error(
        "command {} cannot be started now: {error}; it runs at the next opportunity: end other processes, or raise \
         their limits (`ulimit -u`, `ulimit -n`, TasksMax=)", printable(.program)
    )]
    NoRoom {
        /// The program.
        program: String,
        /// Why.
        error: io::Error,
    },
    /// The account does not become JSON.
    #[error("hooks.json cannot be written: {0}; that is a fault of planish")]
    Account(serde_json::Error),
}

/// Attaches the path to an I/O error.
fn at(path: &Path) -> impl FnOnce(io::Error) -> HookError {
    let path = path.to_owned();
    move |error| HookError::Io { path, error }
}

/// What became of the commands of a result, if that is told.
pub fn account(target: &Target) -> Option<Account> {
    let text = read_file(&target.folder.join(result_files::HOOKS)).ok()?;
    serde_json::from_slice(&text).ok()
}

/// Whether `hooks` have not run for the report that is in the folder, or are configured otherwise since. A chain that
/// failed is not due. Whoever asks knows that these are the commands for such a result.
pub fn are_due(hooks: &[Hook], target: &Target) -> bool {
    let Some(report) = target.report().filter(|_| !hooks.is_empty()) else { return false };
    account(target).is_none_or(|a| !a.is_of(hooks, &report))
}

/// What became of a chain of commands.
#[derive(Clone, Debug, PartialEq)]
pub enum Chain {
    /// It ran to its end, be it a bad one; its account is written beside the report.
    Over(Account),
    /// It is to run again: the result is no longer wanted, or another one is in its place. There is no account.
    BrokenOff,
    /// The result was taken away while this command ran (1 is the first). There is no account.
    Taken(usize),
}

/// Runs `hooks` on a result and writes the account beside its report. `staging` is the staging folder of this process,
/// on the same file system; `wanted` is asked all the time whether to go on.
///
/// Blocks as long as the commands take, but not much longer than their time limits.
///
/// # Errors
/// [`HookError`] where the system fails. A command that fails is none: see [`Account::failure`].
pub fn run(hooks: &[Hook], target: &Target, staging: &Path, wanted: &dyn Fn() -> bool) -> Result<Chain, HookError> {
    let report = target.report().ok_or_else(|| HookError::NoReport(target.folder.clone()))?;
    let mut commands: Vec<Ran> = Vec::new();
    for hook in hooks {
        if commands.iter().any(|c| c.outcome != Outcome::Succeeded) {
            commands.push(Ran::skipped(hook, describe(&program(hook, target))));
            continue;
        }
        let ran = run_one(hook, target, staging, wanted)?;
        let now = target.report();
        // What nobody wants any more is broken off, wherever its result is.
        if ran.is_some() && now.is_none() {
            return Ok(Chain::Taken(commands.len() + 1));
        }
        let Some(ran) = ran.filter(|_| now.as_ref() == Some(&report)) else {
            tracing::debug!("commands broken off: the result is no longer wanted, or another one is in its place");
            return Ok(Chain::BrokenOff);
        };
        commands.push(ran);
    }
    let account = Account { schema: SCHEMA, report, commands };
    write(&account, target, staging)?;
    Ok(Chain::Over(account))
}

/// Runs a command; none where it was not, or is no longer, wanted.
fn run_one(hook: &Hook, target: &Target, staging: &Path, wanted: &dyn Fn() -> bool) -> Result<Option<Ran>, HookError> {
    if !wanted() {
        return Ok(None);
    }
    let mut command = program(hook, target);
    let words = describe(&command);
    tracing::debug!(command = ?words, "command begins");
    orphans::mark(&mut command, staging).map_err(at(staging))?;
    let ran = match process::run(&mut command, limits(hook), wanted) {
        Ok(ended) => Ran::ended(hook, words, ended, limits(hook)),
        Err(Trouble::Start(error)) if is_for_want_of_room(&error) => {
            return Err(HookError::NoRoom { program: words[0].clone(), error });
        }
        Err(Trouble::Start(error)) => Some(Ran::not_started(hook, words, &error)),
        Err(Trouble::System(error)) => return Err(at(&target.folder)(error)),
    };
    if let Some(Ran { command, message: Some(message), .. }) = &ran {
        tracing::warn!(?command, "command did not succeed: {}", printable(message));
    }
    Ok(ran)
}

/// The limits of a command.
fn limits(hook: &Hook) -> Limits {
    Limits { seconds: hook.configured().time_limit, output: OUTPUT, grace: GRACE }
}

/// Whether a program could not be started for a reason that passes: it says nothing about the program. A file that
/// somebody still writes cannot be started, either.
fn is_for_want_of_room(error: &io::Error) -> bool {
    passing::passes(error) || error.kind() == io::ErrorKind::ExecutableFileBusy
}

/// The command for a result.
fn program(hook: &Hook, target: &Target) -> Command {
    let mut words = hook.arguments().iter().map(|argument| fill::fill(argument, target));
    let mut command = Command::new(words.next().unwrap_or_default());
    command.args(words).current_dir(&target.folder);
    command
}

/// Program and arguments as they may be shown.
fn describe(command: &Command) -> Vec<String> {
    let mut words = vec![command.get_program().to_string_lossy().into_owned()];
    words.extend(command.get_args().map(|argument| argument.to_string_lossy().into_owned()));
    words
}

/// Writes the account at once: complete, or not there.
fn write(account: &Account, target: &Target, staging: &Path) -> Result<(), HookError> {
    let json = serde_json::to_string_pretty(account).map_err(HookError::Account)?;
    let text = printable_json(&json) + "\n";
    let desk = System.open(staging).map_err(at(staging))?;
    let folder = System.open(&target.folder).map_err(at(&target.folder))?;
    let written = disk::replace_file(&desk, &folder, result_files::HOOKS, text.as_bytes());
    written.map_err(at(&target.folder.join(result_files::HOOKS)))
}

#[cfg(test)]
mod tests;
