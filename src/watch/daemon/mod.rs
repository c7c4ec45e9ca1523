//! The daemon: what is seen in the inbox becomes jobs, what is asked from outside is done.

mod reloading;
mod telling;

use super::stop::Stop;
use super::watcher::{Event, InboxWatcher};
use crate::conveyor::Conveyor;
use crate::conveyor::completion::{Completion, Done, End};
use crate::input::job::Job;
use crate::operating::metrics::Metrics;
use crate::operating::status::{self, Counts, Held, Lock, Status, Trouble};
use crate::operating::supervisor::Supervisor;
use crate::output::publish::Publisher;
use crate::output::retention::Retention;
use crate::result_files;
use crate::settings::Settings;
use crate::system::escape::escape;
use crate::watch::inbox::{Change, Doubt, Inbox, Rest};
use blake3::Hash;
pub use reloading::Source;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A job whose file has changed is done again after this.
const SOON: Duration = Duration::from_secs(1);

/// The content of an input that stays is looked at once more after this: what is written through shared memory changes
/// neither size nor times.
const DOUBT: Duration = Duration::from_secs(30);

/// An input that is not done after this is worth a warning. By experience: the largest ones may take longer, and a warning does
/// them no harm.
const LONG: Duration = Duration::from_secs(600);

/// So many results at most are looked for whenever the inbox is looked at: each takes a call of the system, on a disk that
/// may be far away. More find a removed result sooner.
const LOOKED_FOR: usize = 500;

/// The status is told at least this often, so that one knows that the daemon lives.
const ALIVE: Duration = Duration::from_secs(10);

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
    settings: Arc<Settings>,
    source: Source<'a>,
    conveyor: &'a Conveyor,
    lock: &'a mut Lock,
    publisher: &'a Publisher,
    watcher: InboxWatcher,
    inbox: Inbox,
    jobs: BTreeMap<PathBuf, Arc<Job>>,
    /// Jobs that may have been taken up with settings that are no longer in force.
    outdated: BTreeSet<PathBuf>,
    retention: Retention,
    phase: Phase,
    status: Status,
    supervisor: Supervisor,
    metrics: Option<Metrics>,
    next_look: Instant,
    next_tell: Instant,
    /// Whether something may have changed since the status was told.
    untold: bool,
    /// Whether the status could be told the last time.
    is_told: bool,
    /// Whether it was told that the lock cannot be looked at.
    is_lock_unknown: bool,
}

