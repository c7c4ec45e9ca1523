//! What the daemon tells: its status for `planish status`, its metrics, and to its supervisor.

use super::{ALIVE, Daemon, Phase, TELL};
use crate::conveyor;
use crate::conveyor::Conveyor;
use crate::conveyor::progress::Running;
use crate::conveyor::stage::Stage;
use crate::operating::logging;
use crate::operating::metrics::More;
use crate::operating::pulse::Vitals;
use crate::operating::status::{self, NAMED, Noted, Progress, Trouble};
use crate::output::free_space;
use crate::system::vitals;
use crate::watch::inbox::{Notable, STATES, UNSETTLED};
use std::time::Instant;

impl Daemon<'_> {
    /// Tells everybody who is to hear something now.
    pub(super) fn tell_what_is_due(&mut self, now: Instant) {
        if now >= self.next_tell && self.is_to_tell(now) {
            self.tell(now);
        }
        if self.metrics.as_ref().is_some_and(|metrics| now >= metrics.next()) {
            self.observe();
            self.write_metrics();
        }
        let conveyor = self.conveyor;
        self.supervisor.beat(now, || seen(conveyor));
    }

    /// When somebody is to hear something next.
    pub(super) fn next_words(&self) -> Instant {
        let tell = if self.is_busy() { self.next_tell } else { self.next_tell + ALIVE };
        let beat = self.supervisor.next_beat().unwrap_or(tell);
        let metrics = self.metrics.as_ref().map_or(tell, |metrics| metrics.next());
        tell.min(beat).min(metrics)
    }

    /// What is told at the very end.
    pub(super) fn last_words(&mut self) {
        self.observe();
        self.write_metrics();
    }

    fn is_busy(&self) -> bool {
        self.untold || !self.jobs.is_empty()
    }

    fn is_to_tell(&self, now: Instant) -> bool {
        self.is_busy() || now >= self.next_tell + ALIVE
    }

    fn tell(&mut self, now: Instant) {
        self.look_for_room();
        self.observe();
        let staging = self.publisher.staging().map_err(std::io::Error::other);
        let told = staging.and_then(|staging| self.lock.tell(&self.status, &staging));
        if let Err(error) = &told
            && self.is_told
        {
            tracing::warn!("the status for `planish status` cannot be written: {error}");
        }
        self.is_told = told.is_ok();
        self.supervisor.tell(self.status.line());
        self.next_tell = now + TELL;
        self.untold = false;
    }

    fn write_metrics(&mut self) {
        let Some(metrics) = &mut self.metrics else { return };
        metrics.write(&self.status, More { processor: vitals::processor(), deaths: self.conveyor.deaths() });
    }

    /// Sees whether there is room for more results. Who drains takes up what waits, whatever the room.
    pub(super) fn look_for_room(&mut self) {
        let free = free_space::free(self.publisher.out());
        let is_watching = self.phase == Phase::Watching;
        let paused = free_space::too_little(free, self.settings.min_free).filter(|_| is_watching);
        match (&paused, &self.status.paused) {
            (Some(why), None) => tracing::warn!("{why}"),
            (None, Some(_)) if is_watching => tracing::info!("there is room again: inputs are taken up"),
            _ => {}
        }
        self.conveyor.pause(paused.is_some());
        self.untold |= paused.is_some() != self.status.paused.is_some();
        (self.status.bytes_free, self.status.paused) = (free, paused);
    }

    /// Brings the status up to date.
    fn observe(&mut self) {
        let waiting = self.conveyor.waiting();
        let status = &mut self.status;
        status.draining = self.phase != Phase::Watching;
        status.waiting = waiting.len();
        status.next = waiting.iter().take(NAMED).map(|job| job.name.to_string_lossy().into_owned()).collect();
        status.running = self.conveyor.running().into_iter().map(Progress::from).collect();
        // One of them stands for all; the first by its text, so that it is the same one the next time.
        let trouble = status.running.iter().filter_map(|job| job.trouble.as_ref()).min();
        if let Some(trouble) = trouble {
            let is_known = status.last_error.as_ref().is_some_and(|error| error.message == *trouble);
            if !is_known {
                status.last_error = Some(Trouble::now(trouble));
            }
        }
        status.notable = self.inbox.notable().take(NAMED).map(Noted::from).collect();
        // Each is counted even where there is none.
        status.notable_states = STATES.map(|state| (state.to_owned(), 0)).into();
        for notable in self.inbox.notable() {
            *status.notable_states.entry(notable.state.to_owned()).or_default() += 1;
        }
        status.notables = status.notable_states.values().sum();
        status.unsettled = status.notable_states[UNSETTLED];
        status.oldest = self.inbox.oldest().map(|since| status::tenths(since.elapsed()));
        status.told = status::now();
        status.min_free = Some(self.settings.min_free);
        let lost = logging::lost();
        if lost > status.log_lines_lost {
            (status.log_lines_lost, status.last_lost) = (lost, Some(status.told));
        }
    }
}

impl From<Running> for Progress {
    fn from(running: Running) -> Self {
        Self {
            name: running.name.to_string_lossy().into_owned(),
            stage: running.stage.name().to_owned(),
            charts_done: running.charts_done,
            charts: running.charts,
            seconds: status::tenths(running.since.elapsed()),
            trouble: running.trouble,
        }
    }
}

impl From<Notable<'_>> for Noted {
    fn from(notable: Notable) -> Self {
        Self {
            name: notable.name.to_string_lossy().into_owned(),
            state: notable.state.to_owned(),
            reason: notable.reason.to_owned(),
            seconds: status::tenths(notable.since.elapsed()),
        }
    }
}

/// What is seen of the work.
fn seen(conveyor: &Conveyor) -> Vitals {
    let running = conveyor.running();
    let processor = vitals::processor().saturating_sub(vitals::processor_of_this_thread());
    Vitals { at_work: at_work(&running), steps: conveyor.steps(), processor }
}

/// How many of these should move.
fn at_work(running: &[Running]) -> usize {
    let with_commands = running.iter().filter(|job| job.stage == Stage::Chain).count();
    // Results that cannot be written keep their memory, and others wait for that; and behind so many results that wait for
    // their commands, all else stands still.
    let is_held_up = running.iter().any(|job| job.trouble.is_some()) || with_commands >= conveyor::CHAINED;
    if is_held_up { 0 } else { running.len() - with_commands }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn running(stage: Stage, trouble: Option<&str>) -> Running {
        let (name, since, trouble) = ("a.stl".into(), Instant::now(), trouble.map(str::to_owned));
        Running { name, stage, charts_done: 0, charts: 0, since, trouble }
    }

    #[test]
    fn who_waits_for_commands_or_for_a_disk_that_is_full_is_not_at_work() {
        let mut all = vec![running(Stage::Read, None), running(Stage::Map, None), running(Stage::Chain, None)];
        assert_eq!(at_work(&all), 2);
        all.push(running(Stage::Write, Some("no space left on device")));
        assert_eq!(at_work(&all), 0, "what is kept takes memory for which others wait");
        all.pop();
        all.resize(3 + conveyor::CHAINED, running(Stage::Chain, None));
        assert_eq!(at_work(&all), 0);
    }
}
