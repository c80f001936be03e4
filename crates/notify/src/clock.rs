//! Time for the notifier: injected, so that tests need no real waits.

use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Waits and civil time.
pub trait Clock: Send + Sync {
    /// Civil time, RFC 3339.
    fn civil_time(&self) -> String;

    /// Waits before the next try.
    fn back_off(&self, wait: Duration) {
        std::thread::sleep(wait);
    }

    /// Waits until no message is pending, at most for `grace`.
    fn wait(&self, pending: &Pending, grace: Duration) {
        pending.wait_for(grace);
    }
}

/// The number of messages without a result.
#[derive(Debug, Default)]
pub struct Pending {
    count: Mutex<usize>,
    changed: Condvar,
}

impl Pending {
    pub(crate) fn add(&self) {
        *self.count.lock().unwrap_or_else(PoisonError::into_inner) += 1;
    }

    pub(crate) fn remove(&self) {
        *self.count.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        self.changed.notify_all();
    }

    /// Waits until none is pending, at most for `limit`.
    pub fn wait_for(&self, limit: Duration) {
        let count = self.count.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.changed.wait_timeout_while(count, limit, |n| *n > 0);
        drop(waited.unwrap_or_else(PoisonError::into_inner));
    }
}
