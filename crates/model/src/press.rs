//! Presses: planned, attempted and judged.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::frame::Point2;
use crate::id::{AttemptId, LocationId, PressId, RepetitionId, as_index};
use crate::press_fault::PressFaultKind;
use crate::reason::{ExcludedReason, InvalidReason, MissedReason, ReasonRef};
use crate::time::{HostDuration, HostTime};

/// Role of a press. Calibration presses never score.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PressRole {
    /// Marks the start, so that camera clocks can be aligned without triggers.
    Sync,
    /// Its ground truth may be used to fit the camera geometry.
    Calibrate,
    /// Its ground truth is used only for scoring.
    Score,
}

impl PressRole {
    /// `sync`, `calibrate` or `score`, as stored and shown.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sync => "sync",
            Self::Calibrate => "calibrate",
            Self::Score => "score",
        }
    }
}

/// One press of the plan. Stored plans contain its three numbers as indices, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlannedPress {
    /// Position in the plan.
    #[serde(with = "as_index")]
    pub id: PressId,
    /// Role of the press.
    pub role: PressRole,
    /// Repetition; the first for sync presses.
    #[serde(with = "as_index")]
    pub repetition: RepetitionId,
    /// Location of the path; the first for sync presses.
    #[serde(with = "as_index")]
    pub location: LocationId,
    /// Position, skin frame.
    pub at: Point2,
    /// Depth below the touched surface, mm, positive.
    pub depth_mm: f64,
}

/// The measured moments of one press on the host clock, from the pose stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PressTiming {
    /// The downward motion began.
    pub approach: HostTime,
    /// The tip reached the surface on its way down.
    pub contact: HostTime,
    /// The tip settled at its depth.
    pub at_depth: HostTime,
    /// The upward motion began.
    pub retract: HostTime,
    /// The tip left the surface on its way up.
    pub release: HostTime,
    /// The tip settled at the clearance height.
    pub clear: HostTime,
}

impl PressTiming {
    /// The same moments, each `delay` later.
    #[must_use]
    pub fn after(self, delay: HostDuration) -> Self {
        Self {
            approach: self.approach + delay,
            contact: self.contact + delay,
            at_depth: self.at_depth + delay,
            retract: self.retract + delay,
            release: self.release + delay,
            clear: self.clear + delay,
        }
    }
}

/// Verdict on a press, without its reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Done as planned, with all its data recorded.
    Valid,
    /// Never attempted.
    Missed,
    /// Attempted, but it deviated from the plan, or data were lost in its window.
    Invalid,
    /// Done, but excluded from the metrics by a stated rule.
    Excluded,
}

impl Verdict {
    /// `valid`, `missed`, `invalid` or `excluded`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Valid => "valid",
            Self::Missed => "missed",
            Self::Invalid => "invalid",
            Self::Excluded => "excluded",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Verdict on a press. Planned = valid + missed + invalid + excluded, always.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verdict", content = "reason", rename_all = "snake_case")]
pub enum PressVerdict {
    /// Done as planned, with all its data recorded.
    Valid,
    /// Never attempted (the run stopped before it).
    Missed(MissedReason),
    /// Attempted, but it deviated from the plan, or data were lost in its window.
    Invalid(InvalidReason),
    /// Done, but excluded from the metrics by a stated rule.
    Excluded(ExcludedReason),
}

impl PressVerdict {
    /// The verdict's name: `valid`, `missed`, `invalid`, `excluded`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.kind().name()
    }

    /// The verdict without its reason.
    #[must_use]
    pub const fn kind(&self) -> Verdict {
        match self {
            Self::Valid => Verdict::Valid,
            Self::Missed(_) => Verdict::Missed,
            Self::Invalid(_) => Verdict::Invalid,
            Self::Excluded(_) => Verdict::Excluded,
        }
    }

    /// True for a press that was never attempted because the question of the campaign was decided before.
    #[must_use]
    pub fn is_unneeded(&self) -> bool {
        match self {
            Self::Missed(MissedReason::RunEnded(end)) => end.decision().is_some(),
            _ => false,
        }
    }

    /// Verdict on an attempt in leg `leg` of a session that has no recorded outcome: whether the robot
    /// pressed is unknown.
    #[must_use]
    pub const fn cut_off(leg: u32) -> Self {
        Self::Invalid(InvalidReason::LegEnded { leg })
    }

    /// True for an attempt that did not finish; the state of its press is unknown.
    #[must_use]
    pub fn is_cut_off(&self) -> bool {
        matches!(self, Self::Invalid(reason) if reason.is_cut_off())
    }

    /// Kinds of the faults of an invalid attempt, in order; empty for other verdicts and for attempts recorded before schema 8.
    #[must_use]
    pub fn fault_kinds(&self) -> Vec<PressFaultKind> {
        match self {
            Self::Invalid(reason) => reason.kinds(),
            Self::Valid | Self::Missed(_) | Self::Excluded(_) => Vec::new(),
        }
    }

    /// The reason, for JSON; `None` if valid.
    #[must_use]
    pub const fn cause(&self) -> Option<ReasonRef<'_>> {
        match self {
            Self::Valid => None,
            Self::Missed(reason) => Some(ReasonRef::Missed(reason)),
            Self::Invalid(reason) => Some(ReasonRef::Invalid(reason)),
            Self::Excluded(reason) => Some(ReasonRef::Excluded(reason)),
        }
    }

    /// Text of the reason, of any verdict but `Valid`.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        match self {
            Self::Valid => None,
            Self::Missed(reason) => Some(reason.to_string()),
            Self::Invalid(reason) => Some(reason.to_string()),
            Self::Excluded(reason) => Some(reason.to_string()),
        }
    }
}

/// History of one planned press: the starting point of a resumed run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PressHistory {
    /// Attempts so far; 0: none.
    pub attempts: u32,
    /// Number of attempts that count against the limit of retakes. Attempts with only transient faults
    /// (see [`PressFaultKind::is_of_the_place`]), caused by the rig or the operator, do not count.
    pub spent: u32,
    /// Verdict on the last attempt; `None` without attempts, or if it was cut off.
    pub verdict: Option<PressVerdict>,
    /// True if the last attempt has only transient faults, caused by the rig or the operator.
    pub given_back: bool,
    /// True if the plan was completed since: only presses with `given_back` are then retaken.
    pub plan_done: bool,
}

/// The measured result of one attempt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PressOutcome {
    /// The attempt.
    pub attempt: AttemptId,
    /// Verdict on the attempt.
    pub verdict: PressVerdict,
    /// Phase times; `None` if the attempt ended before they were known.
    pub timing: Option<PressTiming>,
    /// The mean measured tip position during the hold, skin frame: the ground truth of localisation.
    pub measured_at: Option<Point2>,
    /// The mean measured depth during the hold below the surface, touched or known, mm, positive.
    pub measured_depth_mm: Option<f64>,
    /// Height of the touched surface, skin frame, mm; `None` if it was not searched or not found.
    pub touched_mm: Option<f64>,
    /// Largest measured force, N, if the device reports forces.
    pub peak_force_n: Option<f64>,
    /// True if timing and position come from a schedule (an imported dataset without a pose stream),
    /// false if they were measured.
    pub scheduled: bool,
}
