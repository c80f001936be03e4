//! Touches felt while a session is recorded.

use serde::{Deserialize, Serialize};
use skinrig_settings::Choice;

use crate::id::AttemptId;
use crate::time::HostTime;

/// What was felt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum TouchKind {
    /// Touches are felt from now on.
    Started,
    /// A touch began.
    Onset,
    /// Where it is by now.
    Position,
    /// It was none.
    Withdrawn,
    /// It ended.
    Release,
    /// Bytes were skipped because the estimator could not keep up; it starts again on an idle skin.
    Skipped,
    /// The press braked on its way down: `t` is the time at which the robot had accepted to.
    Stopped,
    /// The press ended its hold: `t` is the time at which the robot had accepted the new set point.
    Lifted,
}

impl TouchKind {
    /// All kinds.
    pub const ALL: &[Self] = <Self as Choice>::ALL;

    /// The name used in sessions: `onset`.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.word()
    }
}

/// A 95 % region of a position: an ellipse about it that holds at every instant of the touch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TouchRegion {
    /// Semi-axes, mm, the longer first; positive.
    pub semi_axes_mm: [f64; 2],
    /// Direction of the longer one, degrees from the x axis, counter-clockwise.
    pub angle_deg: f64,
}

/// A depth that a touch has reached, with the 95 % interval that holds at every instant of the touch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TouchDepth {
    /// mm; at least 0.
    pub mm: f64,
    /// The interval reaches so far to both sides, mm; positive.
    pub within_mm: f64,
}

/// An estimate made while the session was recorded, or the reaction of a press to it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TouchEstimate {
    /// Time at which the run had it.
    pub t: HostTime,
    /// Events up to this time are in it, by the clock fits of the estimator.
    pub until: HostTime,
    /// Standard deviation of `until` by those fits, ns.
    pub until_sd_ns: i64,
    /// What was felt.
    pub kind: TouchKind,
    /// Attempt under way at `t`; `None` between presses.
    pub attempt: Option<AttemptId>,
    /// Position, mm; of an onset, the most likely place learnt; `None` without one.
    pub at_mm: Option<[f64; 2]>,
    /// Its region; `None` if the calibration presses do not determine it.
    pub region: Option<TouchRegion>,
    /// Depth that the touch has reached; `None` if the calibration presses do not determine it.
    pub depth: Option<TouchDepth>,
    /// Log likelihood ratio of an onset against the background, nats.
    pub llr: Option<f64>,
}

/// What a press does when a touch is felt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum Reaction {
    /// Brakes and holds where it comes to rest, instead of going on to its depth.
    #[default]
    Stop,
    /// Ends its hold; at a stated depth also the way down.
    Lift,
}

/// Least number of calibration presses of which an online estimator learns 95 % regions,
pub const LEAST_PRESSES_OF_REGIONS: usize = 24;
/// and depths with their 95 % intervals.
pub const LEAST_PRESSES_OF_DEPTHS: usize = 19;

impl Reaction {
    /// What a press does, as a verb.
    #[must_use]
    pub const fn verb(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Lift => "lift",
        }
    }

    /// Its record.
    #[must_use]
    pub const fn kind(self) -> TouchKind {
        match self {
            Self::Stop => TouchKind::Stopped,
            Self::Lift => TouchKind::Lifted,
        }
    }
}
