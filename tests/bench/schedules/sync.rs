//! Locks that a scheduler of shuttle has in its hands, in the form of those of `parking_lot`.

use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether wake-ups are lost: then something must be found.
pub static LOSES_WAKE_UPS: AtomicBool = AtomicBool::new(false);

/// A lock.
#[derive(Debug, Default)]
pub struct Mutex<T>(shuttle::sync::Mutex<T>);

/// A lock that is held; nothing while its holder waits.
pub struct MutexGuard<'a, T>(Option<shuttle::sync::MutexGuard<'a, T>>);

/// Where threads wait.
#[derive(Debug, Default)]
pub struct Condvar(shuttle::sync::Condvar);

impl<T> Mutex<T> {
    pub fn new(value: T) -> Self {
        Self(shuttle::sync::Mutex::new(value))
    }

    pub fn lock(&self) -> MutexGuard<'_, T> {
        MutexGuard(Some(self.0.lock().expect("nobody panics")))
    }
}

impl<T> Deref for MutexGuard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.0.as_ref().expect("held")
    }
}

impl<T> DerefMut for MutexGuard<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        self.0.as_mut().expect("held")
    }
}

impl Condvar {
    pub fn new() -> Self {
        Self::default()
    }

    pub fn wait<T>(&self, guard: &mut MutexGuard<T>) {
        let held = guard.0.take().expect("held");
        guard.0 = Some(self.0.wait(held).expect("nobody panics"));
    }

    pub fn notify_all(&self) {
        if LOSES_WAKE_UPS.load(Ordering::Relaxed) { self.0.notify_one() } else { self.0.notify_all() }
    }
}
