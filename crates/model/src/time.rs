//! Time on the rig's own clock, and spans of it.
//!
//! A session has three kinds of clocks, which are never mixed: the *host* clock of the rig (this
//! module, integer nanoseconds since the session's start), each *camera* clock (integer microseconds,
//! `u64`, unrelated origin, drifting), and the civil clock (text in the session header, for display only).

use std::fmt;
use std::ops::{Add, AddAssign, Sub};

use serde::{Deserialize, Serialize};

/// An instant on the rig's host clock: nanoseconds since the session began.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct HostTime(pub i64);

/// A span on the host clock in nanoseconds; may be negative.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct HostDuration(pub i64);

impl HostTime {
    /// The session's start.
    pub const ZERO: Self = Self(0);

    /// Seconds since the session's start.
    #[must_use]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// The instant `seconds` after the session's start, rounded to the nearest nanosecond.
    #[must_use]
    pub fn from_secs_f64(seconds: f64) -> Self {
        Self((seconds * 1e9).round() as i64)
    }
}

impl HostDuration {
    /// Zero.
    pub const ZERO: Self = Self(0);

    /// A span of whole milliseconds.
    #[must_use]
    pub const fn from_millis(ms: i64) -> Self {
        Self(ms * 1_000_000)
    }

    /// A span of whole microseconds.
    #[must_use]
    pub const fn from_micros(us: i64) -> Self {
        Self(us * 1_000)
    }

    /// A span of `seconds`, rounded to the nearest nanosecond.
    #[must_use]
    pub fn from_secs_f64(seconds: f64) -> Self {
        Self((seconds * 1e9).round() as i64)
    }

    /// The span in seconds.
    #[must_use]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 * 1e-9
    }
}

impl Add<HostDuration> for HostTime {
    type Output = Self;
    fn add(self, d: HostDuration) -> Self {
        Self(self.0 + d.0)
    }
}

impl AddAssign<HostDuration> for HostTime {
    fn add_assign(&mut self, d: HostDuration) {
        self.0 += d.0;
    }
}

impl Sub<HostDuration> for HostTime {
    type Output = Self;
    fn sub(self, d: HostDuration) -> Self {
        Self(self.0 - d.0)
    }
}

impl Sub for HostTime {
    type Output = HostDuration;
    fn sub(self, earlier: Self) -> HostDuration {
        HostDuration(self.0 - earlier.0)
    }
}

impl Add for HostDuration {
    type Output = Self;
    fn add(self, d: Self) -> Self {
        Self(self.0 + d.0)
    }
}

impl fmt::Display for HostTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.6} s", self.as_secs_f64())
    }
}

impl fmt::Display for HostDuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.6} s", self.as_secs_f64())
    }
}
