//! What a running daemon does, for `planish status`; and the lock that lets one daemon only write to an output folder.
//!
//! The daemon writes `OUT/.planish/status.json` when something has changed, and removes it when it ends. That it runs is
//! told by its lock on `OUT/.planish/watch.lock`, which the system takes back even where the daemon was killed.

use crate::outcome::{Code, Status as Outcome};
use crate::output::own;
use crate::output::publish::STAGING;
use crate::system::disk::{self, Disk, File as _, System};
use crate::system::escape::escape;
use crate::system::fingerprint::Identity;
use crate::system::safe_open::{self, OpenError};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// The file whose lock the daemon holds.
const LOCK_FILE: &str = "watch.lock";

/// The file that tells what the daemon does.
const STATUS: &str = "status.json";

/// Who asks whether a daemon runs holds its lock for a moment: so long it is waited for.
const ASKED: Duration = Duration::from_millis(100);

/// A longer status is none: it names a hundred inputs, and what runs.
const LONGEST: u64 = 64 << 20;

/// Names of waiting inputs that are told; all are counted.
pub const NAMED: usize = 100;

/// What a daemon does.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Its process number.
    pub pid: u32,
    /// The folder that it watches.
    pub inbox: String,
    /// When it began: seconds since 1970.
    pub since: u64,
    /// Whether it was told to stop, and finishes what waits.
    pub draining: bool,
    /// How many inputs wait.
    pub waiting: usize,
    /// The first of them.
    pub next: Vec<String>,
    /// Inputs on their way.
    pub running: Vec<Progress>,
    /// Files that have not settled yet.
    pub unsettled: usize,
    /// The first of those that are neither jobs nor done with, or not as they should be.
    #[serde(default)]
    pub notable: Vec<Noted>,
    /// How many these are.
    #[serde(default)]
    pub notables: usize,
    /// How many are in which state.
    #[serde(default)]
    pub notable_states: BTreeMap<String, usize>,
    /// For how long the input has waited that has waited the longest for its result, in seconds; null: none waits.
    #[serde(default)]
    pub oldest: Option<f64>,
    /// When this was told: seconds since 1970. It is told every ten seconds at least.
    #[serde(default)]
    pub told: u64,
    /// When the last result was put in place: seconds since 1970; null: none since the start.
    #[serde(default)]
    pub last_published: Option<u64>,
    /// The last thing that an operator must act on; null: none since the start.
    #[serde(default)]
    pub last_error: Option<Trouble>,
    /// What has ended since it began.
    pub ended: Counts,
    /// Log messages that were lost, because nobody took them off standard error.
    #[serde(default)]
    pub log_lines_lost: usize,
    /// When the last one was lost: seconds since 1970; null: none was.
    #[serde(default)]
    pub last_lost: Option<u64>,
    /// Room on the disk of the results, in bytes; null: the system does not tell.
    #[serde(default)]
    pub bytes_free: Option<u64>,
    /// The room that there should be, in bytes, so that inputs are taken up.
    #[serde(default)]
    pub min_free: Option<u64>,
    /// Why no input is taken up at the moment; null: inputs are.
    #[serde(default)]
    pub paused: Option<String>,
}

impl Status {
    /// What the daemon does, on one line.
    pub fn line(&self) -> String {
        let doing = if self.draining { "stops when all is done: " } else { "" };
        let mut line = format!("{doing}{} run, {} wait", self.running.len(), self.waiting);
        if let Some(paused) = &self.paused {
            line += &format!("; {paused}");
        }
        if let Some(error) = &self.last_error {
            line += &format!("; last error: {}", error.message);
        }
        escape(line.as_ref())
    }
}

/// An input on its way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// The name of its result.
    pub name: String,
    /// The last stage that it has reached.
    pub stage: String,
    /// Its charts that are certified.
    pub charts_done: usize,
    /// All its charts; 0 as long as they are not known.
    pub charts: usize,
    /// For how long, in seconds.
    pub seconds: f64,
    /// What keeps it from going on; null: nothing.
    #[serde(default)]
    pub trouble: Option<String>,
}

/// An input that is neither a job nor done with, or not as it should be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noted {
    /// Its path below the inbox.
    pub name: String,
    /// `unsettled`: it changes still; `later`: it is tried again later; `waits`: for files beside it; `aside`: its result
    /// cannot be put in its place.
    pub state: String,
    /// Why.
    pub reason: String,
    /// For how long it has been on its way, in seconds.
    pub seconds: f64,
}

/// What an operator must act on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trouble {
    /// When: seconds since 1970.
    pub when: u64,
    /// What is wrong, and what to do.
    pub message: String,
}

