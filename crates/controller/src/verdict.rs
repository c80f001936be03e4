//! The verdict on an attempt, and whether to repeat it.

use skinrig_model::{CameraId, Point3, PressOutcome, PressTiming, PressVerdict};

use crate::executor::OpenPress;
use crate::press_fault::PressFault;
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
pub(crate) fn judge(open: &OpenPress, fault: Option<PressFault>) -> JudgedAttempt {
    let mut faults: Vec<PressFault> = fault.into_iter().collect();
    let mut timing: Option<PressTiming> = None;
    if let Some(tracker) = &open.tracker {
        match tracker.timing() {
            Ok(t) => timing = Some(t),
            Err(fault) if faults.is_empty() => faults.push(PressFault::Timing(fault)),
            Err(_) => {}
        }
        if tracker.at_depth().is_some() {
            faults.extend(tracker.check_hold().err().map(PressFault::Timing));
        }
    }
    for camera in CameraId::ALL {
        let (lost, bytes) = (open.lost[camera.index()], open.bytes[camera.index()]);
        if lost > 0 {
            faults.push(PressFault::DataLost {
                camera,
                bytes: lost,
            });
        } else if bytes == 0 {
            faults.push(PressFault::NoData { camera });
        }
    }
    faults.extend_from_slice(&open.data_faults);
    let tracker = open.tracker.as_ref();
    let mean = tracker.and_then(PressTracker::mean);
    let outcome = PressOutcome {
        attempt: open.attempt,
        verdict: if faults.is_empty() {
            PressVerdict::Valid
        } else {
            let reasons: Vec<String> = faults.iter().map(ToString::to_string).collect();
            PressVerdict::Invalid(reasons.join("; "))
        },
        faults: faults.iter().map(PressFault::kind).collect(),
        timing,
        measured_at: mean.map(Point3::plane),
        measured_depth_mm: mean.zip(tracker).map(|(m, t)| t.surface_mm() - m.z_mm),
        touched_mm: tracker.and_then(PressTracker::touched_mm),
        peak_force_n: tracker.and_then(PressTracker::peak_force_n),
        scheduled: false,
    };
    JudgedAttempt { outcome, faults }
}
