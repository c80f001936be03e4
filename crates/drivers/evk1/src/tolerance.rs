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

/// A key of a camera in a rig file, with the value that accepts a mismatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Accept {
    /// Register reads may come with this status byte.
    ReadStatus(u8),
    /// A reset on the bus may fail.
    FailedReset,
    /// A transfer that fails is a loss.
    FailedTransfers,
    /// This register may read back differently.
    ReadBack(u32),
}

impl fmt::Display for Accept {
    /// As in a rig file.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReadStatus(status) => write!(f, "read_status: [\"{status:#04x}\"]"),
            Self::FailedReset => write!(f, "failed_reset: accepted"),
            Self::FailedTransfers => write!(f, "failed_transfers: loss"),
            Self::ReadBack(address) => write!(f, "read_back_exceptions: [\"{address:#06x}\"]"),
        }
    }
}

/// Something that was tolerated, and what accepts it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mismatch {
    /// What accepts it.
    pub key: Accept,
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

    pub(crate) fn add(&self, key: Accept, what: impl Into<String>) {
        let what = what.into();
        let mut all = self.lock();
        if !all.iter().any(|m| m.key == key) {
            all.push(Mismatch { key, what });
        }
    }
}
