//! What is told to whatever started the daemon, if that is systemd or something that listens like it: that it watches,
//! stops, reads its settings again; what it does, in a line; and, for its watchdog, that its work moves.
//!
//! Who listens is told by the environment (`NOTIFY_SOCKET`, `WATCHDOG_USEC`); where nobody does, nothing is told. That
//! telling fails is told once in the log, and holds up nothing.

use crate::pulse::{Pulse, Vitals};
use crate::vitals;
use sd_notify::NotifyState;
use std::time::{Duration, Instant};

/// The watchdog hears so often of a daemon that lives, in the time after which it ends one that does not.
const BEATS: u32 = 4;

/// The time that work may stand still without being stuck, as a part of that time. So the watchdog comes in at one and a
/// half times its time at the latest.
const PATIENCE: u32 = 2;

/// The lower the number, the less is asked of the system; the beats are this far apart at the most.
const LONGEST: Duration = Duration::from_secs(10);

/// Tells who started the daemon.
#[derive(Debug)]
pub struct Supervisor {
    watchdog: Option<Watchdog>,
    /// What was told last of what it does.
    told: String,
    is_heard: bool,
}

#[derive(Debug)]
struct Watchdog {
    pulse: Pulse,
    pause: Duration,
    next: Instant,
    is_alive: bool,
}

impl Supervisor {
    /// As the environment says.
    pub fn new() -> Self {
        let watchdog = sd_notify::watchdog_enabled().map(|time| Watchdog {
            pulse: Pulse::new(time / PATIENCE),
            pause: (time / BEATS).min(LONGEST),
            next: Instant::now(),
            is_alive: true,
        });
        Self { watchdog, told: String::new(), is_heard: true }
    }

    /// The daemon watches; also: it has read its settings again.
    pub fn ready(&mut self) {
        self.say(&[NotifyState::Ready]);
    }

    /// The daemon is about to read its settings again.
    pub fn reloading(&mut self) {
        // It is told with the time at which it begins: what systemd waits for comes after that.
        match NotifyState::monotonic_usec_now() {
            Ok(now) => self.say(&[NotifyState::Reloading, now]),
            Err(_) => self.say(&[NotifyState::Reloading]),
        }
    }

    /// The daemon is about to end.
    pub fn stopping(&mut self) {
        self.say(&[NotifyState::Stopping]);
    }

    /// What the daemon does, on one line.
    pub fn tell(&mut self, line: String) {
        if line != self.told {
            self.say(&[NotifyState::Status(&line)]);
            self.told = line;
        }
    }

    /// When it is to be looked next at whether work moves.
    pub fn next_beat(&self) -> Option<Instant> {
        self.watchdog.as_ref().map(|watchdog| watchdog.next)
    }

    /// Tells the watchdog that work moves, if it does: a sign of life of the loop that calls this, too.
    pub fn beat(&mut self, now: Instant, seen: impl FnOnce() -> Vitals) {
        let Some(watchdog) = self.watchdog.as_mut().filter(|watchdog| now >= watchdog.next) else { return };
        watchdog.next = now + watchdog.pause;
        let was_alive =
            std::mem::replace(&mut watchdog.is_alive, watchdog.pulse.beats(now, seen(), vitals::waits_for_disk));
        if watchdog.is_alive {
            self.say(&[NotifyState::Watchdog]);
        } else if was_alive {
            tracing::error!("nothing moves of what is on its way: the watchdog is told no more that all is well");
        }
    }

    fn say(&mut self, what: &[NotifyState]) {
        let said = sd_notify::notify(what);
        if let Err(error) = &said
            && self.is_heard
        {
            tracing::warn!("who started planish cannot be told what it does: {error}");
        }
        self.is_heard = said.is_ok();
    }
}

impl Default for Supervisor {
    fn default() -> Self {
        Self::new()
    }
}
