//! The jobs that wait, in a fair order.
//!
//! A job is served by its place in *virtual time*: the bytes of all jobs that had ended when it came, plus its own
//! (self-clocked fair queueing; Golestani 1994, doi 10.1109/INFCOM.1994.337677). So small files pass a large one that
//! came before them, but only until as many bytes as it has were done: nobody waits for ever.

use crate::input::job::Job;
use parking_lot::{Condvar, Mutex};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A place in virtual time: who comes first has the smaller one.
pub type Turn = u64;

/// What every job costs beside its bytes, in bytes. By experience: without it, any number of tiny files would pass a large
/// one; much more, and they would not pass at all.
const OVERHEAD: u64 = 16 << 10;

/// Jobs below these sizes (bytes) travel apart from larger ones, so that a stage never waits for a job that is
/// thousands of times as large. By experience: more lanes take more threads, and more memory for what waits in them.
const CLASSES: [u64; LANES - 1] = [1 << 20, 16 << 20];

/// How many classes of size there are, and thus lanes.
pub const LANES: usize = 3;

/// A job with its place in the order.
#[derive(Clone, Debug)]
pub struct Waiting {
    /// The job.
    pub job: Arc<Job>,
    /// Its place in virtual time.
    pub turn: Turn,
}

/// The jobs that wait.
///
/// ```
/// use planish::conveyor::queue::Queue;
/// use planish::input::job::Job;
/// use std::sync::Arc;
///
/// let queue = Queue::default();
/// for (name, bytes) in [("large", 900_000), ("small", 1_000)] {
///     queue.push(Arc::new(Job::new(name.into(), name.into(), bytes)));
/// }
/// // Small ones pass, until as many bytes as the large one has were done.
/// let first = queue.pop(0).expect("a job");
/// assert_eq!(first.job.name, std::path::Path::new("small"));
/// ```
#[derive(Debug, Default)]
pub struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    lanes: [BTreeMap<(Turn, u64), Waiting>; LANES],
    arrivals: u64,
    ended: u64,
    closed: bool,
    paused: bool,
}

/// The lane for an input of `bytes`.
///
/// ```
/// use planish::conveyor::queue::lane;
///
/// let (kib, mib) = (1 << 10, 1 << 20);
/// assert_eq!([lane(20 * kib), lane(mib), lane(15 * mib), lane(16 * mib)], [0, 1, 1, 2]);
/// ```
pub fn lane(bytes: u64) -> usize {
    CLASSES.iter().take_while(|limit| bytes >= **limit).count()
}

/// What a job costs in virtual time. A sparse file may claim more bytes than there are.
fn cost(job: &Job) -> u64 {
    job.bytes.saturating_add(OVERHEAD)
}

impl Queue {
    /// Puts a job in its place.
    pub fn push(&self, job: Arc<Job>) {
        let mut state = self.state.lock();
        let turn = state.ended.saturating_add(cost(&job));
        state.arrivals += 1;
        let arrival = state.arrivals;
        state.lanes[lane(job.bytes)].insert((turn, arrival), Waiting { job, turn });
        self.changed.notify_all();
    }

    /// The next job for `lane`; waits for one. None: there will be no more.
    pub fn pop(&self, lane: usize) -> Option<Waiting> {
        let mut state = self.state.lock();
        loop {
            let may_go = !state.paused || state.closed;
            if may_go && let Some((_, waiting)) = state.lanes[lane].pop_first() {
                return Some(waiting);
            }
            if state.closed {
                return None;
            }
            self.changed.wait(&mut state);
        }
    }

    /// A job ended: virtual time goes on.
    pub fn ended(&self, job: &Job) {
        let mut state = self.state.lock();
        state.ended = state.ended.saturating_add(cost(job));
    }

    /// No job goes on, or all do again. Once it is closed, they go on in any case.
    pub fn pause(&self, is_paused: bool) {
        self.state.lock().paused = is_paused;
        self.changed.notify_all();
    }

    /// No more jobs will come: those that wait are still served.
    pub fn close(&self) {
        self.state.lock().closed = true;
        self.changed.notify_all();
    }

    /// The jobs that wait, in the order in which they will be served as far as that is known.
    pub fn waiting(&self) -> Vec<Arc<Job>> {
        let state = self.state.lock();
        let mut all: Vec<_> = state.lanes.iter().flatten().collect();
        all.sort_by_key(|(place, _)| **place);
        let wanted = all.into_iter().filter(|(_, waiting)| waiting.job.is_wanted());
        wanted.map(|(_, waiting)| waiting.job.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(name: &str, bytes: u64) -> Arc<Job> {
        Arc::new(Job::new(name.into(), name.into(), bytes))
    }

    fn names(queue: &Queue) -> Vec<String> {
        queue.waiting().iter().map(|j| j.name.display().to_string()).collect()
    }

    #[test]
    fn small_jobs_pass_a_large_one_but_not_for_ever() {
        let queue = Queue::default();
        queue.push(job("large", 900_000));
        queue.push(job("small", 1000));
        assert_eq!(names(&queue), ["small", "large"]);
        let served = |queue: &Queue| queue.pop(0).expect("one waits").job;
        queue.ended(&served(&queue));
        let mut passed = 0;
        loop {
            queue.push(job("late", 1000));
            let next = served(&queue);
            queue.ended(&next);
            if next.name.display().to_string() == "large" {
                break;
            }
            passed += 1;
            assert!(passed < 100, "the large one starves");
        }
        assert!(passed > 40, "only {passed} passed");
    }

    #[test]
    fn files_that_claim_all_bytes_there_are_do_no_harm() {
        let queue = Queue::default();
        for name in ["a", "b", "c"] {
            queue.push(job(name, u64::MAX >> 1));
            queue.ended(&queue.pop(2).expect("one waits").job);
        }
        queue.push(job("small", 1));
        assert_eq!(names(&queue), ["small"]);
    }

    #[test]
    fn none_goes_on_in_a_pause_and_none_waits_behind_the_end() {
        let queue = Queue::default();
        queue.pause(true);
        queue.push(job("a", 1));
        std::thread::scope(|scope| {
            let served = scope.spawn(|| queue.pop(0));
            std::thread::sleep(std::time::Duration::from_millis(50));
            assert_eq!((names(&queue).len(), served.is_finished()), (1, false));
            queue.pause(false);
            assert!(served.join().expect("ends").is_some());
        });
        queue.pause(true);
        queue.push(job("b", 1));
        queue.close();
        assert!(queue.pop(0).is_some() && queue.pop(0).is_none());
    }

    #[test]
    fn jobs_of_equal_size_keep_their_order_and_sizes_travel_apart() {
        let queue = Queue::default();
        ["a", "b", "c"].iter().for_each(|n| queue.push(job(n, 10)));
        queue.push(job("huge", 1 << 30));
        queue.close();
        let queue = &queue;
        let rest = |lane| std::iter::from_fn(move || queue.pop(lane)).map(|w| w.job.name.display().to_string());
        assert_eq!(rest(0).collect::<Vec<_>>(), ["a", "b", "c"]);
        assert_eq!((rest(1).count(), rest(2).collect::<Vec<_>>()), (0, vec!["huge".to_owned()]));
    }
}
