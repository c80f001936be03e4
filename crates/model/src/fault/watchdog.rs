//! Trips of the watchdog: measured limits that were exceeded.

use serde::{Deserialize, Serialize};

use crate::time::{HostDuration, HostTime};

/// Reason why the watchdog tripped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum WatchdogTrip {
    /// A measured force above the limit.
    #[error("force: expected at most {limit_n} N, found {found_n:.3} N at {t}")]
    Force {
        /// Limit, N.
        limit_n: f64,
        /// Measured force, N.
        #[serde(with = "crate::number")]
        found_n: f64,
        /// Time of the sample.
        t: HostTime,
    },
    /// A measured tip was too deep.
    #[error("depth: expected at most {limit_mm} mm, found {found_mm:.3} mm at {t}")]
    Depth {
        /// Limit, mm, positive, tolerance included.
        limit_mm: f64,
        /// Measured depth, mm, positive.
        #[serde(with = "crate::number")]
        found_mm: f64,
        /// Time of the sample.
        t: HostTime,
    },
    /// The measured tip moved too fast, or its measurement jumped.
    #[error("speed: expected at most {limit_mm_s} mm/s, found {found_mm_s:.1} mm/s at {t}")]
    Speed {
        /// Limit, mm/s.
        limit_mm_s: f64,
        /// Measured speed, mm/s.
        #[serde(with = "crate::number")]
        found_mm_s: f64,
        /// Time of the sample.
        t: HostTime,
    },
    /// A sample is out of order or not finite.
    #[error("pose stream: expected {expected}, found {found}")]
    Feedback {
        /// What is valid in the stream.
        expected: String,
        /// What arrived.
        found: String,
    },
    /// The pose stream has stopped.
    #[error("pose stream: expected a pose sample no older than {limit}, found {found}")]
    Stale {
        /// Longest allowed age.
        limit: HostDuration,
        /// Age of the newest sample.
        found: HostDuration,
    },
    /// Too long between two polls while the tip was low.
    #[error("loop: expected a poll of the robot at least every {limit}, found {found} between two")]
    Late {
        /// Longest allowed time.
        limit: HostDuration,
        /// Time between the two polls.
        found: HostDuration,
    },
}

impl WatchdogTrip {
    /// True if the measured position is unreliable, so that no motion can rely on it.
    #[must_use]
    pub const fn is_blind(&self) -> bool {
        matches!(self, Self::Feedback { .. } | Self::Stale { .. })
    }
}
