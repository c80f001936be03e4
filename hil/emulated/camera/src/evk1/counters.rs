//! Counters of an emulated camera.

use serde::{Deserialize, Serialize};

/// Counts since the camera was plugged in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counters {
    /// Bytes generated.
    pub made_bytes: u64,
    /// Bytes lost because the host did not fetch earlier ones in time.
    pub dropped_bytes: u64,
    /// Trigger edges sent.
    pub trigger_words: u64,
    /// Trigger edges that arrived after their place in the stream and were sent late.
    pub late_edges: u64,
    /// Requests for registers that do not exist.
    pub unknown_registers: u64,
    /// Requests that a camera rejects or that a driver must never send (flash, boot loader).
    pub refused_requests: u64,
    /// Starts of the time base.
    pub starts: u64,
}
