//! One command, watched until it is over.
//!
//! Its output goes to files, not to pipes: a child that it leaves behind with a pipe open would keep planish waiting.
//! It leads a process group of its own, so that what it started ends with it, and so that the terminal's Ctrl-C
//! reaches planish alone, which decides. A process that leaves the group (`setsid`) is on its own.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How often a command is looked at.
const POLL: Duration = Duration::from_millis(20);

/// How long a killed process may take to be gone. The system delays it only where it hangs in a device.
const DYING: Duration = Duration::from_secs(5);

/// This much of the end of an output is kept.
const TAIL: u64 = 64 << 10;

/// What a command may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Bytes on standard output, and as many on standard error.
    pub output: u64,
    /// How long it may take to end by itself when it is asked to.
    pub grace: Duration,
}

/// Why a command is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It ended by itself.
    Exited,
    /// It took longer than it may.
    TimedOut,
    /// It wrote more than it may.
    TooMuchOutput,
    /// Nobody wants its result any more.
    Unwanted,
}

/// The end of an output.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tail {
    /// The text; what is no UTF-8 is replaced.
    pub text: String,
    /// Whether something before it is missing.
    pub truncated: bool,
}

/// What became of a command.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    /// Why it is over.
    pub end: End,
    /// What it returned; none for a process that not even SIGKILL ends in time.
    pub status: Option<ExitStatus>,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Standard output.
    pub stdout: Tail,
    /// Standard error.
    pub stderr: Tail,
}

/// Why a command was not watched to its end.
#[derive(Debug)]
pub enum Trouble {
    /// It does not start.
    Start(io::Error),
    /// Its output has no place, or it cannot be watched.
    System(io::Error),
}

/// Runs a command, with its output in temporary files in `staging`, until it ends, breaks a limit, or is no longer
/// `wanted`.
pub fn run(command: &mut Command, staging: &Path, limits: Limits, wanted: &dyn Fn() -> bool) -> Result<Ended, Trouble> {
    let outputs = [output(staging).map_err(Trouble::System)?, output(staging).map_err(Trouble::System)?];
    let [stdout, stderr] = &outputs;
    command.stdin(Stdio::null());
    command.stdout(stdout.as_file().try_clone().map_err(Trouble::System)?);
    command.stderr(stderr.as_file().try_clone().map_err(Trouble::System)?);
    let started = Instant::now();
    let mut group = Group::start(command).map_err(Trouble::Start)?;
    let end = watch(&mut group, &outputs, limits, wanted);
    group.end(limits.grace);
    Ok(Ended {
        end: end.map_err(Trouble::System)?,
        status: group.status,
        seconds: started.elapsed().as_secs_f64(),
        stdout: tail(stdout.as_file()).map_err(Trouble::System)?,
        stderr: tail(stderr.as_file()).map_err(Trouble::System)?,
    })
}

/// A file for output. It is always written at its end, whoever else writes to it.
fn output(staging: &Path) -> io::Result<tempfile::NamedTempFile> {
    tempfile::Builder::new().prefix("output-").append(true).tempfile_in(staging)
}

fn watch(
    group: &mut Group,
    outputs: &[tempfile::NamedTempFile],
    limits: Limits,
    wanted: &dyn Fn() -> bool,
) -> io::Result<End> {
    let started = Instant::now();
    loop {
        if group.has_exited()? {
            return Ok(End::Exited);
        }
        if !wanted() {
            return Ok(End::Unwanted);
        }
        if started.elapsed().as_secs_f64() >= limits.seconds {
            return Ok(End::TimedOut);
        }
        for file in outputs {
            if file.as_file().metadata()?.len() > limits.output {
                return Ok(End::TooMuchOutput);
            }
        }
        std::thread::sleep(POLL);
    }
}

/// Whether something comes true in time.
fn within(time: Duration, mut is_true: impl FnMut() -> bool) -> bool {
    let started = Instant::now();
    while !is_true() {
        if started.elapsed() >= time {
            return false;
        }
        std::thread::sleep(POLL);
    }
    true
}

