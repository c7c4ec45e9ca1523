//! The semaphore: no more computations at once than `--jobs` says.
//!
//! Whoever computes has gone through, and leaves before it waits for anything else: a full channel, memory, a disk. So
//! those inside always move on, and nobody waits in a circle. Those who wait enter in the order of their turns; at its
//! safe points a long computation lets those ahead of it pass.

use super::queue::Turn;
use super::sync::{Condvar, Mutex, MutexGuard};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};

/// Lets a number of computations in.
#[derive(Debug)]
pub struct PrioritySemaphore {
    state: Mutex<State>,
    moved: Condvar,
    /// The least turn that waits: a hint, read without the lock.
    ahead: AtomicU64,
}

#[derive(Debug)]
struct State {
    free: usize,
    tickets: u64,
    waiting: BTreeSet<(Turn, u64)>,
}

impl PrioritySemaphore {
    /// One that lets `places` computations in at once.
    pub fn new(places: usize) -> Self {
        let state = State { free: places, tickets: 0, waiting: BTreeSet::new() };
        Self { state: Mutex::new(state), moved: Condvar::new(), ahead: AtomicU64::new(Turn::MAX) }
    }

    /// Waits for a place.
    pub fn enter(&self, turn: Turn) {
        self.wait(self.state.lock(), turn);
    }

    fn wait(&self, mut state: MutexGuard<State>, turn: Turn) {
        state.tickets += 1;
        let me = (turn, state.tickets);
        state.waiting.insert(me);
        // Only the first in the order of turns goes in: a place that another would take is left to it.
        while state.free == 0 || state.waiting.first() != Some(&me) {
            self.hint(&state);
            self.moved.wait(&mut state);
        }
        state.waiting.remove(&me);
        state.free -= 1;
        self.hint(&state);
        // Whoever is first now was woken before, perhaps, and went back to sleep as it was not.
        if state.free > 0 {
            self.moved.notify_all();
        }
    }

    /// Gives the place back.
    pub fn leave(&self) {
        self.state.lock().free += 1;
        self.moved.notify_all();
    }

    /// Whether somebody ahead of `turn` waits: a hint.
    pub fn is_waited_for(&self, turn: Turn) -> bool {
        self.ahead.load(Ordering::Relaxed) < turn
    }

    /// Called from inside: lets those ahead of `turn` pass.
    pub fn yield_to(&self, turn: Turn) {
        if self.is_waited_for(turn) {
            // In one step, so that none of those behind slips in before.
            let mut state = self.state.lock();
            state.free += 1;
            self.moved.notify_all();
            self.wait(state, turn);
        }
    }

    fn hint(&self, state: &State) {
        let first = state.waiting.first().map_or(Turn::MAX, |w| w.0);
        self.ahead.store(first, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    #[test]
    fn never_more_inside_than_places() {
        let (semaphore, inside, most) = (PrioritySemaphore::new(3), AtomicUsize::new(0), AtomicUsize::new(0));
        std::thread::scope(|s| {
            for turn in 0..12 {
                let (semaphore, inside, most) = (&semaphore, &inside, &most);
                s.spawn(move || {
                    for _ in 0..200 {
                        semaphore.enter(turn);
                        most.fetch_max(inside.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                        inside.fetch_sub(1, Ordering::SeqCst);
                        semaphore.yield_to(turn);
                        semaphore.leave();
                    }
                });
            }
        });
        assert!((1..=3).contains(&most.into_inner()));
        assert_eq!(semaphore.state.lock().free, 3);
    }

    #[test]
    fn who_is_ahead_passes_at_a_safe_point() {
        let semaphore = PrioritySemaphore::new(1);
        let order = Mutex::new(Vec::new());
        semaphore.enter(50);
        std::thread::scope(|s| {
            for turn in [90, 10, 70] {
                let (semaphore, order) = (&semaphore, &order);
                s.spawn(move || {
                    semaphore.enter(turn);
                    order.lock().push(turn);
                    semaphore.leave();
                });
            }
            while semaphore.state.lock().waiting.len() < 3 {
                std::thread::yield_now();
            }
            semaphore.yield_to(50);
            order.lock().push(50);
            semaphore.leave();
        });
        assert_eq!(order.into_inner(), [10, 50, 70, 90]);
    }
}
