//! The side of the job: places and memory are those of the parent.

use super::protocol::{Said, Told, say};
use crate::conveyor::budget::Account;
use crate::conveyor::grants::Grants;
use crate::conveyor::queue::Turn;
use parking_lot::{Condvar, Mutex};
use std::collections::BTreeMap;
use std::io::{BufRead, Stdout};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The parent of this process, which does a single job.
pub struct Parent {
    to: Mutex<Stdout>,
    state: Mutex<State>,
    changed: Condvar,
    /// Somebody waits at the parent's who is ahead.
    is_waited_for: AtomicBool,
    /// What is done when the parent is gone.
    orphaned: Box<dyn Fn() + Send + Sync>,
}

#[derive(Default)]
struct State {
    /// Places that are there and not taken yet.
    places: usize,
    /// Threads that wait for one.
    waiting: usize,
    /// Places that were asked for and have not come yet: never more than threads have waited at once.
    asked: usize,
    tickets: u64,
    answers: BTreeMap<u64, bool>,
}

impl Parent {
    /// Listens to the parent from now on. When that is gone, nobody wants the job any more: `orphaned` is called, and the
    /// process ends.
    ///
    /// # Errors
    /// The system has no thread.
    pub fn listen(orphaned: impl Fn() + Send + Sync + 'static) -> std::io::Result<Arc<Self>> {
        let parent = Arc::new(Self {
            to: Mutex::new(std::io::stdout()),
            state: Mutex::default(),
            changed: Condvar::new(),
            is_waited_for: AtomicBool::new(false),
            orphaned: Box::new(orphaned),
        });
        let listener = parent.clone();
        std::thread::Builder::new().name("parent".to_owned()).spawn(move || listener.hear())?;
        Ok(parent)
    }

    fn hear(&self) {
        for line in std::io::stdin().lock().lines() {
            let Ok(told) = line.and_then(|line| Ok(serde_json::from_str(&line)?)) else { break };
            self.take_in(told);
        }
        self.is_gone();
    }

    fn take_in(&self, told: Told) {
        match told {
            Told::Place => self.place(),
            Told::YieldTo => self.is_waited_for.store(true, Ordering::Relaxed),
            Told::Answer { ticket, granted } => {
                self.state.lock().answers.insert(ticket, granted);
                self.changed.notify_all();
            }
        }
    }

    fn place(&self) {
        let mut state = self.state.lock();
        state.asked -= 1;
        if state.waiting > state.places {
            state.places += 1;
            self.changed.notify_all();
        } else {
            // Who waited has got the place of another thread meanwhile.
            drop(state);
            self.say(&Said::Leave);
        }
    }

    /// Says something to the parent.
    pub fn say(&self, said: &Said) {
        if say(&mut *self.to.lock(), said).is_err() {
            self.is_gone();
        }
    }

    fn is_gone(&self) -> ! {
        (self.orphaned)();
        std::process::exit(1);
    }

    /// The answer to a request.
    fn ask(&self, request: impl Fn(u64) -> Said) -> bool {
        let mut state = self.state.lock();
        state.tickets += 1;
        let ticket = state.tickets;
        drop(state);
        self.say(&request(ticket));
        let mut state = self.state.lock();
        loop {
            if let Some(granted) = state.answers.remove(&ticket) {
                return granted;
            }
            self.changed.wait(&mut state);
        }
    }
}

/// There is one job here: turns are compared by the parent.
impl Grants for Parent {
    fn enter(&self, _turn: Turn) {
        let mut state = self.state.lock();
        state.waiting += 1;
        let is_short = state.asked + state.places < state.waiting;
        if is_short {
            state.asked += 1;
            drop(state);
            self.say(&Said::Want);
            state = self.state.lock();
        }
        while state.places == 0 {
            self.changed.wait(&mut state);
        }
        state.places -= 1;
        state.waiting -= 1;
    }

    fn leave(&self) {
        let mut state = self.state.lock();
        let is_free_for_us = !self.is_waited_for.swap(false, Ordering::Relaxed);
        if is_free_for_us && state.waiting > state.places {
            state.places += 1;
            self.changed.notify_all();
        } else {
            drop(state);
            self.say(&Said::Leave);
        }
    }

    fn yield_to(&self, turn: Turn) {
        if self.is_waited_for(turn) {
            self.leave();
            self.enter(turn);
        }
    }

    fn is_waited_for(&self, _turn: Turn) -> bool {
        self.is_waited_for.load(Ordering::Relaxed)
    }

    fn try_take(&self, account: Account, bytes: u64) -> bool {
        account != Account::Factor || self.ask(|ticket| Said::TryTake { ticket, bytes })
    }

    fn take(&self, account: Account, bytes: u64, _turn: Turn) {
        // Memory for the data of the input was taken by the parent.
        if account == Account::Factor {
            self.ask(|ticket| Said::Take { ticket, bytes });
        }
    }

    fn overdraw(&self, _account: Account, _bytes: u64) {
        unreachable!("a job whose parent does not want it any more is killed, not cancelled");
    }

    fn give_back(&self, account: Account, bytes: u64) {
        if account == Account::Factor {
            self.say(&Said::GiveBack { bytes });
        }
    }
}
