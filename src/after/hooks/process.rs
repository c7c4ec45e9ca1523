//! One command, watched until it is over.
//!
//! What it prints is read as it comes ([`super::output`]): neither does it wait for planish, nor planish for a child
//! that it leaves behind with its output open. It leads a process group of its own, so that what it started ends with
//! it, and so that the terminal's Ctrl-C reaches planish alone, which decides. A process that leaves the group
//! (`setsid`) is on its own, and so is its output.

use super::output::{Outputs, Tail};
use rustix::process::{Pid, Signal, kill_process_group, test_kill_process_group};
use std::io;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How often a command that prints nothing is looked at. By experience: more often costs processor time, less
/// often holds up what follows commands that are done at once.
const POLL: Duration = Duration::from_millis(20);

/// How long a killed process may take to be gone. The system delays it only where it hangs in a device.
const DYING: Duration = Duration::from_secs(5);

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
    /// It cannot be watched.
    System(io::Error),
}

/// Runs a command until it ends, breaks a limit, or is no longer `wanted`.
pub fn run(command: &mut Command, limits: Limits, wanted: &dyn Fn() -> bool) -> Result<Ended, Trouble> {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let started = Instant::now();
    let mut group = Group::start(command).map_err(Trouble::Start)?;
    let mut outputs = Outputs::default();
    let watched = outputs.take(&mut group.child).and_then(|()| watch(&mut group, &mut outputs, limits, wanted));
    group.end(limits.grace, &mut outputs);
    let end = watched.and_then(|end| outputs.read_rest().map(|()| end)).map_err(Trouble::System)?;
    let (stdout, stderr) = outputs.close();
    Ok(Ended { end, status: group.status, seconds: started.elapsed().as_secs_f64(), stdout, stderr })
}

fn watch(group: &mut Group, outputs: &mut Outputs, limits: Limits, wanted: &dyn Fn() -> bool) -> io::Result<End> {
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
        if outputs.longest() > limits.output {
            return Ok(End::TooMuchOutput);
        }
        outputs.wait(POLL)?;
    }
}

/// Whether something comes true in time. What is printed meanwhile is read: who must print to end can.
fn within(time: Duration, outputs: &mut Outputs, mut is_true: impl FnMut() -> bool) -> bool {
    let started = Instant::now();
    while !is_true() {
        if started.elapsed() >= time {
            return false;
        }
        if outputs.wait(POLL).is_err() {
            std::thread::sleep(POLL);
        }
    }
    true
}

/// A process and those that it started. Signals go to the group by its number. The system gives that number to nobody
/// else while the group has members, and after that not before it has used all others: more than can happen between two
/// looks.
struct Group {
    child: Child,
    status: Option<ExitStatus>,
}