/// The end of a file, cut between characters where it is text.
fn tail(mut file: &File) -> io::Result<Tail> {
    let begin = file.metadata()?.len().saturating_sub(TAIL);
    file.seek(SeekFrom::Start(begin))?;
    let mut bytes = Vec::new();
    file.take(TAIL).read_to_end(&mut bytes)?;
    let continues = |b: &&u8| **b & 0xC0 == 0x80;
    let cut = if begin > 0 { bytes.iter().take(3).take_while(continues).count() } else { 0 };
    Ok(Tail { text: String::from_utf8_lossy(&bytes[cut..]).into_owned(), truncated: begin > 0 })
}

/// A process and those that it started.
struct Group {
    child: Child,
    status: Option<ExitStatus>,
}

impl Group {
    fn start(command: &mut Command) -> io::Result<Self> {
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(command, 0);
        Ok(Self { child: command.spawn()?, status: None })
    }

    /// Whether the first process is over; then it is reaped.
    fn has_exited(&mut self) -> io::Result<bool> {
        if self.status.is_none() {
            self.status = self.child.try_wait()?;
        }
        Ok(self.status.is_some())
    }

    /// Whether nothing of the group is left.
    fn is_over(&mut self) -> bool {
        self.has_exited().unwrap_or(false) && !self.has_members()
    }

    /// Ends all of it: kindly first, and by force after `grace`.
    fn end(&mut self, grace: Duration) {
        if self.is_over() {
            return;
        }
        self.ask_to_end();
        if within(grace, || self.is_over()) {
            return;
        }
        self.kill();
        if !within(DYING, || self.has_exited().unwrap_or(false)) {
            tracing::warn!(process = self.child.id(), "a command does not even end when it is killed: left behind");
        }
    }
}

/// Signals go to the group by its number. The system gives that number to nobody else while the group has members,
/// and after that not before it has used all others: more than can happen between two looks.
#[cfg(unix)]
impl Group {
    fn id(&self) -> Option<rustix::process::Pid> {
        i32::try_from(self.child.id()).ok().and_then(rustix::process::Pid::from_raw)
    }

    /// Processes that planish may not signal count as gone.
    fn has_members(&self) -> bool {
        self.id().is_some_and(|id| rustix::process::test_kill_process_group(id).is_ok())
    }

    fn ask_to_end(&self) {
        self.signal(rustix::process::Signal::TERM);
    }

    fn kill(&self) {
        self.signal(rustix::process::Signal::KILL);
    }

    /// That the group has ended by itself meanwhile is no error.
    fn signal(&self, signal: rustix::process::Signal) {
        if let Some(id) = self.id() {
            let _ = rustix::process::kill_process_group(id, signal);
        }
    }
}

/// Elsewhere there are no groups: the first process alone is ended.
#[cfg(not(unix))]
impl Group {
    fn has_members(&self) -> bool {
        false
    }

    fn ask_to_end(&mut self) {
        self.kill();
    }

    /// That it has ended by itself meanwhile is no error.
    fn kill(&mut self) {
        let _ = self.child.kill();
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { seconds: 60.0, output: 1 << 20, grace: Duration::from_millis(200) };

    /// Runs a script in `folder`; outputs go to the folder `staging` in it.
    fn sh(folder: &Path, script: &str, limits: Limits, wanted: &dyn Fn() -> bool) -> Ended {
        let staging = folder.join("staging");
        std::fs::create_dir(&staging).expect("made");
        let ended = run(Command::new("sh").args(["-c", script]).current_dir(folder), &staging, limits, wanted);
        assert_eq!(std::fs::read_dir(&staging).expect("a folder").count(), 0, "nothing is left");
        ended.expect("starts")
    }

    /// Whether the process whose number is in a file is gone (or reaped by nobody, where the machine has no init).
    fn is_gone(file: &Path) -> bool {
        let id: i32 = std::fs::read_to_string(file).expect("written").trim().parse().expect("a number");
        let state = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        let id = rustix::process::Pid::from_raw(id).expect("not 0");
        state.contains(") Z ") || rustix::process::test_kill_process(id).is_err()
    }

    #[test]
    fn outputs_and_exit_code_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let script = "printf out; printf 'err\\377' >&2; cat; exit 3";
        let ended = sh(folder.path(), script, LIMITS, &|| true);
        assert_eq!((ended.end, ended.status.and_then(|s| s.code())), (End::Exited, Some(3)));
        assert_eq!(ended.stdout, Tail { text: "out".to_owned(), truncated: false });
        assert_eq!(ended.stderr, Tail { text: "err\u{fffd}".to_owned(), truncated: false });
    }

