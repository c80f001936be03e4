//! Accepted deviations of a camera, and the rig file keys that accept them.
//!
//! The public driver only logs a status byte other than 0x40, a failed reset and a failed transfer (OpenEB 3.1.2,
//! `psee_libusb_board_command.cpp`). It is unknown which of these a healthy camera shows, so each is an error until a rig file accepts
//! it. With everything tolerated, each passes and is reported.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Accepted deviations.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Tolerance {
    /// Additional status bytes of valid register reads, besides 0x40.
    pub read_status: Vec<u8>,
    /// Whether a reset on the bus may fail.
    pub failed_reset: bool,
    /// Whether a failed transfer is a loss; otherwise it ends the stream. A stall or disconnection always ends it.
    pub failed_transfers: bool,
    /// Accepts all of the above, and registers that read back differently. Each is reported as a [`Mismatch`].
    pub everything: bool,
}

/// A camera key of the rig file that accepts a mismatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ToleranceKey {
    /// Accepts register reads with this status byte.
    ReadStatus(u8),
    /// Accepts a failed reset on the bus.
    FailedReset,
    /// Counts failed transfers as losses.
    FailedTransfers,
    /// Accepts that this register reads back differently.
    ReadBack(u32),
}

impl fmt::Display for ToleranceKey {
    /// Formats the key as in a rig file.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReadStatus(status) => write!(f, "read_status: [\"{status:#04x}\"]"),
            Self::FailedReset => write!(f, "failed_reset: accepted"),
            Self::FailedTransfers => write!(f, "failed_transfers: loss"),
            Self::ReadBack(address) => write!(f, "read_back_exceptions: [\"{address:#06x}\"]"),
        }
    }
}

/// A tolerated mismatch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mismatch {
    /// The key that accepts it.
    pub key: ToleranceKey,
    /// Expected and found values.
    pub what: String,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tolerated: {}; `{}` accepts it", self.what, self.key)
    }
}

/// All tolerated mismatches without duplicates. Clones share the list.
#[derive(Debug, Clone, Default)]
pub struct Mismatches(Arc<Mutex<Vec<Mismatch>>>);

impl Mismatches {
    fn lock(&self) -> MutexGuard<'_, Vec<Mismatch>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The mismatches so far.
    #[must_use]
    pub fn all(&self) -> Vec<Mismatch> {
        self.lock().clone()
    }

    pub(crate) fn add(&self, key: ToleranceKey, what: impl Into<String>) {
        let what = what.into();
        let mut all = self.lock();
        if !all.iter().any(|m| m.key == key) {
            all.push(Mismatch { key, what });
        }
    }
}