impl Group {
    fn start(command: &mut Command) -> io::Result<Self> {
        Ok(Self { child: command.process_group(0).spawn()?, status: None })
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
    fn end(&mut self, grace: Duration, outputs: &mut Outputs) {
        if self.is_over() {
            return;
        }
        self.signal(Signal::TERM);
        if within(grace, outputs, || self.is_over()) {
            return;
        }
        self.signal(Signal::KILL);
        if !within(DYING, outputs, || self.has_exited().unwrap_or(false)) {
            tracing::warn!(process = self.child.id(), "a command does not even end when it is killed: left behind");
        }
    }

    fn id(&self) -> Option<Pid> {
        i32::try_from(self.child.id()).ok().and_then(Pid::from_raw)
    }

    /// Processes that planish may not signal count as gone.
    fn has_members(&self) -> bool {
        self.id().is_some_and(|id| test_kill_process_group(id).is_ok())
    }

    /// That the group has ended by itself meanwhile is no error.
    fn signal(&self, signal: Signal) {
        if let Some(id) = self.id() {
            let _ = kill_process_group(id, signal);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::output::TAIL;
    use super::*;
    use std::path::Path;

    const LIMITS: Limits = Limits { seconds: 60.0, output: 1 << 20, grace: Duration::from_millis(200) };

    /// Runs a script in `folder`.
    fn sh(folder: &Path, script: &str, limits: Limits, wanted: &dyn Fn() -> bool) -> Ended {
        run(Command::new("sh").args(["-c", script]).current_dir(folder), limits, wanted).expect("starts")
    }

    /// Whether the process whose number is in a file is gone (or reaped by nobody, where the machine has no init).
    fn is_gone(file: &Path) -> bool {
        let id: i32 = std::fs::read_to_string(file).expect("written").trim().parse().expect("a number");
        let state = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        let id = rustix::process::Pid::from_raw(id).expect("not 0");
        state.contains(") Z ") || rustix::process::test_kill_process(id).is_err()
    }

    fn goes(file: &Path) -> bool {
        within(Duration::from_secs(20), &mut Outputs::default(), || is_gone(file))
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
        assert!(truncated && text.len() > TAIL - 3 && text.len() <= TAIL, "{}", text.len());
        assert!(text.ends_with("€€€end") && !text.contains('\u{fffd}'));
    }

    #[test]
    fn what_ignores_that_it_shall_end_is_killed_with_its_children() {
        let folder = tempfile::tempdir().expect("a folder");
        let script = "trap '' TERM; sleep 1000 & echo $! > child; while :; do wait; done";
        let ended = sh(folder.path(), script, Limits { seconds: 0.5, ..LIMITS }, &|| true);
        assert_eq!(ended.end, End::TimedOut);
        assert!(ended.status.is_some_and(|s| !s.success()) && ended.seconds < 30.0, "{ended:?}");
        assert!(goes(&folder.path().join("child")), "the grandchild lives");
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
        assert!(goes(&folder.path().join("child")), "the child lives");
    }

    /// Nothing is left that it could fill: neither a file nor a pipe that somebody reads.
    #[test]
    fn a_child_that_has_escaped_and_prints_without_end_keeps_nobody_waiting_and_ends() {
        let folder = tempfile::tempdir().expect("a folder");
        let script = "setsid sh -c 'echo $$ > child; while :; do echo x; done' & until test -s child; do :; done";
        let ended = sh(folder.path(), script, Limits { output: u64::MAX, ..LIMITS }, &|| true);
        assert_eq!((ended.end, ended.status.map(|s| s.success())), (End::Exited, Some(true)));
        assert!(ended.seconds < 30.0);
        assert!(goes(&folder.path().join("child")), "the child prints on");
    }

    /// A command that prints much gets on as fast as it is read: never does it wait for the next look.
    #[test]
    fn nobody_who_prints_is_slowed() {
        let folder = tempfile::tempdir().expect("a folder");
        let limits = Limits { output: 1 << 30, ..LIMITS };
        let ended = sh(folder.path(), "head -c 268435456 /dev/zero", limits, &|| true);
        // 4096 chunks: with a look for each, 80 seconds.
        assert!(ended.end == End::Exited && ended.stdout.truncated && ended.seconds < 20.0, "{}", ended.seconds);
    }

    /// Its last words do not fit into a pipe.
    #[test]
    fn what_prints_much_before_it_ends_may() {
        let folder = tempfile::tempdir().expect("a folder");
        let script = "trap 'head -c 500000 /dev/zero; echo end; exit 7' TERM; sleep 1000 & wait";
        let limits = Limits { seconds: 0.5, grace: Duration::from_secs(30), ..LIMITS };
        let ended = sh(folder.path(), script, limits, &|| true);
        assert_eq!((ended.end, ended.status.and_then(|s| s.code())), (End::TimedOut, Some(7)));
        assert!(ended.stdout.text.ends_with("\0end\n") && ended.seconds < 30.0);
    }

    #[test]
    fn what_cannot_start_is_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let run = |program| run(Command::new(program).current_dir(folder.path()), LIMITS, &|| true);
        assert!(matches!(run("no-such-program"), Err(Trouble::Start(_))));
    }
}
