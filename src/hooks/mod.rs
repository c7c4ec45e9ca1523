//! Commands that run after an input is certified: `[[on_certified]]` of planish.toml.
//!
//! The commands of a result are a chain: they run one after another, in the result folder, and where one does not
//! succeed the ones after it are skipped. What they did stands in `hooks.json` beside the report (docs/hooks.md). A
//! chain that was broken off because its result is no longer wanted leaves no account and runs again, from its
//! beginning, at the next opportunity: commands run **at least once** for each report, and again when they are
//! configured anew; a failure is not repeated.
//!
//! No shell is involved: a file name is one argument, whatever it holds. What a command leaves running in its process
//! group is ended with it.

mod account;
mod process;
mod template;

use crate::disk::{self, Disk, System};
use crate::report;
use crate::settings::OnCertified;
use crate::shown::{printable, printable_json, shown};
use crate::stages::read_file;
pub use account::{Account, Outcome, Ran, SCHEMA};
use process::{Limits, Trouble};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use template::Template;
pub use template::TemplateError;

/// The name of the account in a result folder.
pub const FILE: &str = "hooks.json";

/// A command may print this much, in bytes, on standard output and on standard error.
const OUTPUT: u64 = 256 << 20;

/// How long a command may take to end when it is asked to (SIGTERM), before it is killed.
const GRACE: Duration = Duration::from_secs(2);

/// A command, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Hook {
    configured: OnCertified,
    arguments: Vec<Template>,
}

/// Why a command is refused: wrong usage.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HookRefused {
    /// There is no program.
    #[error("command names no program; give a list of program and arguments, as in [\"gmsh\", \"{{remesh}}\", \"-2\"]")]
    Empty,
    /// An argument is wrong.
    #[error("command, part {part} ({text:?}): {error}")]
    Argument {
        /// Which, from 1; 1 is the program.
        part: usize,
        /// The argument.
        text: String,
        /// Why.
        error: TemplateError,
    },
    /// The program is looked for in a folder that depends on the result.
    #[error("command begins with the relative path {0:?}; give the full path, or a name alone to be found on the PATH")]
    RelativeProgram(String),
    /// The time limit is none.
    #[error("time-limit is {0}; it must be a positive number of seconds")]
    TimeLimit(f64),
}

impl Hook {
    /// Checks a command.
    ///
    /// # Errors
    /// [`HookRefused`] for what can never run.
    pub fn new(configured: OnCertified) -> Result<Self, HookRefused> {
        let OnCertified { command, time_limit } = &configured;
        if !(*time_limit > 0.0 && time_limit.is_finite()) {
            return Err(HookRefused::TimeLimit(*time_limit));
        }
        let parse = |(i, text): (usize, &String)| {
            Template::parse(text).map_err(|error| HookRefused::Argument { part: i + 1, text: text.clone(), error })
        };
        let arguments = command.iter().enumerate().map(parse).collect::<Result<Vec<_>, _>>()?;
        match arguments.first() {
            Some(program) if program.is_relative_path() => Err(HookRefused::RelativeProgram(command[0].clone())),
            Some(program) if !program.is_empty() => Ok(Self { configured, arguments }),
            _ => Err(HookRefused::Empty),
        }
    }

    /// The command as it is configured.
    pub fn configured(&self) -> &OnCertified {
        &self.configured
    }

    fn limits(&self) -> Limits {
        Limits { seconds: self.configured.time_limit, output: OUTPUT, grace: GRACE }
    }
}

/// The result for which commands run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    input: PathBuf,
    folder: PathBuf,
}

impl Target {
    /// The result of the file `input` in `folder`.
    ///
    /// # Errors
    /// [`HookError`] where a path is empty, or relative to a folder that is gone.
    pub fn new(input: &Path, folder: &Path) -> Result<Self, HookError> {
        let absolute = |path: &Path| std::path::absolute(path).map_err(at(path));
        Ok(Self { input: absolute(input)?, folder: absolute(folder)? })
    }

    /// The input file, by its absolute path.
    pub fn input(&self) -> &Path {
        &self.input
    }

    /// The result folder, by its absolute path.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The hash of the report.
    fn report(&self) -> Option<String> {
        let bytes = read_file(&self.folder.join(report::FILE)).ok()?;
        Some(blake3::hash(&bytes).to_hex().to_string())
    }
}

