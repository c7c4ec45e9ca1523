//! What is told to whatever started the daemon, if that is systemd or something that listens like it: that it watches,
//! stops, reads its settings again; what it does, in a line; and, for its watchdog, that its work moves.
//!
//! Who listens is told by the environment (`NOTIFY_SOCKET`, `WATCHDOG_USEC`); where nobody does, nothing is told. A thread
//! of its own does the telling, so that a supervisor that does not listen holds up nothing: what it does not hear is lost.
//! That telling fails is told once in the log.

use crate::operating::pulse::{Pulse, Vitals};
use crate::system::vitals;
use sd_notify::NotifyState;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// The watchdog hears so often of a daemon that lives, in the time after which it ends one that does not.
const BEATS: u32 = 4;

/// The time that work may stand still without being stuck, as a part of that time. So the watchdog comes in at one and a
/// half times its time at the latest.
const PATIENCE: u32 = 2;

/// They are no farther apart than this.
const LONGEST: Duration = Duration::from_secs(10);

/// So many messages wait to be told.
const WAITING: usize = 8;

/// How long the last of them may take at the end.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// What is told.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Message {
    Ready,
    Reloading,
    Stopping,
    Status(String),
    Alive,
}

/// Tells who started the daemon.
#[derive(Debug)]
pub struct Supervisor {
    watchdog: Option<Watchdog>,
    /// What was told last of what it does.
    told: String,
    teller: Option<Teller>,
}

/// The thread that does the telling.
#[derive(Debug)]
struct Teller {
    to_tell: SyncSender<Message>,
    /// Closed when all is told.
    told: Receiver<()>,
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
        Self { watchdog, told: String::new(), teller: Teller::start() }
    }

    /// The daemon watches; also: it has read its settings again.
    pub fn ready(&mut self) {
        self.say(Message::Ready);
    }

    /// The daemon is about to read its settings again.
    pub fn reloading(&mut self) {
        self.say(Message::Reloading);
    }

    /// The daemon is about to end.
    pub fn stopping(&mut self) {
        self.say(Message::Stopping);
    }

    /// What the daemon does, on one line.
    pub fn tell(&mut self, line: String) {
        if line != self.told {
            self.say(Message::Status(line.clone()));
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
            self.say(Message::Alive);
        } else if was_alive {
            tracing::error!("nothing moves of what is on its way: the watchdog is told no more that all is well");
        }
    }

    fn say(&self, message: Message) {
        if let Some(teller) = &self.teller {
            // Full: nobody listens.
            let _ = teller.to_tell.try_send(message);
        }
    }
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        if let Some(Teller { to_tell, told }) = self.teller.take() {
            drop(to_tell);
            // Ends with the thread, or nobody listens.
            let _ = told.recv_timeout(LAST_WORDS);
        }
    }
}

impl Teller {
    /// Starts the thread, where somebody listens.
    fn start() -> Option<Self> {
        std::env::var_os("NOTIFY_SOCKET")?;
        let ((to_tell, messages), (all_told, told)) = (sync_channel(WAITING), sync_channel::<()>(0));
        let started = std::thread::Builder::new().name("supervisor".to_owned()).spawn(move || {
            tell_all(&messages);
            drop(all_told);
        });
        if let Err(error) = started {
            warn(&error);
            return None;
        }
        Some(Self { to_tell, told })
    }
}

fn tell_all(messages: &Receiver<Message>) {
    let mut is_heard = true;
    for message in messages {
        let told = tell(&message);
        if let Err(error) = &told
            && is_heard
        {
            warn(error);
        }
        is_heard = told.is_ok();
    }
}

fn tell(message: &Message) -> std::io::Result<()> {
    match message {
        Message::Ready => sd_notify::notify(&[NotifyState::Ready]),
        // With the time at which it begins: what systemd waits for comes after that.
        Message::Reloading => sd_notify::notify(&[NotifyState::Reloading, NotifyState::monotonic_usec_now()?]),
        Message::Stopping => sd_notify::notify(&[NotifyState::Stopping]),
        Message::Status(line) => sd_notify::notify(&[NotifyState::Status(line)]),
        Message::Alive => sd_notify::notify(&[NotifyState::Watchdog]),
    }
}

fn warn(error: &std::io::Error) {
    tracing::warn!("who started planish cannot be told what it does: {error}");
}

impl Default for Supervisor {
    fn default() -> Self {
        Self::new()
    }
}
