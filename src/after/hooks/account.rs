//! hooks.json: what the commands did. The schema is in docs/hooks.schema.json; within version 1 it only grows.

use super::Hook;
use super::output::Tail;
use super::process::{End, Ended, Limits};
use crate::settings::RawCommand;
use serde::{Deserialize, Serialize};
use std::os::unix::process::ExitStatusExt;

/// The version of the schema.
pub const SCHEMA: u32 = 1;

/// The account of a result's commands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Account {
    /// Version of the schema.
    pub schema: u32,
    /// The hash (blake3) of the report.json to which this belongs.
    pub report: String,
    /// The commands, in their order.
    pub commands: Vec<Ran>,
}

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// With exit code 0.
    Succeeded,
    /// With another exit code, or by a signal that planish did not send.
    Failed,
    /// It took longer than its time limit, and was ended.
    TimedOut,
    /// It wrote more than planish keeps, and was ended.
    TooMuchOutput,
    /// The system could not start it.
    NotStarted,
    /// A command before it did not succeed.
    Skipped,
}

/// What became of a command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ran {
    /// Program and arguments as they are configured.
    pub configured: Vec<String>,
    /// The time limit, in seconds.
    pub time_limit: f64,
    /// Program and arguments, with their placeholders filled in; what is no UTF-8 is replaced.
    pub command: Vec<String>,
    /// How it ended.
    pub outcome: Outcome,
    /// Its exit code; null where it has none.
    pub exit_code: Option<i32>,
    /// The signal that ended it; null where none did.
    pub signal: Option<i32>,
    /// What is wrong and what to do; null where it succeeded.
    pub message: Option<String>,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// The last 64 KiB of its standard output; what is no UTF-8 is replaced.
    pub stdout: String,
    /// Whether standard output was longer.
    pub stdout_truncated: bool,
    /// The last 64 KiB of its standard error; what is no UTF-8 is replaced.
    pub stderr: String,
    /// Whether standard error was longer.
    pub stderr_truncated: bool,
}

impl Account {
    /// The first command that did not succeed.
    pub fn failure(&self) -> Option<&Ran> {
        self.commands.iter().find(|c| c.outcome != Outcome::Succeeded)
    }

    /// Whether this is what became of `hooks` for the report with this hash.
    pub(super) fn is_of(&self, hooks: &[Hook], report: &str) -> bool {
        self.schema == SCHEMA
            && self.report == report
            && self.commands.len() == hooks.len()
            && self.commands.iter().zip(hooks).all(|(ran, hook)| ran.is_of(hook))
    }
}

impl Ran {
    fn is_of(&self, hook: &Hook) -> bool {
        let RawCommand { command, time_limit } = hook.configured();
        (&self.configured, self.time_limit) == (command, *time_limit)
    }

    /// A command that ran; none where nobody wants to know any more.
    pub(super) fn ended(hook: &Hook, command: Vec<String>, ended: Ended, limits: Limits) -> Option<Self> {
        let succeeded = ended.status.is_some_and(|s| s.success());
        let outcome = match ended.end {
            End::Exited if succeeded => Outcome::Succeeded,
            End::Exited => Outcome::Failed,
            End::TimedOut => Outcome::TimedOut,
            End::TooMuchOutput => Outcome::TooMuchOutput,
            End::Unwanted => return None,
        };
        let message = message(outcome, &ended, limits);
        let exit_code = ended.status.and_then(|s| s.code());
        let signal = signal(&ended);
        let Tail { text: stdout, truncated: stdout_truncated } = ended.stdout;
        let Tail { text: stderr, truncated: stderr_truncated } = ended.stderr;
        let outputs = Self { stdout, stdout_truncated, stderr, stderr_truncated, ..Self::silent(hook, command) };
        let seconds = (ended.seconds * 1e3).round() / 1e3;
        Some(Self { outcome, exit_code, signal, message, seconds, ..outputs })
    }

    /// A command that the system did not start.
    pub(super) fn not_started(hook: &Hook, command: Vec<String>, error: &std::io::Error) -> Self {
        let program = command.first().cloned().unwrap_or_default();
        let remedy = match error.kind() {
            std::io::ErrorKind::NotFound => {
                "install it, put its folder on the PATH that planish was started with, or give its full path \
                 (for a script: is the program after #! there?)"
            }
            std::io::ErrorKind::PermissionDenied => "make the file executable for the user who runs planish",
            _ => "name a program of this machine; a script must begin with #! and its interpreter",
        };
        let message = Some(format!("cannot start {program}: {error}; {remedy}"));
        Self { outcome: Outcome::NotStarted, message, ..Self::silent(hook, command) }
    }

    /// A command whose turn did not come.
    pub(super) fn skipped(hook: &Hook, command: Vec<String>) -> Self {
        let message = "a command before it did not succeed: correct that one, and all run again".to_owned();
        Self { message: Some(message), ..Self::silent(hook, command) }
    }

    fn silent(hook: &Hook, command: Vec<String>) -> Self {
        Self {
            configured: hook.configured().command.clone(),
            time_limit: hook.configured().time_limit,
            command,
            outcome: Outcome::Skipped,
            exit_code: None,
            signal: None,
            message: None,
            seconds: 0.0,
            stdout: String::new(),
            stdout_truncated: false,
            stderr: String::new(),
            stderr_truncated: false,
        }
    }
}

/// What is wrong with a command that ran, and what to do.
fn message(outcome: Outcome, ended: &Ended, limits: Limits) -> Option<String> {
    match outcome {
        Outcome::Succeeded | Outcome::Skipped | Outcome::NotStarted => None,
        Outcome::Failed => Some(match (ended.status.and_then(|s| s.code()), signal(ended)) {
            (Some(code), _) => format!("it ended with exit code {code}; its standard error may say why"),
            (None, Some(signal)) => format!("signal {signal} ended it; did the machine run out of memory?"),
            (None, None) => "it ended without an exit code".to_owned(),
        }),
        Outcome::TimedOut => Some(format!(
            "it took longer than its time-limit of {} s and was ended; give it more, or less to do",
            limits.seconds
        )),
        Outcome::TooMuchOutput => Some(format!(
            "it printed more than {} bytes and was ended; let it print less, or into a file",
            limits.output
        )),
    }
}

fn signal(ended: &Ended) -> Option<i32> {
    ended.status.and_then(|s| s.signal())
}
