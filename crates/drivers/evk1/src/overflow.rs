//! The camera's overflow counter while streaming.

use skinrig_model::{HostDuration, HostTime};

/// Last reading of the camera's overflow counter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overflow {
    pub hits: u16,
    pub read_at: HostTime,
    /// Latest camera time at that reading, µs.
    pub good_us: Option<u64>,
}

impl Overflow {
    /// Whether data may have been lost since, given the counter value `hits`. True for a saturated counter.
    pub(crate) const fn lost(self, hits: u16) -> bool {
        hits != self.hits || hits == u16::MAX
    }
}

/// Interval at which the overflow counter is read while streaming. A flush, for example before a verdict, reads it immediately.
pub(crate) const OVERFLOW_PERIOD: HostDuration = HostDuration::from_millis(1_000);