impl Trouble {
    /// Trouble that has come just now.
    pub fn now(message: impl ToString) -> Self {
        Self { when: now(), message: message.to_string() }
    }
}

/// Seconds since 1970.
pub fn now() -> u64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_secs())
}

/// Seconds, to a tenth.
pub fn tenths(duration: Duration) -> f64 {
    (duration.as_secs_f64() * 10.0).round() / 10.0
}

/// How many inputs ended how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Certified.
    pub certified: usize,
    /// Refused.
    pub refused: usize,
    /// Failed.
    pub failed: usize,
}

impl Counts {
    /// One more.
    pub fn count(&mut self, outcome: Outcome) {
        *match outcome {
            Outcome::Certified => &mut self.certified,
            Outcome::Refused => &mut self.refused,
            Outcome::Failed => &mut self.failed,
        } += 1;
    }
}

/// A refused or failed input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refusal {
    /// The name of its result.
    pub name: String,
    /// `refused` or `failed`.
    pub status: Outcome,
    /// Why.
    pub code: Option<Code>,
    /// Why, for people.
    pub message: String,
}

/// Why the daemon cannot have the output folder.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another one has it.
    #[error("another planish watch{} writes to {} already; stop it first, or use another output folder", of_process(.pid), escape(.out))]
    Busy {
        /// The output folder.
        out: PathBuf,
        /// The other one, as it told.
        pid: Option<u32>,
    },
    /// The system refuses.
    #[error("cannot lock {}: {error}", escape(.path))]
    Io {
        /// The lock file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
}

fn of_process(pid: &Option<u32>) -> String {
    pid.map_or(String::new(), |pid| format!(" (process {pid})"))
}

/// The one daemon of an output folder.
#[derive(Debug)]
pub struct Lock {
    out: PathBuf,
    identity: Identity,
    lock: File,
}

/// What became of the lock of a daemon.
#[derive(Debug)]
pub enum Held {
    /// It is held.
    Yes,
    /// Somebody had removed it, and it was made and taken again.
    Again,
    /// The system does not tell at the moment.
    Unknown(io::Error),
    /// The output folder is gone or another one, or another daemon has it.
    No,
}

impl Lock {
    /// Locks the output folder, which is there already.
    ///
    /// # Errors
    /// [`LockError`].
    pub fn take(out: &Path) -> Result<Self, LockError> {
        let failed = |error| LockError::Io { path: out.join(STAGING).join(LOCK_FILE), error };
        let identity = fs::metadata(out).map(|m| Identity::of(&m)).map_err(failed)?;
        match lock(out).map_err(failed)? {
            Some(lock) => Ok(Self { out: out.to_owned(), identity, lock }),
            None => Err(LockError::Busy { out: out.to_owned(), pid: told(out).map(|status| status.pid) }),
        }
    }

    /// Whether the lock is still that of the output folder: somebody may have removed or replaced either. Where only the
    /// lock is gone, it is taken again.
    pub fn hold(&mut self) -> Held {
        match self.is_there() {
            Ok(true) => Held::Yes,
            Ok(false) => self.take_again(),
            Err(error) if is_gone(&error) => self.take_again(),
            Err(error) => Held::Unknown(error),
        }
    }

    /// Whether the lock is the one that lies in the output folder.
    fn is_there(&self) -> io::Result<bool> {
        Ok(Identity::of(&fs::metadata(self.path())?) == Identity::of(&self.lock.metadata()?))
    }

    fn take_again(&mut self) -> Held {
        match fs::metadata(&self.out).map(|m| Identity::of(&m)) {
            Ok(identity) if identity == self.identity => {}
            Err(error) if !is_gone(&error) => return Held::Unknown(error),
            _ => return Held::No,
        }
        match own::folder(&System, &self.out.join(STAGING)).and_then(|_| lock(&self.out)) {
            Ok(Some(lock)) => {
                self.lock = lock;
                Held::Again
            }
            Ok(None) => Held::No,
            Err(error) => Held::Unknown(error),
        }
    }

    fn path(&self) -> PathBuf {
        self.out.join(STAGING).join(LOCK_FILE)
    }

    fn status(&self) -> PathBuf {
        self.out.join(STAGING).join(STATUS)
    }

    /// Tells what the daemon does.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn tell(&self, status: &Status, staging: &Path) -> io::Result<()> {
        let (desk, root) = (System.open(staging)?, System.open(&self.out.join(STAGING))?);
        let told = serde_json::to_vec(status)?;
        disk::replace_with(&desk, &root, STATUS, |file| file.append(&told))
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Else the status is that of another daemon.
        if self.is_there().is_ok_and(|is_there| is_there) {
            // It may never have been written.
            let _ = fs::remove_file(self.status());
        }
    }
}