    #[test]
    fn the_end_of_a_long_output_is_kept_and_cut_between_characters() {
        let folder = tempfile::tempdir().expect("a folder");
        let script = "i=0; while [ $i -lt 5000 ]; do printf 'xxxxxxxxxxxxxxxxx€€€'; i=$((i+1)); done; printf end";
        let ended = sh(folder.path(), script, LIMITS, &|| true);
        let Tail { text, truncated } = ended.stdout;
        assert!(truncated && text.len() as u64 > TAIL - 3 && text.len() as u64 <= TAIL, "{}", text.len());
        assert!(text.ends_with("€€€end") && !text.contains('\u{fffd}'));
    }

    #[test]
    fn what_ignores_that_it_shall_end_is_killed_with_its_children() {
        let folder = tempfile::tempdir().expect("a folder");
        let script = "trap '' TERM; sleep 1000 & echo $! > child; while :; do wait; done";
        let ended = sh(folder.path(), script, Limits { seconds: 0.5, ..LIMITS }, &|| true);
        assert_eq!(ended.end, End::TimedOut);
        assert!(ended.status.is_some_and(|s| !s.success()) && ended.seconds < 30.0, "{ended:?}");
        let reaped = within(Duration::from_secs(20), || is_gone(&folder.path().join("child")));
        assert!(reaped, "the grandchild lives");
    }

    #[test]
    fn what_may_end_by_itself_does() {
        let folder = tempfile::tempdir().expect("a folder");
        let script = "trap 'echo tidied > tidied; exit 7' TERM; sleep 1000 & wait";
        let limits = Limits { seconds: 0.5, grace: Duration::from_secs(30), ..LIMITS };
        let ended = sh(folder.path(), script, limits, &|| true);
        assert_eq!((ended.end, ended.status.and_then(|s| s.code())), (End::TimedOut, Some(7)));
        assert!(folder.path().join("tidied").exists() && ended.seconds < 30.0);
    }

    #[test]
    fn what_is_no_longer_wanted_ends() {
        let folder = tempfile::tempdir().expect("a folder");
        let begun = folder.path().join("begun");
        let ended = sh(folder.path(), "touch begun; sleep 1000", LIMITS, &|| !begun.exists());
        assert_eq!(ended.end, End::Unwanted);
        assert!(ended.seconds < 30.0);
    }

    #[test]
    fn what_prints_without_end_ends() {
        for redirected in ["", ">&2"] {
            let folder = tempfile::tempdir().expect("a folder");
            let ended = sh(folder.path(), &format!("while :; do echo x {redirected}; done"), LIMITS, &|| true);
            assert_eq!(ended.end, End::TooMuchOutput);
            assert!(ended.stdout.truncated != ended.stderr.truncated);
        }
    }

    #[test]
    fn children_left_behind_keep_nobody_waiting_and_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let ended = sh(folder.path(), "sleep 1000 & echo $! > child", LIMITS, &|| true);
        assert_eq!((ended.end, ended.status.map(|s| s.success())), (End::Exited, Some(true)));
        assert!(ended.seconds < 30.0);
        assert!(within(Duration::from_secs(20), || is_gone(&folder.path().join("child"))), "the child lives");
    }

    #[test]
    fn what_cannot_start_is_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let run = |command: &mut Command| run(command, folder.path(), LIMITS, &|| true);
        assert!(matches!(run(&mut Command::new("no-such-program")), Err(Trouble::Start(_))));
        let staging = folder.path().join("no/staging");
        let nowhere = super::run(&mut Command::new("true"), &staging, LIMITS, &|| true);
        assert!(matches!(nowhere, Err(Trouble::System(_))));
    }
}
