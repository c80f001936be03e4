//! Limits how many emulated benches run at once, so that none starves another.

use std::sync::{Condvar, Mutex, PoisonError};

/// Each bench takes about half a processor; thousands of presses were recorded with two at once (docs/reference/runs.md).
const AT_ONCE: usize = 2;

static RUNNING: Mutex<usize> = Mutex::new(0);
static ENDED: Condvar = Condvar::new();

/// Permission to run one bench; dropping it returns the permission.
pub(crate) struct Slot(());

impl Slot {
    /// Waits until fewer than [`AT_ONCE`] benches run.
    pub(crate) fn wait() -> Self {
        let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        let full = |running: &mut usize| *running >= AT_ONCE;
        let mut running = ENDED
            .wait_while(running, full)
            .unwrap_or_else(PoisonError::into_inner);
        *running += 1;
        Self(())
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        *RUNNING.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        ENDED.notify_one();
    }
}
