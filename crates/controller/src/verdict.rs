//! The verdict on an attempt, and whether to repeat it.

use skinrig_model::{
    Causes, InvalidReason, NoCause, Point3, PressFault, PressOutcome, PressTiming, PressVerdict,
};

use crate::open_press::OpenPress;
use crate::press_tracker::PressTracker;

/// A finished attempt.
pub(crate) struct JudgedAttempt {
    pub(crate) outcome: PressOutcome,
    /// All faults of the attempt.
    pub(crate) faults: Vec<PressFault>,
}

impl JudgedAttempt {
    /// Whether an immediate retake may succeed: all faults are transient.
    pub(crate) fn should_retake(&self) -> bool {
        !self.faults.is_empty() && self.faults.iter().all(PressFault::passes)
    }
}

/// Outcome of a press: valid only if all phases were measured, the tip stayed in place and no data were lost.
pub(crate) fn judge(press: &OpenPress, fault: Option<PressFault>) -> JudgedAttempt {
    let mut faults: Vec<PressFault> = fault.into_iter().collect();
    let mut timing: Option<PressTiming> = None;
    if let Some(tracker) = press.tracker() {
        match tracker.timing() {
            Ok(t) => timing = Some(t),
            Err(fault) if faults.is_empty() => faults.push(PressFault::Timing(fault)),
            Err(_) => {}
        }
        if tracker.at_depth().is_some() {
            faults.extend(tracker.check_hold().err().map(PressFault::Timing));
        }
    }
    faults.extend(press.data_faults());
    let tracker = press.tracker();
    let mean = tracker.and_then(PressTracker::mean);
    let outcome = PressOutcome {
        attempt: press.attempt(),
        verdict: match Causes::try_from(faults.clone()) {
            Err(NoCause) => PressVerdict::Valid,
            Ok(faults) => PressVerdict::Invalid(InvalidReason::Faults(faults)),
        },
        timing,
        measured_at: mean.map(Point3::plane),
        measured_depth_mm: mean.zip(tracker).map(|(m, t)| t.surface_mm() - m.z_mm),
        touched_mm: tracker.and_then(PressTracker::touched_mm),
        peak_force_n: tracker.and_then(PressTracker::peak_force_n),
        scheduled: false,
    };
    JudgedAttempt { outcome, faults }
}
