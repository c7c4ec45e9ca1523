//! Commands that outlive planish: one that is killed (SIGKILL, no memory) cannot end what it has started, and one that
//! is asked twice to stop does not wait for it.
//!
//! Every command gets, in its environment, the staging folder of the process that started it and the session of that
//! process; so does whatever it starts. The staging folder of a killed process is found at the next start, and with it
//! all that still runs of its commands, which ends as if it had broken a limit: kindly first, and by force after a
//! while. So the same command never runs twice at once.
//!
//! What is meant to live on has left the session (`setsid`), and is left alone. So is whatever has changed its
//! environment: it is not known. Signals go through handles of processes, not to their numbers, so that no other
//! process is hit; and only to those of the same user. Where the system has no `/proc` as Linux has, nothing is found.

use rustix::process::getsid;
use std::io;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// How long a command may take to end when it is asked to (SIGTERM), before it is killed. By experience: enough to remove what
/// it has begun; more holds up the end and the start of planish.
pub const GRACE: Duration = Duration::from_secs(2);

/// The variable with the staging folder.
const STAGING: &str = "PLANISH_STAGING";

/// The variable with the session.
const SESSION: &str = "PLANISH_SESSION";

/// Makes known whose command this is, and all that it will start.
pub fn mark(command: &mut Command, staging: &Path) -> io::Result<()> {
    // A session whose leader cannot be seen from a container has no number there.
    let session = getsid(None).map_or(0, |id| id.as_raw_nonzero().get());
    command.env(STAGING, staging.canonicalize()?).env(SESSION, session.to_string());
    Ok(())
}

/// Ends what runs of the commands of the process whose staging folder this is, or was. Returns when it is gone, or does
/// not go: after some seconds at most.
pub fn end_those_of(staging: &Path) {
    #[cfg(target_os = "linux")]
    linux::end_those_of(staging);
    #[cfg(not(target_os = "linux"))]
    let _ = staging;
}

#[cfg(target_os = "linux")]
mod linux {
    use super::GRACE;
    use super::{SESSION, STAGING};
    use crate::system::escape::escape;
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::fd::OwnedFd;
    use rustix::io::Errno;
    use rustix::process::{Pid, PidfdFlags, Signal, geteuid, getpid, pidfd_open, pidfd_send_signal};
    use std::fs;
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::MetadataExt;
    use std::path::Path;
    use std::time::{Duration, Instant};

    /// How long killed processes may take to be gone, in each round.
    const DYING: Duration = Duration::from_secs(1);

    /// Rounds of killing: what starts others while it is killed needs more than one.
    const ROUNDS: u32 = 5;

    /// A process with a handle, which stays its own when its number is given to another one.
    struct Orphan {
        id: Pid,
        handle: OwnedFd,
    }

    pub(super) fn end_those_of(staging: &Path) {
        let Ok(staging) = staging.canonicalize() else { return };
        let orphans = all_of(&staging);
        if orphans.is_empty() {
            return;
        }
        for orphan in &orphans {
            tracing::warn!(process = orphan.id.as_raw_nonzero(), "a command that planish has left running is ended");
        }
        send(&orphans, &staging, Signal::TERM);
        wait(&orphans, GRACE);
        for _ in 0..ROUNDS {
            let rest = all_of(&staging);
            if rest.is_empty() {
                return;
            }
            send(&rest, &staging, Signal::KILL);
            wait(&rest, DYING);
        }
        tracing::error!(
            staging = escape(&staging),
            "a command that planish has left running does not even end when it is killed: it may run twice now; find \
             it by {STAGING} in its environment (`ps eww`)"
        );
    }

    /// All that can be found.
    fn all_of(staging: &Path) -> Vec<Orphan> {
        let Ok(processes) = fs::read_dir("/proc") else { return Vec::new() };
        let mut orphans = Vec::new();
        for process in processes.flatten() {
            // Other names in there are no processes.
            let number = process.file_name().to_str().and_then(|name| name.parse().ok());
            let Some(id) = number.and_then(Pid::from_raw) else { continue };
            if is_of(id, staging) {
                orphans.extend(handle(id));
            }
        }
        orphans
    }

    /// None where the process has ended since.
    fn handle(id: Pid) -> Option<Orphan> {
        match pidfd_open(id, PidfdFlags::empty()) {
            Ok(handle) => Some(Orphan { id, handle }),
            Err(Errno::SRCH) => None,
            Err(error) => {
                let process = id.as_raw_nonzero();
                tracing::error!(
                    process,
                    "a command that planish has left running cannot be ended: {error}; end it yourself"
                );
                None
            }
        }
    }

    /// Whether a process has the marks of a command of this staging folder, and has not left its session. What of it
    /// cannot be read says that it is not, or no longer, there.
    fn is_of(id: Pid, staging: &Path) -> bool {
        let folder = Path::new("/proc").join(id.as_raw_nonzero().to_string());
        let is_ours = id != getpid() && fs::metadata(&folder).is_ok_and(|m| m.uid() == geteuid().as_raw());
        if !is_ours {
            return false;
        }
        let Ok(environment) = fs::read(folder.join("environ")) else { return false };
        if value(&environment, STAGING) != Some(staging.as_os_str().as_bytes()) {
            return false;
        }
        match (value(&environment, SESSION), session(&folder)) {
            (Some(marked), Some(now)) => marked == now.as_bytes(),
            _ => false,
        }
    }

    /// The value of a variable.
    fn value<'a>(environment: &'a [u8], name: &str) -> Option<&'a [u8]> {
        let mut variables = environment.split(|byte| *byte == 0);
        variables.find_map(|variable| variable.strip_prefix(name.as_bytes())?.strip_prefix(b"="))
    }

    /// The session of a process, as it is told: the fourth field behind its name, which may hold anything.
    fn session(folder: &Path) -> Option<String> {
        let told = fs::read(folder.join("stat")).ok()?;
        let told = String::from_utf8_lossy(&told).into_owned();
        let (_, behind_the_name) = told.rsplit_once(')')?;
        behind_the_name.split_whitespace().nth(3).map(str::to_owned)
    }

    /// Sends a signal to those that still are what they were when their handles were made: if the number is another
    /// process's by then, the handle is that of one that is gone.
    fn send(orphans: &[Orphan], staging: &Path, signal: Signal) {
        for orphan in orphans.iter().filter(|orphan| is_of(orphan.id, staging)) {
            if let Err(error) = pidfd_send_signal(&orphan.handle, signal) {
                tracing::debug!(process = orphan.id.as_raw_nonzero(), "no signal: {error}");
            }
        }
    }

    /// Waits until all have ended, reaped or not, but no longer than `time`.
    fn wait(orphans: &[Orphan], time: Duration) {
        let latest = Instant::now() + time;
        for orphan in orphans {
            let rest = latest.saturating_duration_since(Instant::now());
            let rest = Timespec { tv_sec: rest.as_secs() as i64, tv_nsec: rest.subsec_nanos().into() };
            // Where this fails, the next look finds what is left.
            let _ = poll(&mut [PollFd::new(&orphan.handle, PollFlags::IN)], Some(&rest));
        }
    }
}
