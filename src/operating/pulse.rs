//! Whether the daemon's work moves: what its watchdog goes by.
//!
//! Work moves where it takes a step: a safe point of a computation, a new stage, a message of a child process. A large
//! factorisation takes none for minutes; then the processor time of this process and its children tells that it is at
//! work. Who waits for a disk takes neither, and is not stuck: the system says that threads sleep for a disk. Where none
//! of the three is to be seen for as long as [`Pulse`] has patience, although inputs are on their way, something waits for
//! what never comes; that is a fault of planish, and a new start is the remedy.
//!
//! Deliberately absent: clocks, files and the system, which are in [`crate::system::vitals`] and [`crate::watch::daemon`].

use std::time::{Duration, Instant};

/// Less processor time than this part of the time that passes is that of threads that only look around. By
/// experience: a computation takes all of one processor, or nearly so, wherever it gets one.
const LEAST_SHARE: f64 = 0.05;

/// What is seen of the work at a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vitals {
    /// How many inputs are on their way that wait neither for commands nor for a disk that is full.
    pub at_work: usize,
    /// The steps since the start.
    pub steps: u64,
    /// The processor time of this process and its children since the start, without that of the daemon's own thread.
    pub processor: Duration,
}

/// Judges whether the work moves.
#[derive(Clone, Copy, Debug)]
pub struct Pulse {
    patience: Duration,
    /// What was seen when it moved the last time, and when that was.
    last: Option<(Vitals, Instant)>,
}

impl Pulse {
    /// One that waits so long for a sign of life.
    pub fn new(patience: Duration) -> Self {
        Self { patience, last: None }
    }

    /// Takes in what is seen `now`; whether the work moves, or has moved a moment ago. Whether threads wait for a disk is
    /// only asked where nothing else moves.
    ///
    /// ```
    /// use planish::operating::pulse::{Pulse, Vitals};
    /// use std::time::{Duration, Instant};
    ///
    /// let (second, begin) = (Duration::from_secs(1), Instant::now());
    /// let mut pulse = Pulse::new(60 * second);
    /// let stands_still = Vitals { at_work: 1, steps: 7, processor: second };
    /// assert!(pulse.beats(begin, stands_still, || false));
    /// assert!(pulse.beats(begin + 59 * second, stands_still, || false));
    /// assert!(!pulse.beats(begin + 60 * second, stands_still, || false));
    /// // Who waits for a disk is not stuck.
    /// assert!(pulse.beats(begin + 61 * second, stands_still, || true));
    /// ```
    pub fn beats(&mut self, now: Instant, seen: Vitals, waits_for_disk: impl FnOnce() -> bool) -> bool {
        let moves = match &self.last {
            None => true,
            Some((last, when)) => {
                seen.at_work == 0
                    || seen.steps != last.steps
                    || is_at_work(seen.processor.saturating_sub(last.processor), now.saturating_duration_since(*when))
            }
        };
        if moves || waits_for_disk() {
            self.last = Some((seen, now));
        }
        self.last.is_some_and(|(_, when)| now.saturating_duration_since(when) < self.patience)
    }
}

/// Whether so much processor time in so much time is that of a computation.
fn is_at_work(processor: Duration, passed: Duration) -> bool {
    processor > Duration::ZERO && processor.as_secs_f64() >= LEAST_SHARE * passed.as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_secs(100);

    fn seen(at_work: usize, steps: u64, seconds: f64) -> Vitals {
        Vitals { at_work, steps, processor: Duration::from_secs_f64(seconds) }
    }

    /// Whether the pulse beats still, long after `first`, if nothing but `later` is seen all the time.
    fn beats_on(first: Vitals, later: impl Fn(u32) -> Vitals, waits_for_disk: bool) -> bool {
        let (mut pulse, start) = (Pulse::new(PATIENCE), Instant::now());
        assert!(pulse.beats(start, first, || false), "it begins alive");
        (1..=30).map(|i| pulse.beats(start + i * PATIENCE / 10, later(i), || waits_for_disk)).last() == Some(true)
    }

    #[test]
    fn work_that_takes_no_step_and_no_time_is_stuck_and_every_sign_of_life_is_one() {
        let begun = seen(2, 7, 1.0);
        assert!(!beats_on(begun, |_| begun, false), "stuck");
        assert!(beats_on(begun, |i| seen(2, 7 + u64::from(i), 1.0), false), "it takes steps");
        assert!(beats_on(begun, |i| seen(2, 7, 1.0 + 10.0 * f64::from(i)), false), "a long factorisation");
        assert!(beats_on(begun, |_| begun, true), "it waits for a disk");
        assert!(beats_on(begun, |_| seen(0, 7, 1.0), false), "there is nothing to do");
    }

    #[test]
    fn threads_that_look_around_are_no_sign_of_life() {
        let begun = seen(1, 7, 1.0);
        assert!(!beats_on(begun, |i| seen(1, 7, 1.0 + 0.05 * f64::from(i)), false));
    }

    #[test]
    fn patience_is_kept_and_work_that_moves_again_lives() {
        let (mut pulse, start, begun) = (Pulse::new(PATIENCE), Instant::now(), seen(1, 7, 1.0));
        let mut at =
            |part: u32, steps: u64| pulse.beats(start + part * PATIENCE / 10, Vitals { steps, ..begun }, || false);
        assert_eq!([at(0, 7), at(9, 7), at(10, 7), at(11, 8), at(12, 8)], [true, true, false, true, true]);
    }
}
