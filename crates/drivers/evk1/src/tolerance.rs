//! What is let pass although an EVK1 is not expected to do it, and the keys of a rig file that accept it.
//!
//! The public driver only logs a status byte other than 0x40, a reset that fails and a transfer that fails (OpenEB 3.1.2,
//! `psee_libusb_board_command.cpp`). Nobody has seen which of them a healthy camera shows, so each is refused until a rig file
//! accepts it; with everything tolerated all pass once, and are told.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What is accepted of a camera.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Tolerance {
    /// Status bytes of register reads, besides 0x40, with which the value counts.
    pub read_status: Vec<u8>,
    /// A reset on the bus may fail.
    pub failed_reset: bool,
    /// A transfer that fails is a loss; otherwise it ends the stream. A stall, and a device that is gone, end it in any case.
    pub failed_transfers: bool,
    /// Everything above, and registers that read back differently. Each is told as a [`Mismatch`].
    pub everything: bool,
}

/// Something that was tolerated, and what accepts it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mismatch {
    /// Key of the camera in a rig file, with the value that accepts it.
    pub key: String,
    /// What was expected and found.
    pub what: String,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tolerated: {}; `{}` accepts it", self.what, self.key)
    }
}

/// Everything that was tolerated, each once. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct Mismatches(Arc<Mutex<Vec<Mismatch>>>);

impl Mismatches {
    fn lock(&self) -> MutexGuard<'_, Vec<Mismatch>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All of them so far.
    #[must_use]
    pub fn all(&self) -> Vec<Mismatch> {
        self.lock().clone()
    }

    pub(crate) fn add(&self, key: impl Into<String>, what: impl Into<String>) {
        let (key, what) = (key.into(), what.into());
        let mut all = self.lock();
        if !all.iter().any(|m| m.key == key) {
            all.push(Mismatch { key, what });
        }
    }
}