impl<'a> Daemon<'a> {
    /// A daemon that watches the folder `inbox`.
    pub fn new(
        inbox: &Path,
        (settings, source): (&Settings, Source<'a>),
        conveyor: &'a Conveyor,
        (lock, publisher): (&'a mut Lock, &'a Publisher),
    ) -> Self {
        let (pid, since) = (std::process::id(), status::now());
        let status = Status { pid, inbox: inbox.to_string_lossy().into_owned(), since, ..Status::default() };
        let now = Instant::now();
        Self {
            settings: Arc::new(settings.clone()),
            source,
            conveyor,
            lock,
            publisher,
            watcher: InboxWatcher::new(inbox, settings.recursive, settings.poll),
            inbox: Inbox::default(),
            jobs: BTreeMap::new(),
            outdated: BTreeSet::new(),
            retention: Retention::new(publisher.out()),
            phase: Phase::Watching,
            status,
            supervisor: Supervisor::new(),
            metrics: settings.metrics.as_deref().map(Metrics::new),
            next_look: now,
            next_tell: now,
            untold: true,
            is_told: true,
            is_lock_unknown: false,
        }
    }

    /// Watches until it is asked to stop, and has stopped. Returns what has ended.
    ///
    /// # Errors
    /// [`OutIsGone`]: there is no place for results any more.
    pub fn run(mut self, stop: &Stop) -> Result<Counts, OutIsGone> {
        self.look(Instant::now());
        self.supervisor.ready();
        loop {
            if let Err(gone) = self.hold_lock() {
                self.abandon();
                return Err(gone);
            }
            let now = Instant::now();
            if self.phase == Phase::Watching && now >= self.next_look {
                self.look(now);
            }
            self.tell_what_is_due(now);
            let event = self.next_event(stop);
            self.untold |= !matches!(event, Event::Tick);
            match event {
                Event::Hint => self.next_look = self.next_look.min(self.watcher.next_scan()),
                Event::Completion(ended) => self.ended(*ended),
                Event::Stop => self.stop(),
                Event::Reload => self.reload(),
                Event::Tick => {}
            }
            if self.is_over() {
                self.last_words();
                return Ok(self.status.ended);
            }
        }
    }

    /// Whether there is nothing to wait for any more.
    fn is_over(&self) -> bool {
        match self.phase {
            Phase::Watching => false,
            Phase::Draining => self.jobs.is_empty(),
            Phase::Stopping(latest) => self.jobs.is_empty() || Instant::now() >= latest,
        }
    }

    /// Sees that this is still the one daemon of the output folder.
    fn hold_lock(&mut self) -> Result<(), OutIsGone> {
        let held = self.lock.hold();
        match &held {
            Held::No => return Err(OutIsGone),
            Held::Yes => {}
            Held::Again => tracing::warn!("the lock of the output folder was removed, and is taken again"),
            Held::Unknown(_) if self.is_lock_unknown => {}
            Held::Unknown(error) => {
                self.must_be_seen_to(format!("the lock of the output folder cannot be looked at: {error}"));
            }
        }
        self.is_lock_unknown = matches!(held, Held::Unknown(_));
        Ok(())
    }

    /// There is no place for results any more: all jobs end, and what was started for them.
    fn abandon(&self) {
        self.conveyor.close();
        self.jobs.values().for_each(|job| job.cancel());
        let latest = Instant::now() + PATIENCE;
        while !self.conveyor.running().is_empty() && Instant::now() < latest {
            let _ = self.conveyor.next(Duration::from_millis(50));
        }
    }

    /// Says what an operator must act on.
    fn must_be_seen_to(&mut self, message: String) {
        tracing::error!("{message}");
        self.status.last_error = Some(Trouble::now(message));
    }

    fn next_event(&self, stop: &Stop) -> Event {
        let mut wake = match self.phase {
            Phase::Watching => self.next_look,
            Phase::Draining => Instant::now() + TELL,
            Phase::Stopping(latest) => latest,
        };
        wake = wake.min(self.next_words());
        self.watcher.wait(self.conveyor, stop, wake)
    }

    /// Looks at the inbox, and does what follows from that.
    fn look(&mut self, now: Instant) {
        let snapshot = self.watcher.look();
        self.next_look = now + self.watcher.period();
        if let Some(snapshot) = snapshot {
            self.look_for_room();
            self.untold |= self.inbox.due().is_some();
            for change in self.inbox.look(&snapshot, now) {
                self.follow(change);
            }
            self.look_for_results(now);
            self.remove_old_results(now);
            self.warn_of_overdue(now);
            self.look_when_due();
        }
        self.next_look = self.next_look.max(self.watcher.next_scan());
    }

    /// The next look comes when a file may have settled, but not before the last one has rested.
    fn look_when_due(&mut self) {
        if let Some(due) = self.inbox.due() {
            let due = due.max(self.watcher.next_scan());
            self.next_look = self.next_look.min(due);
        }
    }

    /// Sees whether results are still there: who removes one has its input done again.
    fn look_for_results(&mut self, now: Instant) {
        for name in self.inbox.published(LOOKED_FOR) {
            let report = self.publisher.target(&name).join(result_files::REPORT);
            if fs::symlink_metadata(report).is_err_and(|e| e.kind() == ErrorKind::NotFound) {
                tracing::info!(input = escape(&name), "its result was removed: it is done again");
                self.inbox.forget(&name, now);
            }
        }
    }

    /// Removes some of the results whose time is over.
    fn remove_old_results(&mut self, now: Instant) {
        let Some(kept) = self.settings.keep_results.filter(|_| self.watcher.is_there()) else { return };
        let jobs = &self.jobs;
        self.retention.step(now, kept, self.watcher.inbox(), |name| jobs.contains_key(name));
    }

    fn warn_of_overdue(&mut self, now: Instant) {
        for notable in self.inbox.overdue(now, LONG) {
            let minutes = now.saturating_duration_since(notable.since).as_secs() / 60;
            let (input, state) = (escape(notable.name), notable.state);
            tracing::warn!(input, state, minutes, "is not done: {}", notable.reason);
        }
    }

    fn follow(&mut self, change: Change) {
        match change {
            Change::Settled(name, look, since) => {
                tracing::debug!(input = escape(&name), bytes = look.bytes, "settled");
                self.submit(Job::of_inbox(self.watcher.inbox(), &name, look, since));
            }
            Change::Doubted(name, look, hash) => {
                self.submit(Job::of_inbox(self.watcher.inbox(), &name, look, Instant::now()).doubting(hash));
            }
            Change::Withdrawn(name) => {
                self.outdated.remove(&name);
                if let Some(job) = self.jobs.remove(&name) {
                    tracing::info!(input = escape(&name), "changed or removed: the job is cancelled");
                    job.cancel();
                }
            }
        }
    }

    fn submit(&mut self, job: Job) {
        let job = Arc::new(job);
        self.jobs.insert(job.name.clone(), job.clone());
        self.conveyor.submit(job);
    }

    fn ended(&mut self, Completion { job, end }: Completion) {
        if let Some(done) = end.standing().filter(|done| !done.up_to_date) {
            self.status.ended.count(done.report.status);
            self.status.last_published = Some(status::now());
        }
        if let Some(metrics) = &mut self.metrics {
            metrics.soon();
        }
        // A withdrawn job says nothing about the file that has its name now.
        if self.jobs.get(&job.name).is_some_and(|current| Arc::ptr_eq(current, &job)) {
            self.jobs.remove(&job.name);
            self.rest(&job, end);
            if self.outdated.remove(&job.name) {
                self.inbox.forget(&job.name, Instant::now());
            }
            self.look_when_due();
        }
    }

    /// What becomes of a file whose job has ended.
    fn rest(&mut self, job: &Job, end: End) {
        let (name, now) = (&job.name, Instant::now());
        let Some(look) = &job.look else { return };
        if job.doubted.is_none() {
            self.watcher.look_beside(name, job.beside());
        }
        match end {
            End::Done(done) => {
                let doubt = self.doubt(&done, now);
                self.inbox.done(name, look, Rest::Published, doubt);
            }
            End::Taken(_, message) => {
                self.status.last_error = Some(Trouble::now(&message));
                self.inbox.done(name, look, Rest::Delivered, None);
            }
            End::Same => self.inbox.done(name, look, Rest::Published, None),
            End::Later(_, then) => {
                self.inbox.again(name, look, then, "it is put away when it has not changed for ten seconds");
            }
            End::Held(_, why) => {
                if self.inbox.failed(name, look, now, why) == 1 {
                    let of_job = tracing::info_span!("job", input = escape(name));
                    of_job.in_scope(|| tracing::info!("{why}"));
                }
            }
            // What it waits for is part of what is seen of it now.
            End::Waiting(reason) => {
                tracing::info!(input = escape(name), "waits: {}", reason.message);
                self.inbox.done(name, look, Rest::Waits(reason.message), None);
            }
            End::Changed | End::Outdated(_) => self.inbox.again(name, look, now + SOON, "it has changed"),
            End::Again(reason) => {
                self.inbox.failed(name, look, now, &reason.message);
            }
            End::Unwanted => {
                self.inbox.failed(name, look, now, "its job was cancelled");
            }
            End::Unwritten(error) => {
                self.status.last_error = Some(Trouble::now(&error));
                if error.is_lasting() {
                    self.inbox.done(name, look, Rest::Aside(error.to_string()), None);
                } else {
                    self.inbox.failed(name, look, now, &error.to_string());
                }
            }
            End::Unchained(_, message) => {
                self.status.last_error = Some(Trouble::now(&message));
                self.inbox.failed(name, look, now, &message);
            }
            End::Lost => {
                let message = "a stage broke down: that is a fault of planish; please report it";
                self.must_be_seen_to(format!("{}: {message}", escape(name)));
                self.inbox.failed(name, look, now, message);
            }
        }
    }

    /// Whether and when the content of an input that is done with is looked at once more.
    fn doubt(&self, done: &Done, now: Instant) -> Option<Doubt> {
        let hash = done.report.input.blake3.as_deref()?;
        Some((now + DOUBT, Hash::from_hex(hash).ok()?))
    }

    /// The first time politely, then at once.
    fn stop(&mut self) {
        self.supervisor.stopping();
        self.conveyor.close();
        // Where there is no room, what waits cannot be finished.
        let may_drain = self.settings.drain && self.status.paused.is_none();
        if may_drain && self.phase == Phase::Watching {
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
}
