//! The daemon: what is seen in the inbox becomes jobs, what is asked from outside is done.

use crate::conveyor::{Conveyor, Ended};
use crate::inbox::{Change, Inbox};
use crate::job::{End, Job};
use crate::publish::Publisher;
use crate::settings::Settings;
use crate::shown::shown;
use crate::status::{Counts, Lock, NAMED, Progress, Status};
use crate::watch::{Event, Eyes, Stop};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

/// A job that could not be ended is tried again after this.
const AGAIN: Duration = Duration::from_secs(30);

/// The status is told at most this often.
const TELL: Duration = Duration::from_millis(500);

/// How long jobs have to reach a safe point when the daemon stops.
const PATIENCE: Duration = Duration::from_secs(3);

/// The output folder was removed, or another one has its name.
#[derive(Debug, thiserror::Error)]
#[error("the output folder was removed or replaced while results were written to it; start the daemon again")]
pub struct OutIsGone;

/// What the daemon is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Watching,
    /// Finishing what waits.
    Draining,
    /// Waiting until the cancelled jobs have reached a safe point; at most until then.
    Stopping(Instant),
}

/// The daemon.
pub struct Daemon<'a> {
    settings: &'a Settings,
    conveyor: &'a Conveyor,
    lock: &'a Lock,
    publisher: &'a Publisher,
    eyes: Eyes,
    inbox: Inbox,
    jobs: BTreeMap<PathBuf, Arc<Job>>,
    phase: Phase,
    status: Status,
    next_look: Instant,
    next_tell: Instant,
    /// Whether something may have changed since the status was told.
    untold: bool,
}

