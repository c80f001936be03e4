//! What an emulated camera counts.

use serde::{Deserialize, Serialize};

/// What a camera has counted since it was plugged in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counters {
    /// Bytes made.
    pub made_bytes: u64,
    /// Bytes that found no place, because the host did not fetch those before.
    pub dropped_bytes: u64,
    /// Trigger edges sent.
    pub trigger_words: u64,
    /// Trigger edges that became known only after their place in the stream, and were sent late.
    pub late_edges: u64,
    /// Requests for registers that do not exist.
    pub unknown_registers: u64,
    /// Requests that a camera refuses or that no driver may send (flash, boot loader).
    pub refused_requests: u64,
    /// Times that the time base was started.
    pub starts: u64,
}
