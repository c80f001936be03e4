//! The plan: a flat list of small typed steps, each with limits and a deadline, as pure data.
//!
//! A plan is compiled from a protocol before any device is opened. It holds everything the controller
//! needs, already computed: seeds are resolved, orders shuffled, positions absolute.

use serde::{Deserialize, Serialize};
use skinrig_model::{
    HostDuration, MarkKind, PlannedPress, Point2, Point3, PressId, RepetitionId, Skin, as_index,
};

use skinrig_settings::Choice;

use crate::area::Surroundings;
use crate::online::{Online, React};
use crate::retakes::Retakes;
use crate::stop::Stop;
use crate::surface::Surface;
use crate::surface_check::SurfaceCheck;
use crate::suspend::Suspend;

/// Everything a run does, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Version of this layout.
    pub version: u32,
    /// Name of the protocol, for display.
    pub name: String,
    /// Seed of everything random in the run.
    pub seed: u64,
    /// Limits that hold for the whole run.
    pub limits: RunLimits,
    /// Outline of the skin and keep-outs; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surroundings: Option<Surroundings>,
    /// Limits on retakes of a press. Omitted if default.
    #[serde(default, skip_serializing_if = "Retakes::is_default")]
    pub retakes: Retakes,
    /// Number of consecutive invalid presses that ends the run; 0: no limit. Omitted if default.
    #[serde(
        default = "default_invalid_in_a_row",
        skip_serializing_if = "is_default_invalid_in_a_row"
    )]
    pub max_consecutive_invalid: u32,
    /// Where the surface is touched before the first press; `None`: nowhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface_check: Option<SurfaceCheck>,
    /// Conditions that suspend the run. Omitted if there are none.
    #[serde(default, skip_serializing_if = "Suspend::is_default")]
    pub suspend: Suspend,
    /// When the campaign ends by itself; `None`: never before its last step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop: Option<Stop>,
    /// How touches are felt while the session is recorded; `None`: not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub online: Option<Online>,
    /// Every planned press; `presses[i].id == PressId::from_index(i)`, and the stored `id` is `i`.
    pub presses: Vec<PlannedPress>,
    /// The steps, in order.
    pub steps: Vec<Step>,
}

const fn default_invalid_in_a_row() -> u32 {
    5
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives a reference")]
const fn is_default_invalid_in_a_row(n: &u32) -> bool {
    *n == default_invalid_in_a_row()
}

/// Limits that hold for the whole run, skin frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RunLimits {
    /// Lowest allowed coordinates, mm.
    pub workspace_min_mm: [f64; 3],
    /// Highest allowed coordinates, mm.
    pub workspace_max_mm: [f64; 3],
    /// Height above the surface at which lateral motion is allowed, mm.
    pub clearance_mm: f64,
    /// Deepest allowed indentation, mm, positive.
    pub max_depth_mm: f64,
    /// Fastest allowed motion, mm/s.
    pub max_speed_mm_s: f64,
    /// A measured force above this ends the run, N.
    pub max_force_n: f64,
    /// How close to its target a settled pose must be, mm.
    pub position_tolerance_mm: f64,
    /// How long the pose must stay within the tolerance to count as settled.
    pub settle_time: HostDuration,
    /// Largest acceleration of the set point, mm/s²; the robot's own when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_acceleration_mm_s2: Option<f64>,
    /// Reaction of the robot to an exceeded limit.
    #[serde(default, skip_serializing_if = "TripReaction::is_retract")]
    pub on_trip: TripReaction,
}

/// Reaction of the robot to an exceeded limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum TripReaction {
    /// Hold, rise straight up off the skin, disarm; brake immediately if the feedback is unreliable.
    #[default]
    Retract,
    /// Brake immediately, wherever the tip is.
    Brake,
}

impl TripReaction {
    /// True for the default.
    #[must_use]
    pub(crate) const fn is_retract(&self) -> bool {
        matches!(self, Self::Retract)
    }
}

/// One step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "step", rename_all = "snake_case")]
pub enum Step {
    /// A repetition begins; its press periods count from this instant. The sync presses, if
    /// any, have their own block with `repetition: None`.
    Begin {
        /// Which repetition; `None` for the sync block.
        #[serde(default, with = "as_index::option")]
        repetition: Option<RepetitionId>,
    },
    /// Straight motion at clearance height or above.
    Travel {
        /// Where to, skin frame, mm.
        to: Point3<Skin>,
        /// mm/s.
        speed_mm_s: f64,
        /// Longest time the motion may take, settling included.
        deadline: HostDuration,
    },
    /// One press, from clearance height and back to it.
    Press(PressStep),
    /// Wait in place.
    Pause {
        /// How long.
        duration: HostDuration,
    },
    /// A look at the data so far, for the rule of [`Plan::stop`]. The run does not wait for it.
    Look {
        /// Number of the look, from 1.
        number: u32,
        /// The repetition that ended.
        #[serde(with = "as_index")]
        repetition: RepetitionId,
    },
    /// Learn to feel touches from the presses so far, for [`Plan::online`]. On a bench the run does not wait for it.
    Learn,
}

/// One press, from clearance height above `at` and back to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PressStep {
    /// Which planned press.
    #[serde(with = "as_index")]
    pub press: PressId,
    /// Where, skin frame.
    pub at: Point2,
    /// How deep below the surface, mm, positive.
    pub depth_mm: f64,
    /// Source of the surface height.
    #[serde(default, skip_serializing_if = "Surface::is_known")]
    pub surface: Surface,
    /// The downward motion begins this long after the last `Begin`; immediately if that is past or `None`.
    pub start_after_begin: Option<HostDuration>,
    /// Speed from clearance height to the surface, mm/s.
    pub approach_speed_mm_s: f64,
    /// Speed from the surface to depth, mm/s.
    pub indent_speed_mm_s: f64,
    /// Time at depth after settling.
    pub hold: HostDuration,
    /// Speed from depth to clearance height, mm/s.
    pub retract_speed_mm_s: f64,
    /// What it does when it is felt; `None`: it goes on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub react: Option<React>,
    /// Moments that emit a mark on the trigger line.
    pub marks: Vec<MarkKind>,
    /// Longest time from the start of the downward motion to settled at clearance height.
    pub deadline: HostDuration,
}
