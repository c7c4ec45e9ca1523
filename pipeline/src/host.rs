//! What surrounds a computation: whether its result is still wanted, whose turn it is, and how much memory it may take.
//!
//! The core knows no thread and no clock. It asks a [`Host`] at safe points, many times a second, and waits there as long
//! as the host lets it: so a computation can be cancelled, or let others pass. What it computes does not depend on the
//! answers, except that a cancelled computation has no result but [`Cancelled`].
//!
//! Memory is reserved before a sparse system is factorised, which takes more of it than all else together. **A
//! computation holds at most one reservation at a time, and is at no safe point while it holds one**: each is made and
//! given back within one solution of a system ([`crate::sparse`]). So whoever waits for memory waits for computations
//! that wait for nothing, and budgets cannot deadlock.

use std::cell::Cell;

/// What surrounds a computation. It may be asked by many of them at once; one that cancels some but not others is a
/// host for each.
pub trait Host: Sync {
    /// A safe point: whether the result is still wanted. May block for a while, when it is the turn of others. Once the
    /// answer is no it must stay so: a computation that stops early relies on it when it asks once more at its end.
    fn go_on(&self) -> bool;

    /// Waits until `bytes` of memory may be taken. One request may be larger than any budget: then it should be granted
    /// when nothing else is reserved. Where the result is not wanted any more it should be granted at once.
    fn reserve(&self, bytes: u64);

    /// Gives reserved memory back: as much as was reserved, also when a computation fails or panics.
    fn release(&self, bytes: u64);
}

/// Nobody waits, nothing is limited.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alone;

impl Host for Alone {
    fn go_on(&self) -> bool {
        true
    }

    fn reserve(&self, _bytes: u64) {}

    fn release(&self, _bytes: u64) {}
}

/// The result was not wanted any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the computation was cancelled")]
pub struct Cancelled;

/// Reserved memory, given back when this is dropped.
pub struct Reserved<'a> {
    host: &'a dyn Host,
    bytes: u64,
}

impl<'a> Reserved<'a> {
    /// Waits for the memory.
    pub fn new(host: &'a dyn Host, bytes: u64) -> Self {
        host.reserve(bytes);
        Self { host, bytes }
    }
}

impl Drop for Reserved<'_> {
    fn drop(&mut self) {
        self.host.release(self.bytes);
    }
}

/// How much work is done between two questions: so many triangles looked at, which take a few milliseconds.
const WORK: usize = 20_000;

/// A host as the loops of a computation see it: they tell of every bit of work, and it is asked once in a while.
pub(crate) struct Pace<'a> {
    pub host: &'a dyn Host,
    done: Cell<usize>,
    over: Cell<bool>,
}

impl<'a> Pace<'a> {
    pub(crate) fn new(host: &'a dyn Host) -> Self {
        Self { host, done: Cell::new(0), over: Cell::new(false) }
    }

    /// Whether to go on after `work`, in triangles looked at.
    pub(crate) fn goes_on(&self, work: usize) -> bool {
        self.done.set(self.done.get() + work);
        if self.done.get() >= WORK && !self.over.get() {
            self.done.set(0);
            self.over.set(!self.host.go_on());
        }
        !self.over.get()
    }

    /// As [`Self::goes_on`].
    pub(crate) fn after(&self, work: usize) -> Result<(), Cancelled> {
        if self.goes_on(work) { Ok(()) } else { Err(Cancelled) }
    }

    /// Asks at once: before a result is returned.
    pub(crate) fn end(&self) -> Result<(), Cancelled> {
        self.after(WORK)
    }
}