/// Why commands could not run, or their account not be written. What a command itself does wrong is told by the
/// account.
#[derive(Debug, thiserror::Error)]
pub enum HookError {
    /// The system refuses.
    #[error(
        "commands after certification: {}: {error}; check that the disk has room and the folder may be written",
        shown(.path)
    )]
    Io {
        /// Where.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// There is no result.
    #[error("commands after certification: {} holds no report.json that can be read; process its input again", shown(.0))]
    NoReport(PathBuf),
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
    serde_json::from_slice(&read_file(&target.folder.join(FILE)).ok()?).ok()
}

/// Whether `hooks` have not run for the report that is in the folder, or are configured otherwise since. A chain that
/// failed is not due. Whoever asks knows that the result is certified.
pub fn are_due(hooks: &[Hook], target: &Target) -> bool {
    let Some(report) = target.report().filter(|_| !hooks.is_empty()) else { return false };
    account(target).is_none_or(|a| !a.is_of(hooks, &report))
}

/// Runs `hooks` for a certified result and writes the account beside its report. `staging` is a folder on the same
/// file system, for outputs; `wanted` is asked all the time whether to go on.
///
/// None where no account is written: there are no hooks, or the result is no longer wanted (or no longer there, or
/// another one). Blocks as long as the commands take, but not much longer than their time limits.
///
/// # Errors
/// [`HookError`] where the system fails. A command that fails is none: see [`Account::failure`].
pub fn run(
    hooks: &[Hook],
    target: &Target,
    staging: &Path,
    wanted: &dyn Fn() -> bool,
) -> Result<Option<Account>, HookError> {
    if hooks.is_empty() {
        return Ok(None);
    }
    let report = target.report().ok_or_else(|| HookError::NoReport(target.folder.clone()))?;
    let mut commands: Vec<Ran> = Vec::new();
    for hook in hooks {
        let may_run = commands.iter().all(|c| c.outcome == Outcome::Succeeded);
        let ran = if may_run {
            run_one(hook, target, staging, wanted)?
        } else {
            Some(Ran::skipped(hook, told(&program(hook, target))))
        };
        let Some(ran) = ran else {
            tracing::debug!("commands broken off: the result is no longer wanted");
            return Ok(None);
        };
        commands.push(ran);
    }
    let account = Account { schema: SCHEMA, report, commands };
    // Another process may have published another result meanwhile.
    if target.report().as_ref() != Some(&account.report) {
        return Ok(None);
    }
    write(&account, target, staging)?;
    Ok(Some(account))
}

/// Runs a command; none where it was not, or is no longer, wanted.
fn run_one(hook: &Hook, target: &Target, staging: &Path, wanted: &dyn Fn() -> bool) -> Result<Option<Ran>, HookError> {
    if !wanted() {
        return Ok(None);
    }
    let mut command = program(hook, target);
    let words = told(&command);
    tracing::debug!(command = ?words, "command begins");
    let ran = match process::run(&mut command, staging, hook.limits(), wanted) {
        Ok(ended) => Ran::ended(hook, words, ended, hook.limits()),
        Err(Trouble::Start(error)) => Some(Ran::not_started(hook, words, &error)),
        Err(Trouble::System(error)) => return Err(at(staging)(error)),
    };
    if let Some(Ran { command, message: Some(message), .. }) = &ran {
        tracing::warn!(?command, "command did not succeed: {}", printable(message));
    }
    Ok(ran)
}

/// The command for a result.
fn program(hook: &Hook, target: &Target) -> Command {
    let mut words = hook.arguments.iter().map(|a| a.fill(target));
    let mut command = Command::new(words.next().unwrap_or_default());
    command.args(words).current_dir(&target.folder);
    command
}

/// Program and arguments as they may be shown.
fn told(command: &Command) -> Vec<String> {
    std::iter::once(command.get_program()).chain(command.get_args()).map(|w| w.to_string_lossy().into_owned()).collect()
}

/// Writes the account at once: complete, or not there.
fn write(account: &Account, target: &Target, staging: &Path) -> Result<(), HookError> {
    let text = printable_json(&serde_json::to_string_pretty(account).map_err(HookError::Account)?) + "\n";
    let desk = System.open(staging).map_err(at(staging))?;
    let folder = System.open(&target.folder).map_err(at(&target.folder))?;
    disk::replace_file(&desk, &folder, FILE, text.as_bytes()).map_err(at(&target.folder.join(FILE)))
}

#[cfg(all(test, unix))]
mod tests;
