//! Owns the input of an analysis: plain values and one event source.

use std::collections::HashSet;

use skinrig_model::{
    AnalysisSettings, BoxReport, CameraId, CdEvent, HostTime, PlannedPress, PressId, PressOutcome,
    PressRole, RigGeometry, SentMark, TriggerEdge,
};

use crate::leg::LegStart;

/// A superseded attempt at a press: it counts nowhere, but the skin was pressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EarlierAttempt {
    /// Start of the attempt.
    pub begun: HostTime,
    /// Time at which the tip had cleared the surface; `None` if not measured.
    pub clear: Option<HostTime>,
}

/// Measured descent of the tip to the assumed height of the surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Descent {
    /// Last time before contact at which the tip was above 1, 2, 3, ... times [`Descent::STEP_MM`]: later means lower.
    /// Covers only the measured range.
    pub last_above: Vec<HostTime>,
}

impl Descent {
    /// Spacing of the heights, mm.
    pub const STEP_MM: f64 = 0.1;
    /// Maximum number of steps above the surface.
    pub const STEPS: usize = 20;

    /// Height above the surface at `t`, mm, linearly interpolated; constant before the first measured height, 0 from
    /// `contact` on.
    #[must_use]
    pub fn height_mm(&self, contact: HostTime, t: HostTime) -> f64 {
        let mut below = (contact, 0.0);
        for (k, above) in self.last_above.iter().enumerate() {
            let above = (*above, (k + 1) as f64 * Self::STEP_MM);
            if t >= above.0 {
                let share = (below.0 - t).as_secs_f64() / (below.0 - above.0).as_secs_f64();
                // At equal times both heights are correct.
                let share = if share.is_finite() { share } else { 0.0 };
                return below.1 + share.clamp(0.0, 1.0) * (above.1 - below.1);
            }
            below = above;
        }
        below.1
    }
}

/// All input except the events.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionInput {
    /// Every planned press, in plan order.
    pub planned: Vec<PlannedPress>,
    /// Last outcome of each planned press, in the same order; `None` if never attempted.
    pub outcomes: Vec<Option<PressOutcome>>,
    /// All superseded attempts, in any order.
    pub earlier: Vec<EarlierAttempt>,
    /// Presses that stopped above their planned depth because they were felt: their outcomes hold what was reached.
    pub stopped: Vec<PressId>,
    /// Trigger edges of each camera, in stream order, all channels.
    pub edges: [Vec<TriggerEdge>; 2],
    /// Marks that the trigger box sent.
    pub marks: Vec<SentMark>,
    /// Reports of the trigger box on its own clock, in order; empty without a box.
    pub box_reports: Vec<BoxReport>,
    /// Camera-time intervals `(from_us, to_us)` in which bytes of that camera were lost.
    pub gaps: [Vec<(u64, u64)>; 2],
    /// Camera-time intervals `(from_us, to_us)` in which each camera was recording, leg by leg: from the first time of its
    /// stream to the last. Empty if unknown: the camera then counts as always recording.
    pub recorded: [Vec<(u64, u64)>; 2],
    /// RMS interval between the two pose samples around a contact, µs; `None` if unknown.
    pub pose_interval_us: Option<f64>,
    /// RMS standard error of the instant at which the measured pose crossed the surface, µs; `None` if unknown.
    pub crossing_se_us: Option<f64>,
    /// Descent before each contact, in plan order; `None` if the surface was detected by touch, or poses were not measured
    /// or read. May be shorter than the plan: missing entries are `None`.
    pub descents: Vec<Option<Descent>>,
    /// Mean force during the hold, N, in plan order; `None` if the robot reports none. May be shorter than the plan: missing
    /// entries are `None`.
    pub hold_forces_n: Vec<Option<f64>>,
    /// Start of further legs, in order; empty for a session with a single leg.
    pub legs: Vec<LegStart>,
    /// The rig.
    pub rig: RigGeometry,
    /// The settings.
    pub settings: AnalysisSettings,
    /// The settings of the recording, if these are others: the audit judges by them.
    pub recorded_settings: Option<AnalysisSettings>,
}

impl SessionInput {
    /// Planned depths, mm, that not every scored press reached, because some stopped when they were felt. The others are no sample of
    /// that depth: they were the ones hard to feel.
    pub(crate) fn unreached_depths_mm(&self) -> Vec<f64> {
        let stopped: HashSet<PressId> = self.stopped.iter().copied().collect();
        let scored = self.planned.iter().filter(|p| p.role == PressRole::Score);
        scored
            .filter(|p| stopped.contains(&p.id))
            .map(|p| p.depth_mm)
            .collect()
    }
}

/// Why a source could not deliver all events: the source's own error.
pub type EventSourceError = Box<dyn std::error::Error + Send + Sync>;

/// Source of events. One pass per camera and call; memory stays bounded.
pub trait EventSource: Sync {
    /// Calls `each` with consecutive slices of all CD events of the camera in stream order, once.
    ///
    /// # Errors
    /// When the stream cannot be read to the end.
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), EventSourceError>;
}
