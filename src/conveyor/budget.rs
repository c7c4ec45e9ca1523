//! The memory budget: what inputs on their way and factorisations may take together.
//!
//! Several accounts share one limit. An input takes the memory of its data before it is read and holds it until its
//! result stands; a chart takes that of a factorisation before it begins. Neither waits for ever: where its own account
//! is empty, a request is granted whatever its size, so that an input larger than the budget is done too; and who holds
//! a factorisation waits for nothing but its turn to compute. Inputs of each lane have an account of their own, so that
//! a large one does not keep small ones from being read; what they take beyond the limit is little. Requests of one
//! account are granted in the order of their turns.

use super::queue::{LANES, Turn};
use super::sync::{Condvar, Mutex};
use std::collections::BTreeSet;

/// Who asks for memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Account {
    /// The data of an input of this lane.
    Input(usize),
    /// A factorisation.
    Factor,
}

/// How many accounts there are.
const ACCOUNTS: usize = LANES + 1;

impl Account {
    fn index(self) -> usize {
        match self {
            Self::Input(lane) => lane.min(LANES - 1),
            Self::Factor => LANES,
        }
    }
}

/// Memory that may be taken.
#[derive(Debug)]
pub struct Budget {
    limit: u64,
    state: Mutex<State>,
    given_back: Condvar,
}

#[derive(Debug, Default)]
struct State {
    taken: [u64; ACCOUNTS],
    tickets: u64,
    waiting: [BTreeSet<(Turn, u64)>; ACCOUNTS],
}

impl Budget {
    /// A budget of `limit` bytes.
    pub fn new(limit: u64) -> Self {
        Self { limit, state: Mutex::default(), given_back: Condvar::new() }
    }

    /// Takes `bytes` if they are there and nobody waits for them.
    ///
    /// ```
    /// use planish::conveyor::budget::{Account, Budget};
    ///
    /// let budget = Budget::new(100);
    /// // An empty account gets what it asks for, whatever the limit: what is larger than the budget is done, too.
    /// assert!(budget.try_take(Account::Input(2), 500));
    /// assert!(!budget.try_take(Account::Input(2), 1));
    /// assert!(budget.try_take(Account::Factor, 50));
    /// budget.give_back(Account::Input(2), 500);
    /// assert!(budget.try_take(Account::Factor, 50));
    /// assert!(!budget.try_take(Account::Factor, 1));
    /// ```
    pub fn try_take(&self, account: Account, bytes: u64) -> bool {
        let mut state = self.state.lock();
        let granted = state.waiting[account.index()].is_empty() && self.fits(&state, account, bytes);
        if granted {
            state.taken[account.index()] += bytes;
        }
        granted
    }

    /// Takes `bytes` whether they are there or not: for what is cancelled, and will give them back at once.
    pub fn overdraw(&self, account: Account, bytes: u64) {
        self.state.lock().taken[account.index()] += bytes;
    }

    /// Waits until `bytes` are there, and takes them.
    pub fn take(&self, account: Account, bytes: u64, turn: Turn) {
        let mut state = self.state.lock();
        // The ticket tells requests of the same turn apart, in the order in which they came.
        state.tickets += 1;
        let me = (turn, state.tickets);
        state.waiting[account.index()].insert(me);
        while state.waiting[account.index()].first() != Some(&me) || !self.fits(&state, account, bytes) {
            self.given_back.wait(&mut state);
        }
        state.waiting[account.index()].remove(&me);
        state.taken[account.index()] += bytes;
        // Whoever is first of the account now may fit, too.
        self.given_back.notify_all();
    }

    /// Gives `bytes` back.
    pub fn give_back(&self, account: Account, bytes: u64) {
        self.state.lock().taken[account.index()] -= bytes;
        self.given_back.notify_all();
    }

    fn fits(&self, state: &State, account: Account, bytes: u64) -> bool {
        // An empty account gets whatever it asks for: so nobody waits for ever.
        if state.taken[account.index()] == 0 {
            return true;
        }
        // Sizes may be made up, as those of sparse files are.
        let taken = state.taken.iter().fold(bytes, |sum, taken| sum.saturating_add(*taken));
        taken <= self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn no_more_is_taken_than_the_limit_unless_alone() {
        let (budget, taken) = (Budget::new(100), AtomicU64::new(0));
        std::thread::scope(|s| {
            for (turn, bytes) in [30, 60, 20, 90, 40, 10, 500].into_iter().enumerate() {
                let (budget, taken) = (&budget, &taken);
                s.spawn(move || {
                    for _ in 0..100 {
                        budget.take(Account::Factor, bytes, turn as u64);
                        let together = taken.fetch_add(bytes, Ordering::SeqCst) + bytes;
                        assert!(together <= 100 || together == bytes, "{together}");
                        taken.fetch_sub(bytes, Ordering::SeqCst);
                        budget.give_back(Account::Factor, bytes);
                    }
                });
            }
        });
        assert_eq!(budget.state.lock().taken, [0; ACCOUNTS]);
    }

    #[test]
    fn a_factorisation_is_granted_beside_inputs_that_hold_all() {
        let budget = Budget::new(100);
        budget.take(Account::Input(0), 400, 0);
        assert!(!budget.try_take(Account::Input(0), 1));
        assert!(budget.try_take(Account::Factor, 50) && !budget.try_take(Account::Factor, 50));
        budget.give_back(Account::Input(0), 400);
        assert!(budget.try_take(Account::Factor, 50));
    }

    #[test]
    fn small_inputs_are_read_beside_a_large_one_that_holds_all() {
        let budget = Budget::new(100);
        budget.take(Account::Input(2), 400, 0);
        assert!(!budget.try_take(Account::Input(2), 1));
        assert!(budget.try_take(Account::Input(0), 60) && !budget.try_take(Account::Input(0), 1));
    }

    #[test]
    fn an_input_that_claims_all_memory_there_is_does_no_harm() {
        let budget = Budget::new(100);
        budget.take(Account::Factor, 50, 0);
        budget.take(Account::Input(0), u64::MAX, 0);
        assert!(!budget.try_take(Account::Factor, 50) && !budget.try_take(Account::Input(0), 1));
        budget.give_back(Account::Input(0), u64::MAX);
        assert!(budget.try_take(Account::Factor, 50));
    }
}
