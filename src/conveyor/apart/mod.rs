//! Jobs in processes of their own: what one of them dies of is that job's alone.
//!
//! A stack that overflows, memory that is not there, a limit of time: none of these can be caught where it happens. So
//! what is large, or was on its way when the program died before, is done by a child process, `planish job`, with the
//! stages of this crate. It writes the files of the result to a folder in staging; its parent puts them in place. Places
//! to compute and memory for factorisations it gets from its parent ([`parent`]), where its job waits in the same order as
//! all others, and lets others pass.
//!
//! Guarantees: what comes out is, byte for byte, what comes out without a child. A child ends with its parent, whatever
//! ends that. All that it held is given back when it ends, whatever ends it.
//!
//! Deliberately absent: any sharing of memory, and any trust in what a dying child says.

pub mod parent;
pub mod protocol;
pub(super) mod stage;

use super::budget::Account;
use super::in_flight::InFlight;
use crate::conveyor::stage::Stage;
use crate::output::begun::{self, Entry};
use crate::report::ResultSettings;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use parking_lot::Mutex;
use protocol::{Ending, Order, Said, Told, say};
use serde::Deserialize;
use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{Builder, Scope};
use std::time::{Duration, Instant};
use tracing::level_filters::LevelFilter;

/// How often a child is looked at: whether it is wanted, and in time. By experience: an end that comes so much later is
/// not noticed; looks that are more frequent take processor time.
const POLL: Duration = Duration::from_millis(20);

/// How long a child may take to end when it has said that its job has ended. It has only its memory to give back; one
/// that stays holds a place for nothing.
const LINGERING: Duration = Duration::from_secs(5);

/// Lines of standard error that are kept as evidence, and how long each may be, in bytes.
const EVIDENCE: (usize, u64) = (8, 4096);

/// How the process of a job ended.
#[derive(Debug)]
pub(super) enum Outcome {
    /// As a job ends.
    Ended(Ending),
    /// It died.
    Died(Death),
    /// It was ended: it took longer than it may.
    OutOfTime,
    /// It was ended: nobody wants its result any more.
    Unwanted,
}

/// What is known of a death.
#[derive(Debug)]
pub(super) struct Death {
    status: ExitStatus,
    last_words: Vec<String>,
}

impl Death {
    /// Whether it asked for memory that it did not get.
    pub fn is_for_memory(&self) -> bool {
        self.last_words.iter().any(|line| line.contains("memory allocation of"))
    }
}

impl std::fmt::Display for Death {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.status)?;
        self.last_words.iter().try_for_each(|line| write!(f, "; {line}"))
    }
}

/// Does a job in a process of its own; the files of its result go to `folder`. Blocks until the process has ended.
///
/// # Errors
/// The system starts no process or thread.
pub(super) fn run(in_flight: &InFlight, folder: &Path) -> io::Result<Outcome> {
    let mark = in_flight.mark_apart();
    let mut child = start(in_flight, folder, mark.as_ref().map(|(path, _)| path))?;
    let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
    let (Some(stdin), Some(stdout), Some(stderr)) = pipes else {
        return Err(io::Error::other("a process was started without pipes"));
    };
    let line = Line::new(in_flight, stdin);
    line.tell(&order(in_flight, mark.as_ref().map(|(_, entry)| entry.clone())));
    let (evidence, ended) = (Mutex::default(), AtomicBool::new(false));
    let child = Mutex::new(child);
    let followed: io::Result<_> = std::thread::scope(|scope| {
        let helpers = line.help(scope).and_then(|channels| {
            spawn(scope, "log", || pass_on_log(in_flight, stderr, &evidence))?;
            let guard = spawn(scope, "guard", || guard(in_flight, &child, &ended))?;
            Ok((channels, guard))
        });
        let followed = helpers.map(|(channels, guard)| (line.follow(stdout, &channels), guard));
        let has_told = matches!(followed, Ok((Some(_), _)));
        let status = if has_told { await_end(&child) } else { end(&child) };
        ended.store(true, Ordering::Relaxed);
        // Before those who lend it more are waited for: they may wait for just that.
        line.is_gone();
        let (ending, guard) = followed?;
        Ok((ending, guard.join().unwrap_or(None), status?))
    });
    line.give_all_back();
    // What it died of is counted here, and not once more when this process ends.
    mark.iter().for_each(|(path, _)| begun::end_apart(path));
    let (ending, ended_by_guard, status) = followed?;
    Ok(match (ended_by_guard, ending) {
        (Some(outcome), _) => outcome,
        // Its files were on disk before it told: how it ends after that is all the same.
        (None, Some(ending)) => Outcome::Ended(ending),
        (None, None) => Outcome::Died(Death { status, last_words: evidence.into_inner().into() }),
    })
}

/// The program itself, even where another version has taken its place meanwhile.
fn program() -> io::Result<PathBuf> {
    let itself = Path::new("/proc/self/exe");
    if itself.exists() { Ok(itself.to_owned()) } else { std::env::current_exe() }
}

