//! What a running daemon does, for `planish status`; and the lock that lets one daemon only write to an output folder.
//!
//! The daemon writes `OUT/.planish/status.json` when something has changed, and removes it when it ends. That it runs is
//! told by its lock on `OUT/.planish/watch.lock`, which the system takes back even where the daemon was killed.

use crate::conveyor::board::Running;
use crate::look::Identity;
use crate::outcome::{Code, Status as Outcome};
use crate::own;
use crate::publish::STAGING;
use crate::regular::{self, OpenError};
use crate::shown::shown;
use serde::{Deserialize, Serialize};
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

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
    /// What has ended since it began.
    pub ended: Counts,
    /// Log messages that were lost, because nobody took them off standard error.
    #[serde(default)]
    pub log_lines_lost: usize,
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
}

impl From<Running> for Progress {
    fn from(running: Running) -> Self {
        Self {
            name: running.name.to_string_lossy().into_owned(),
            stage: running.stage.name().to_owned(),
            charts_done: running.charts_done,
            charts: running.charts,
            seconds: (running.since.elapsed().as_secs_f64() * 10.0).round() / 10.0,
        }
    }
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
    #[error("another planish watch{} writes to {} already; stop it first, or use another output folder", of_process(.pid), shown(.out))]
    Busy {
        /// The output folder.
        out: PathBuf,
        /// The other one, as it told.
        pid: Option<u32>,
    },
    /// The system refuses.
    #[error("cannot lock {}: {error}", shown(.path))]
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
    status: PathBuf,
    lock: File,
}

impl Lock {
    /// Locks the output folder, which is there already.
    ///
    /// # Errors
    /// [`LockError`].
    pub fn take(out: &Path) -> Result<Self, LockError> {
        let path = out.join(STAGING).join(LOCK_FILE);
        let failed = |error| LockError::Io { path: path.clone(), error };
        let lock = own::lock_file(&out.join(STAGING), LOCK_FILE).map_err(failed)?;
        match own::lock(&lock, &path, ASKED, || true) {
            Ok(true) => Ok(Self { status: out.join(STAGING).join(STATUS), lock }),
            Ok(false) => Err(LockError::Busy { out: out.to_owned(), pid: told(out).map(|status| status.pid) }),
            Err(error) => Err(failed(error)),
        }
    }

    /// Whether the lock is still that of the output folder: somebody may have removed or replaced the folder.
    pub fn is_held(&self) -> bool {
        let there = fs::metadata(self.status.with_file_name(LOCK_FILE)).map(|m| Identity::of(&m));
        there.is_ok_and(|there| self.lock.metadata().is_ok_and(|held| Identity::of(&held) == there))
    }

    /// Tells what the daemon does.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn tell(&self, status: &Status, staging: &Path) -> io::Result<()> {
        // Whoever may read the results may read this: a temporary file would be its owner's alone.
        let fresh = staging.join("status.fresh");
        fs::write(&fresh, serde_json::to_vec(status)?)?;
        fs::rename(fresh, &self.status)
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // It may never have been written.
        let _ = fs::remove_file(&self.status);
    }
}

/// What the last daemon told; none: it ended in order, or there never was one.
pub fn told(out: &Path) -> Option<Status> {
    let file = regular::open_itself(&out.join(STAGING).join(STATUS)).ok()?;
    serde_json::from_slice(&regular::read(&file, LONGEST).ok()?).ok()
}

/// Whether a daemon runs. Who may not read its lock (that of another user) goes by the process that it named.
pub fn is_running(out: &Path) -> bool {
    match regular::open_itself(&out.join(STAGING).join(LOCK_FILE)) {
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
        let daemon = Lock::take(out.path()).expect("free");
        assert!(is_running(out.path()) && daemon.is_held());
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
}
