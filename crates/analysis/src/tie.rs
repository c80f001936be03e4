//! Ties between clocks, and presses that no tie is near enough to time.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Kind of observation that ties two clocks at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tie {
    /// A time request from the host to the trigger box.
    Exchange,
    /// A reported train that a camera saw.
    Train,
    /// A mark sent by the host that a camera saw.
    Mark,
}

/// A press too far from the ties of a clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UntimedPress {
    /// Kind of tie.
    pub tie: Tie,
    /// Distance of the nearest tie from the contact or the release, µs.
    pub distance_us: f64,
    /// Maximum distance, µs.
    pub limit_us: f64,
}

impl fmt::Display for UntimedPress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.tie {
            Tie::Exchange => "time exchange with the trigger box",
            Tie::Train => "train seen",
            Tie::Mark => "mark seen",
        };
        write!(
            f,
            "the nearest {what} is {:.1} s away, expected at most {} s",
            self.distance_us * 1e-6,
            self.limit_us * 1e-6
        )
    }
}