fn start(in_flight: &InFlight, folder: &Path, mark: Option<&PathBuf>) -> io::Result<Child> {
    let job = &in_flight.job;
    let mut command = Command::new(program()?);
    command.arg0("planish").arg("job").arg("--name").arg(&job.name).arg("--into").arg(folder).args(log_level());
    if let Some(within) = &job.within {
        command.arg("--within").arg(within);
    }
    if let Some(mark) = mark {
        command.arg("--mark").arg(mark);
    }
    if job.since.is_some() {
        command.arg("--waits");
    }
    command.arg("--").arg(&job.path);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // What the terminal says to all of its group (Ctrl-C) is for the parent to decide.
    command.process_group(0).spawn()
}

fn log_level() -> &'static [&'static str] {
    match LevelFilter::current() {
        LevelFilter::TRACE => &["-vvv"],
        LevelFilter::DEBUG => &["-vv"],
        LevelFilter::INFO => &["-v"],
        _ => &[],
    }
}

fn order(in_flight: &InFlight, mark: Option<Entry>) -> Order {
    let settings = &in_flight.settings;
    Order {
        mark,
        settings: ResultSettings::from(&**settings),
        limits: settings.limits,
        jobs: settings.jobs,
        memory: settings.job_memory,
        machine: settings.machine_memory,
    }
}

fn spawn<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    name: &str,
    body: impl FnOnce() -> T + Send + 'scope,
) -> io::Result<std::thread::ScopedJoinHandle<'scope, T>> {
    Builder::new().name(name.to_owned()).spawn_scoped(scope, body)
}