impl<'a> Daemon<'a> {
    /// A daemon that watches the folder `inbox`.
    pub fn new(
        inbox: &Path,
        settings: &'a Settings,
        conveyor: &'a Conveyor,
        (lock, publisher): (&'a Lock, &'a Publisher),
    ) -> Self {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_secs());
        let status =
            Status { pid: std::process::id(), inbox: inbox.to_string_lossy().into_owned(), since, ..Status::default() };
        let now = Instant::now();
        Self {
            settings,
            conveyor,
            lock,
            publisher,
            eyes: Eyes::new(inbox, settings.recursive, settings.poll),
            inbox: Inbox::default(),
            jobs: BTreeMap::new(),
            phase: Phase::Watching,
            status,
            next_look: now,
            next_tell: now,
            untold: true,
        }
    }

    /// Watches until it is asked to stop, and has stopped. Returns what has ended.
    ///
    /// # Errors
    /// [`OutIsGone`]: there is no place for results any more.
    pub fn run(mut self, stop: &Stop) -> Result<Counts, OutIsGone> {
        loop {
            if !self.lock.is_held() {
                return Err(OutIsGone);
            }
            let now = Instant::now();
            if self.phase == Phase::Watching && now >= self.next_look {
                self.look(now);
            }
            if now >= self.next_tell && (self.untold || !self.jobs.is_empty()) {
                self.tell(now);
            }
            let event = self.next_event(stop);
            self.untold |= !matches!(event, Event::Tick);
            match event {
                Event::Hint => self.next_look = self.next_look.min(self.eyes.rested()),
                Event::Ended(ended) => self.ended(*ended),
                Event::Stop => self.stop(),
                Event::Tick => {}
            }
            let over = match self.phase {
                Phase::Watching => false,
                Phase::Draining => self.jobs.is_empty(),
                Phase::Stopping(latest) => self.jobs.is_empty() || Instant::now() >= latest,
            };
            if over {
                return Ok(self.status.ended);
            }
        }
    }

    fn next_event(&self, stop: &Stop) -> Event {
        let mut wake = match self.phase {
            Phase::Watching => self.next_look,
            Phase::Draining => Instant::now() + TELL,
            Phase::Stopping(latest) => latest,
        };
        if self.untold || !self.jobs.is_empty() {
            wake = wake.min(self.next_tell);
        }
        self.eyes.wait(self.conveyor, stop, wake)
    }

    /// Looks at the inbox, and does what follows from that.
    fn look(&mut self, now: Instant) {
        let listing = self.eyes.look();
        self.next_look = now + self.eyes.period();
        if let Some(listing) = listing {
            self.untold |= self.inbox.due().is_some();
            for change in self.inbox.look(&listing, now) {
                self.follow(change);
            }
            self.look_when_due();
        }
        self.next_look = self.next_look.max(self.eyes.rested());
    }

    /// The next look comes when a file may have settled, but not before the last one has rested.
    fn look_when_due(&mut self) {
        let due = self.inbox.due().map(|due| due.max(self.eyes.rested()));
        self.next_look = due.map_or(self.next_look, |due| due.min(self.next_look));
    }

    fn follow(&mut self, change: Change) {
        match change {
            Change::Settled(name, look, since) => {
                tracing::debug!(input = shown(&name), bytes = look.bytes, "settled");
                let job = Arc::new(Job::of_inbox(self.eyes.inbox(), &name, look, since));
                self.jobs.insert(name, job.clone());
                self.conveyor.submit(job);
            }
            Change::Withdrawn(name) => {
                if let Some(job) = self.jobs.remove(&name) {
                    tracing::info!(input = shown(&name), "changed or removed: the job is cancelled");
                    job.cancel();
                }
            }
        }
    }

    fn ended(&mut self, Ended { job, end }: Ended) {
        if let Some(done) = end.standing().filter(|done| !done.up_to_date) {
            self.status.ended.count(done.report.status);
        } else if matches!(end, End::Lost) {
            tracing::error!(
                input = shown(&job.name),
                "a stage broke down: that is a fault of planish; please report it"
            );
        }
        // A withdrawn job says nothing about the file that has its name now.
        if self.jobs.get(&job.name).is_some_and(|current| Arc::ptr_eq(current, &job)) {
            self.jobs.remove(&job.name);
            let Some(look) = job.look else { return };
            self.eyes.look_beside(&job.name, job.beside());
            match end {
                End::Done(_) => self.inbox.done(&job.name, &look),
                End::Later(_, then) => self.inbox.again(&job.name, &look, then),
                // What it waits for is part of what is seen of it now.
                End::Waiting(reason) => {
                    tracing::info!(input = shown(&job.name), "waits: {}", reason.message);
                    self.inbox.done(&job.name, &look);
                }
                End::Changed | End::Outdated(_) => {
                    self.inbox.again(&job.name, &look, Instant::now() + Duration::from_secs(1));
                }
                End::Unwritten(error) if error.is_lasting() => self.inbox.done(&job.name, &look),
                End::Unwanted | End::Unwritten(_) | End::Unchained(..) | End::Lost => {
                    self.inbox.again(&job.name, &look, Instant::now() + AGAIN);
                }
            }
            self.look_when_due();
        }
    }

    /// The first time politely, then at once.
    fn stop(&mut self) {
        self.conveyor.close();
        if self.settings.drain && self.phase == Phase::Watching {
            tracing::info!(inputs = self.jobs.len(), "told to stop: finishes what waits; told again, it stops at once");
            self.phase = Phase::Draining;
        } else if !matches!(self.phase, Phase::Stopping(_)) {
            tracing::info!(inputs = self.jobs.len(), "told to stop: the next start does what is not done");
            self.jobs.values().for_each(|job| job.cancel());
            self.phase = Phase::Stopping(Instant::now() + PATIENCE);
        } else {
            self.phase = Phase::Stopping(Instant::now());
        }
        self.next_tell = Instant::now();
    }

    fn tell(&mut self, now: Instant) {
        let waiting = self.conveyor.waiting();
        self.status.draining = self.phase != Phase::Watching;
        self.status.waiting = waiting.len();
        self.status.next = waiting.iter().take(NAMED).map(|job| job.name.to_string_lossy().into_owned()).collect();
        self.status.running = self.conveyor.running().into_iter().map(Progress::from).collect();
        self.status.unsettled = self.inbox.unsettled();
        self.status.log_lines_lost = crate::logging::lost();
        let staging = self.publisher.staging().map_err(std::io::Error::other);
        if let Err(error) = staging.and_then(|staging| self.lock.tell(&self.status, &staging)) {
            tracing::warn!("the status for `planish status` cannot be written: {error}");
        }
        self.next_tell = now + TELL;
        self.untold = false;
    }
}
