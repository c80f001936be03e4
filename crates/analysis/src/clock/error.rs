//! Owns the reasons for which a camera has no clock from trigger marks or from event rates.

use serde::{Deserialize, Serialize};

/// Why no line goes through pairs of simultaneous times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum LineError {
    /// Too few pairs, or too few that agree.
    #[error("expected at least 3 times seen on both clocks, found {found}")]
    FewPairs {
        /// Pairs.
        found: usize,
    },
    /// Only one time, to working precision.
    #[error("expected times apart, found the same time in all pairs")]
    NoSpread,
}

/// Why the trigger marks give a camera no clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum MarksError {
    /// The rig does not name the camera input for marks.
    #[error("the rig has no trigger channel")]
    NoChannel,
    /// The camera's trigger input shows no complete mark.
    #[error("the trigger input shows no mark")]
    NoneSeen,
    /// The marks that were sent and seen determine no line.
    #[error("{line}")]
    Line {
        /// Why not.
        line: LineError,
    },
    /// The line is not that of a clock.
    #[error("expected a drift of at most {most_ppm:.0} ppm, found {drift_ppm:.0} ppm")]
    Drift {
        /// Drift of the line, ppm.
        drift_ppm: f64,
        /// Maximum of a clock, ppm.
        most_ppm: f64,
    },
    /// The camera times come from a broken time base.
    #[error(
        "expected camera times below 2^62 µs, found a mark at {t_us} µs: the time base of the stream is broken"
    )]
    BrokenTimeBase {
        /// Time of the mark, µs.
        t_us: u64,
    },
}

impl From<LineError> for MarksError {
    fn from(line: LineError) -> Self {
        Self::Line { line }
    }
}

/// Why the presses in the event rates of a camera give no clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RatesError {
    /// The session has fewer presses than a rhythm needs.
    #[error(
        "expected at least 4 presses with known times to align the clock by event rates, found {found}"
    )]
    FewPresses {
        /// Presses with known times.
        found: usize,
    },
    /// The presses are out of order, or their span is too long to search.
    #[error(
        "expected the presses in time order within two days, found {span_s:.0} s between the first and the last"
    )]
    Span {
        /// From the first contact to the last release, s; negative if out of order.
        span_s: f64,
    },
    /// The camera times come from a broken time base.
    #[error(
        "expected camera times below 2^62 µs, found events at {start_us} µs: the time base of the stream is broken"
    )]
    BrokenTimeBase {
        /// Start of the event rates, µs.
        start_us: u64,
    },
    /// Busy and idle times have about the same event rate.
    #[error(
        "expected presses to stand out in the event rates, found hardly any difference between \
         busy and idle times; was the camera running and the crop right?"
    )]
    Flat,
    /// The refinement found too few presses for a line.
    #[error(
        "expected at least 3 presses, at different times, to be visible in the event rates and to agree on the clock, found {found}"
    )]
    FewVisible {
        /// Presses found.
        found: usize,
    },
    /// Too many bursts of events to consider all shifts.
    #[error(
        "expected at most {most} comparisons of a burst with a press, found {bursts} bursts and {presses} presses: is the \
         recording mostly noise?"
    )]
    TooManyBursts {
        /// Maximum number of comparisons.
        most: u64,
        /// Bursts found.
        bursts: usize,
        /// Presses, or the bursts of the other camera.
        presses: usize,
    },
    /// The event rates have no bursts.
    #[error("expected bursts in the event rates, found none")]
    NoBursts,
}