/// Waits for the end of a child that has said its last word, and ends it where it lingers.
fn await_end(child: &Mutex<Child>) -> io::Result<ExitStatus> {
    let told = Instant::now();
    while told.elapsed() < LINGERING {
        if let Some(status) = child.lock().try_wait()? {
            return Ok(status);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    end(child)
}

/// Ends a child by force. One that has died already keeps the status with which it did.
fn end(child: &Mutex<Child>) -> io::Result<ExitStatus> {
    let mut child = child.lock();
    child.kill()?;
    child.wait()
}

/// Ends the child when nobody wants it any more, or its time is over; why it did.
fn guard(in_flight: &InFlight, child: &Mutex<Child>, ended: &AtomicBool) -> Option<Outcome> {
    let (began, limit) = (Instant::now(), in_flight.settings.job_time);
    while !ended.load(Ordering::Relaxed) {
        let outcome = if !in_flight.job.is_wanted() {
            Some(Outcome::Unwanted)
        } else if limit.is_some_and(|limit| began.elapsed().as_secs_f64() >= limit) {
            Some(Outcome::OutOfTime)
        } else {
            None
        };
        if outcome.is_some() {
            // That it has ended by itself meanwhile is no error.
            let _ = child.lock().kill();
            return outcome;
        }
        std::thread::sleep(POLL);
    }
    None
}

/// A line of the child's log.
#[derive(Deserialize)]
struct Logged {
    level: String,
    fields: serde_json::Map<String, serde_json::Value>,
    #[serde(default)]
    spans: Vec<serde_json::Map<String, serde_json::Value>>,
}

/// Says what the child logs; what else it says on standard error is kept as evidence.
fn pass_on_log(in_flight: &InFlight, stderr: impl Read, evidence: &Mutex<VecDeque<String>>) {
    let mut stderr = BufReader::new(stderr);
    loop {
        let mut line = Vec::new();
        let read = (&mut stderr).take(16 * EVIDENCE.1).read_until(b'\n', &mut line);
        if !read.is_ok_and(|read| read > 0) {
            return;
        }
        match serde_json::from_slice::<Logged>(&line) {
            Ok(logged) => log(in_flight, &logged),
            Err(_) => keep(&String::from_utf8_lossy(&line[..line.len().min(EVIDENCE.1 as usize)]), evidence),
        }
    }
}

fn keep(line: &str, evidence: &Mutex<VecDeque<String>>) {
    let line = line.trim();
    if line.is_empty() {
        return;
    }
    let mut evidence = evidence.lock();
    evidence.push_back(line.to_owned());
    if evidence.len() > EVIDENCE.0 {
        evidence.pop_front();
    }
}

fn log(in_flight: &InFlight, logged: &Logged) {
    let stage = logged.spans.iter().find_map(|span| span.get("stage")?.as_str()).unwrap_or_default();
    let _in_stage = in_flight.in_stage(Stage::of(stage).unwrap_or(Stage::Read));
    let message = logged.fields.get("message").and_then(|m| m.as_str()).unwrap_or_default();
    let fields = logged.fields.iter().filter(|(name, _)| *name != "message");
    let told = fields.fold(message.to_owned(), |told, (name, value)| format!("{told} {name}={value}"));
    match logged.level.as_str() {
        "ERROR" => tracing::error!("{told}"),
        "WARN" => tracing::warn!("{told}"),
        "INFO" => tracing::info!("{told}"),
        "DEBUG" => tracing::debug!("{told}"),
        _ => tracing::trace!("{told}"),
    }
}

/// What passes between a child and its parent.
struct Line<'a> {
    in_flight: &'a InFlight,
    to: Mutex<ChildStdin>,
    /// Memory that the child has, in bytes.
    memory: AtomicU64,
    /// Whether the child has ended.
    gone: AtomicBool,
}

/// What the child asks for, on its way to those who see to it. That they are dropped tells these that it has ended.
struct Channels {
    wants: Sender<()>,
    leaves: Sender<()>,
    memory: Sender<(u64, u64)>,
}

/// Requests that wait: no more than the child has threads.
const REQUESTS: usize = 1 << 14;

impl<'a> Line<'a> {
    fn new(in_flight: &'a InFlight, to: ChildStdin) -> Self {
        Self { in_flight, to: Mutex::new(to), memory: AtomicU64::new(0), gone: AtomicBool::new(false) }
    }

    /// A child that listens no more has ended, and is found so.
    fn tell(&self, what: &impl serde::Serialize) {
        let _ = say(&mut *self.to.lock(), what);
    }

    /// Starts those who see to places and memory for the child.
    fn help<'scope>(&'scope self, scope: &'scope Scope<'scope, '_>) -> io::Result<Channels> {
        let (wants, wanted) = bounded(REQUESTS);
        let (leaves, left) = bounded(REQUESTS);
        let (memory, asked) = bounded(REQUESTS);
        for _ in 0..self.in_flight.settings.jobs {
            let (wanted, left) = (wanted.clone(), left.clone());
            spawn(scope, "place", move || wanted.iter().for_each(|()| self.lend_place(&left)))?;
        }
        spawn(scope, "memory", move || asked.iter().for_each(|(ticket, bytes)| self.lend_memory(ticket, bytes)))?;
        Ok(Channels { wants, leaves, memory })
    }

    /// Waits for a place, lends it to the child, and gives it back when the child does, or has ended.
    fn lend_place(&self, left: &Receiver<()>) {
        let (grants, turn) = (&self.in_flight.shared.grants, self.in_flight.turn);
        grants.enter(turn);
        self.tell(&Told::Place);
        while let Err(RecvTimeoutError::Timeout) = left.recv_timeout(POLL) {
            if grants.is_waited_for(turn) {
                self.tell(&Told::YieldTo);
            }
        }
        grants.leave();
    }

    fn lend_memory(&self, ticket: u64, bytes: u64) {
        if self.gone.load(Ordering::SeqCst) {
            return;
        }
        self.in_flight.shared.grants.take(Account::Factor, bytes, self.in_flight.turn);
        self.memory.fetch_add(bytes, Ordering::SeqCst);
        if self.gone.load(Ordering::SeqCst) {
            return self.give_all_back();
        }
        self.tell(&Told::Answer { ticket, granted: true });
    }

    fn try_to_lend_memory(&self, ticket: u64, bytes: u64) {
        let granted = self.in_flight.shared.grants.try_take(Account::Factor, bytes);
        if granted {
            self.memory.fetch_add(bytes, Ordering::SeqCst);
        }
        self.tell(&Told::Answer { ticket, granted });
    }

    fn take_memory_back(&self, bytes: u64) {
        self.memory.fetch_sub(bytes, Ordering::SeqCst);
        self.in_flight.shared.grants.give_back(Account::Factor, bytes);
    }

    /// The child has ended: what it had is given back, and it gets no more.
    fn is_gone(&self) {
        self.gone.store(true, Ordering::SeqCst);
        self.give_all_back();
    }

    /// What a child had when it ended.
    fn give_all_back(&self) {
        let bytes = self.memory.swap(0, Ordering::SeqCst);
        if bytes > 0 {
            self.in_flight.shared.grants.give_back(Account::Factor, bytes);
        }
    }

    /// Does what the child says until it says no more; how its job has ended, if it told.
    fn follow(&self, stdout: impl Read, channels: &Channels) -> Option<Ending> {
        for line in BufReader::new(stdout).lines() {
            let said = line.and_then(|line| Ok(serde_json::from_str(&line)?));
            match said {
                // Its last word: who lingers after that is not waited for.
                Ok(Said::Ended(how)) => return Some(how),
                Ok(said) => self.take_in(said, channels),
                // A line that was broken off: it is dying.
                Err(_) => return None,
            }
        }
        None
    }

    fn take_in(&self, said: Said, channels: &Channels) {
        self.in_flight.shared.step();
        match said {
            Said::Want => drop(channels.wants.send(())),
            Said::Leave => drop(channels.leaves.send(())),
            Said::TryTake { ticket, bytes } => self.try_to_lend_memory(ticket, bytes),
            Said::Take { ticket, bytes } => drop(channels.memory.send((ticket, bytes))),
            Said::GiveBack { bytes } => self.take_memory_back(bytes),
            Said::Progress { stage, charts_done, charts, trouble } => {
                self.in_flight.is_at(stage, charts_done, charts);
                self.in_flight.is_in_trouble(trouble);
            }
            Said::Beside { names } => self.in_flight.job.set_beside(names),
            Said::Ended(_) => {}
        }
    }
}
