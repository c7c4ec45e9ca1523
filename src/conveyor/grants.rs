//! Where places to compute and memory come from: from this process, or, in the process of a single job, from its parent
//! ([`super::apart`]).

use super::budget::{Account, Budget};
use super::queue::Turn;
use super::semaphore::PrioritySemaphore;

/// Grants places and memory. Who holds a place waits for nothing else; see [`super`].
pub(super) trait Grants: Send + Sync {
    /// Waits for a place to compute.
    fn enter(&self, turn: Turn);

    /// Gives the place back.
    fn leave(&self);

    /// Called from inside: lets those ahead of `turn` pass.
    fn yield_to(&self, turn: Turn);

    /// Whether somebody ahead of `turn` waits for a place.
    fn is_waited_for(&self, turn: Turn) -> bool;

    /// Takes memory if it is there and nobody waits for it.
    fn try_take(&self, account: Account, bytes: u64) -> bool;

    /// Waits for memory.
    fn take(&self, account: Account, bytes: u64, turn: Turn);

    /// Takes memory whether it is there or not: for what is cancelled, and gives it back at once.
    fn overdraw(&self, account: Account, bytes: u64);

    /// Gives memory back.
    fn give_back(&self, account: Account, bytes: u64);
}

/// Those of this process.
#[derive(Debug)]
pub(super) struct Own {
    semaphore: PrioritySemaphore,
    budget: Budget,
}

impl Own {
    /// Places for so many computations, and so many bytes.
    pub fn new(places: usize, memory: u64) -> Self {
        Self { semaphore: PrioritySemaphore::new(places), budget: Budget::new(memory) }
    }
}

impl Grants for Own {
    fn enter(&self, turn: Turn) {
        self.semaphore.enter(turn);
    }

    fn leave(&self) {
        self.semaphore.leave();
    }

    fn yield_to(&self, turn: Turn) {
        self.semaphore.yield_to(turn);
    }

    fn is_waited_for(&self, turn: Turn) -> bool {
        self.semaphore.is_waited_for(turn)
    }

    fn try_take(&self, account: Account, bytes: u64) -> bool {
        self.budget.try_take(account, bytes)
    }

    fn take(&self, account: Account, bytes: u64, turn: Turn) {
        self.budget.take(account, bytes, turn);
    }

    fn overdraw(&self, account: Account, bytes: u64) {
        self.budget.overdraw(account, bytes);
    }

    fn give_back(&self, account: Account, bytes: u64) {
        self.budget.give_back(account, bytes);
    }
}
