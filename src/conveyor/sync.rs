//! The locks of the semaphore and the budget. `tests/bench/schedules` has others of the same form in their place, so that it
//! can run these files under every order of threads that it likes.

pub use parking_lot::{Condvar, Mutex, MutexGuard};
