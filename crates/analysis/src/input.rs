//! What an analysis reads: plain values and one event source.

use skinrig_model::{
    AnalysisSettings, BoxReport, CameraId, CdEvent, HostTime, PlannedPress, PressOutcome,
    RigGeometry, SentMark, TriggerEdge,
};

use crate::leg::LegStart;

/// An attempt at a press that was made again: it counts nowhere, but it pressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EarlierAttempt {
    /// When it was about to begin.
    pub begun: HostTime,
    /// When its tip was clear of the surface again; `None` when that was not measured.
    pub clear: Option<HostTime>,
}

/// The measured way of a tip down to the height at which the surface is taken to be.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Descent {
    /// When the tip was last above 1, 2, 3 and so on times [`Descent::STEP_MM`] before its contact: the later, the lower. As far
    /// up as was measured.
    pub last_above: Vec<HostTime>,
}

impl Descent {
    /// Heights of the way down are so far apart, mm.
    pub const STEP_MM: f64 = 0.1;
    /// It begins so many steps above the surface, at most.
    pub const STEPS: usize = 20;

    /// The height above the surface at `t`, mm, on straight lines between the heights; that of the beginning for what is
    /// earlier, 0 from `contact` on.
    #[must_use]
    pub fn height_mm(&self, contact: HostTime, t: HostTime) -> f64 {
        let mut below = (contact, 0.0);
        for (k, above) in self.last_above.iter().enumerate() {
            let above = (*above, (k + 1) as f64 * Self::STEP_MM);
            if t >= above.0 {
                let share = (below.0 - t).as_secs_f64() / (below.0 - above.0).as_secs_f64();
                // At equal times both heights are right.
                let share = if share.is_finite() { share } else { 0.0 };
                return below.1 + share.clamp(0.0, 1.0) * (above.1 - below.1);
            }
            below = above;
        }
        below.1
    }
}

/// Everything but the events.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionInput {
    /// Every planned press, in plan order.
    pub planned: Vec<PlannedPress>,
    /// The last outcome of each planned press, same order; `None` when it was never attempted.
    pub outcomes: Vec<Option<PressOutcome>>,
    /// All attempts before the last one of their press, in any order.
    pub earlier: Vec<EarlierAttempt>,
    /// Trigger edges of each camera, in stream order, all channels.
    pub edges: [Vec<TriggerEdge>; 2],
    /// The marks that the trigger box sent.
    pub marks: Vec<SentMark>,
    /// What the trigger box reported on its own clock, in order; empty without one.
    pub box_reports: Vec<BoxReport>,
    /// Camera-time intervals `(from_us, to_us)` in which bytes of that camera were lost.
    pub gaps: [Vec<(u64, u64)>; 2],
    /// Camera-time intervals `(from_us, to_us)` in which each camera was recording, leg by leg: from the first time of its stream to
    /// the last. Empty where that is not known: it is then taken to have recorded all along.
    pub recorded: [Vec<(u64, u64)>; 2],
    /// RMS interval between the two pose samples around a contact, µs; `None` when not known.
    pub pose_interval_us: Option<f64>,
    /// RMS standard error of the instant at which the measured pose crossed the surface, µs; `None` when not known.
    pub crossing_se_us: Option<f64>,
    /// The way down to each contact, in plan order; `None` where the surface was told by its touch, and where poses were not
    /// measured or not read. May end early: what is beyond its end is `None`.
    pub descents: Vec<Option<Descent>>,
    /// Where further legs begin, in order; empty for a session in one.
    pub legs: Vec<LegStart>,
    /// The rig.
    pub rig: RigGeometry,
    /// The settings.
    pub settings: AnalysisSettings,
}

/// Where the events come from. One pass per camera and call; memory stays bounded.
pub trait EventSource: Sync {
    /// Calls `each` with consecutive slices of the camera's CD events in stream order, all of them, once.
    ///
    /// # Errors
    /// A message for the user when the stream cannot be read to its end.
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), String>;
}