/// Opens and takes the lock of an output folder; none: somebody else has it.
fn lock(out: &Path) -> io::Result<Option<File>> {
    let folder = out.join(STAGING);
    let file = own::lock_file(&folder, LOCK_FILE)?;
    Ok(own::lock(&file, &folder.join(LOCK_FILE), ASKED, || true)?.then_some(file))
}

/// Whether an error says that something is not there, rather than that nobody knows.
fn is_gone(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

/// What the last daemon told; none: it ended in order, or there never was one.
pub fn told(out: &Path) -> Option<Status> {
    safe_open::read_json(safe_open::open_itself(&out.join(STAGING).join(STATUS)), LONGEST)
}

/// Whether a daemon runs. Who may not read its lock (that of another user) goes by the process that it named.
pub fn is_running(out: &Path) -> bool {
    match safe_open::open_itself(&out.join(STAGING).join(LOCK_FILE)) {
        Ok(lock) => matches!(lock.try_lock_shared(), Err(TryLockError::WouldBlock)),
        Err(OpenError::Io(e)) if e.kind() == io::ErrorKind::PermissionDenied => {
            told(out).is_some_and(|s| is_alive(s.pid))
        }
        Err(_) => false,
    }
}

fn is_alive(pid: u32) -> bool {
    let process = i32::try_from(pid).ok().and_then(rustix::process::Pid::from_raw);
    // Who may not send it a signal learns that it is there, too.
    process.is_some_and(|p| !matches!(rustix::process::test_kill_process(p), Err(rustix::io::Errno::SRCH)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_daemon_only_and_it_tells_what_it_does() {
        let out = tempfile::tempdir().expect("a folder");
        let staging = out.path().join(STAGING);
        fs::create_dir(&staging).expect("made");
        assert!(!is_running(out.path()));
        let mut daemon = Lock::take(out.path()).expect("free");
        assert!(is_running(out.path()) && matches!(daemon.hold(), Held::Yes));
        let status = Status { pid: 42, waiting: 3, ..Status::default() };
        daemon.tell(&status, &staging).expect("written");
        assert_eq!(told(out.path()), Some(status));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = |name: &str| fs::metadata(staging.join(name)).expect("there").permissions().mode() & 0o777;
            // Who may read a file may lock it; the status is not locked, and for all who may read results.
            assert_eq!((mode(LOCK_FILE), mode(STATUS) & 0o600), (0o600, 0o600));
            assert_eq!(mode(STATUS), fs::write(staging.join("new"), "").map(|()| mode("new")).expect("written"));
        }
        assert!(matches!(Lock::take(out.path()), Err(LockError::Busy { pid: Some(42), .. })));
        drop(daemon);
        assert!(!is_running(out.path()) && told(out.path()).is_none());
        Lock::take(out.path()).expect("free again");
    }

    #[test]
    fn a_lock_that_somebody_removed_is_taken_again_and_one_of_another_folder_is_not() {
        let place = tempfile::tempdir().expect("a folder");
        let out = place.path().join("out");
        fs::create_dir_all(out.join(STAGING)).expect("made");
        let mut daemon = Lock::take(&out).expect("free");
        fs::remove_dir_all(out.join(STAGING)).expect("removed");
        assert!(matches!(daemon.hold(), Held::Again) && matches!(daemon.hold(), Held::Yes));
        assert!(matches!(Lock::take(&out), Err(LockError::Busy { .. })));
        fs::remove_file(out.join(STAGING).join(LOCK_FILE)).expect("removed");
        let other = Lock::take(&out).expect("free, for another daemon");
        assert!(matches!(daemon.hold(), Held::No), "that has it now");
        drop(other);
        fs::rename(&out, place.path().join("older")).expect("moved");
        assert!(matches!(daemon.hold(), Held::No), "no folder");
        fs::create_dir_all(out.join(STAGING)).expect("made");
        assert!(matches!(daemon.hold(), Held::No), "another folder");
        fs::remove_dir_all(&out).and_then(|()| fs::write(&out, "a file")).expect("written");
        assert!(matches!(daemon.hold(), Held::No));
    }

    /// That the system does not tell is no reason to end: the folder may well be there.
    #[test]
    fn a_lock_that_cannot_be_looked_at_may_be_held() {
        let place = tempfile::tempdir().expect("a folder");
        let out = place.path().join("out");
        fs::create_dir_all(out.join(STAGING)).expect("made");
        let mut daemon = Lock::take(&out).expect("free");
        // A path that leads round in circles says nothing about what it led to before.
        fs::rename(&out, place.path().join("older")).expect("moved");
        std::os::unix::fs::symlink("out", &out).expect("linked");
        assert!(matches!(daemon.hold(), Held::Unknown(_)));
    }
}
