//! What becomes of an attempt, and whether another one may bring what it did not.

use skinrig_model::{CameraId, Point3, PressOutcome, PressTiming, PressVerdict};

use crate::core::OpenPress;
use crate::moments::PressTracker;
use crate::press_fault::PressFault;

/// An attempt that ended.
pub(crate) struct Judged {
    pub(crate) outcome: PressOutcome,
    /// Everything that is wrong with it.
    pub(crate) faults: Vec<PressFault>,
}

impl Judged {
    /// Whether the press is worth another attempt at once: when everything that is wrong passes.
    pub(crate) fn again(&self) -> bool {
        !self.faults.is_empty() && self.faults.iter().all(PressFault::passes)
    }
}

/// The outcome of a press, valid only when all was measured, stayed in place and nothing was lost.
pub(crate) fn judge(open: &OpenPress, fault: Option<PressFault>) -> Judged {
    let mut faults: Vec<PressFault> = fault.into_iter().collect();
    let mut timing: Option<PressTiming> = None;
    if let Some(tracker) = &open.tracker {
        match tracker.timing() {
            Ok(t) => timing = Some(t),
            Err(fault) if faults.is_empty() => faults.push(PressFault::Moments(fault)),
            Err(_) => {}
        }
        if tracker.at_depth().is_some() {
            faults.extend(tracker.check_hold().err().map(PressFault::Moments));
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
    faults.extend_from_slice(&open.spoilt);
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
    Judged { outcome, faults }
}
