//! What an error of the controller or a fault of a press means as evidence.

use std::collections::BTreeMap;

use skinrig_controller::{
    ControllerError, MomentFault, NotAtRest, PressFault, RunReport, TouchFault, Trip,
};
use skinrig_model::{CameraId, CheckKind, DeviceRole, PreflightCheck, PressId};
use skinrig_nightly::{Evidence, EvidenceKind};

use crate::trouble::{self, COMPUTER, SKIN};

const ROBOT: &str = trouble::subject(DeviceRole::Indenter);

/// What ended a run before its plan did, what went wrong beside it, and what was wrong with the presses that stayed invalid.
#[must_use]
pub fn of_run(report: &RunReport) -> Vec<Evidence> {
    let problems = report.problems.iter().map(|p| &p.error);
    let mut all: Vec<Evidence> = report.causes.iter().chain(problems).flat_map(of).collect();
    all.extend(of_presses(report));
    let mut once: Vec<Evidence> = Vec::new();
    for evidence in all {
        if !once.contains(&evidence) {
            once.push(evidence);
        }
    }
    once
}

/// The faults of presses whose last attempt was invalid: one row for each kind of thing seen on each device.
fn of_presses(report: &RunReport) -> Vec<Evidence> {
    let mut last: BTreeMap<PressId, Vec<(u32, &PressFault)>> = BTreeMap::new();
    for (attempt, fault) in &report.press_faults {
        let faults = last.entry(attempt.press).or_default();
        faults.retain(|(number, _)| *number >= attempt.number);
        faults.push((attempt.number, fault));
    }
    let mut rows: Vec<(Evidence, u32)> = Vec::new();
    for (press, faults) in &last {
        if report.is_valid(*press) {
            continue;
        }
        for (_, fault) in faults {
            let seen = of_press(fault);
            let same =
                |(e, _): &&mut (Evidence, u32)| (e.kind, &e.subject) == (seen.kind, &seen.subject);
            match rows.iter_mut().find(same) {
                Some((_, n)) => *n += 1,
                None => rows.push((seen, 1)),
            }
        }
    }
    rows.into_iter()
        .map(|(row, n)| Evidence {
            what: format!("{n} invalid: {}", row.what),
            ..row
        })
        .collect()
}

/// The evidence that an error of the controller is; not empty.
#[must_use]
pub fn of(error: &ControllerError) -> Vec<Evidence> {
    use EvidenceKind as K;
    let (kind, subject) = match error {
        ControllerError::Device(device) => return vec![*trouble::of(device)],
        ControllerError::InvalidInARow { faults, .. } => {
            return faults.iter().map(of_press).collect();
        }
        ControllerError::Preflight { failed } => return failed.iter().map(of_check).collect(),
        ControllerError::Sink(_) => (K::Disk, COMPUTER),
        ControllerError::Watchdog(Trip::Feedback { .. } | Trip::Stale { .. })
        | ControllerError::PoseStream { .. } => (K::DeviceLost, ROBOT),
        ControllerError::Watchdog(Trip::Late { .. }) => (K::HostLate, COMPUTER),
        ControllerError::Watchdog(_) => (K::Trip, ROBOT),
        ControllerError::NotArrived(_) | ControllerError::NotAtRest(_) => (K::State, ROBOT),
        ControllerError::Guard(_) | ControllerError::Rig { .. } => (K::Refused, ROBOT),
        ControllerError::Surface { .. } => (K::State, SKIN),
        ControllerError::ChunkOrder { camera, .. } => (K::Software, trouble::of_camera(*camera)),
        ControllerError::ClockStep { camera, .. } => (K::DeviceLost, trouble::of_camera(*camera)),
        ControllerError::Suspended { .. } => (K::TimeOut, COMPUTER),
        ControllerError::Halted => (K::Stopped, ROBOT),
        ControllerError::Plan { .. } | ControllerError::Internal(_) => (K::Software, COMPUTER),
    };
    let row = Evidence::new(kind, subject, error.to_string());
    vec![match next(error) {
        Some(step) => row.next(step),
        None => row,
    }]
}

/// What to do about it, where the error itself does not say.
const fn next(error: &ControllerError) -> Option<&'static str> {
    Some(match error {
        ControllerError::PoseStream { .. }
        | ControllerError::Watchdog(Trip::Feedback { .. } | Trip::Stale { .. }) => {
            "look at the robot's power, its light and its cable, then `skinrig doctor`"
        }
        ControllerError::Watchdog(Trip::Late { .. }) => {
            "see what else this computer does at that time"
        }
        ControllerError::Watchdog(_) | ControllerError::NotArrived(_) => {
            "look at the arm: is anything in its way, does it move freely by hand?"
        }
        ControllerError::NotAtRest(NotAtRest::NotClear | NotAtRest::NotDisarmed) => {
            "look where the arm is before anybody powers it"
        }
        ControllerError::Guard(_) => {
            "compare `limits` and `frame` of the rig file with where the arm and the skin are"
        }
        ControllerError::Internal(_) | ControllerError::ChunkOrder { .. } => {
            "this is a fault of the program: please report it with the night's folder"
        }
        _ => return None,
    })
}

/// The evidence that a fault of a press is.
#[must_use]
pub(crate) fn of_press(fault: &PressFault) -> Evidence {
    use EvidenceKind as K;
    let camera = |c: &CameraId| trouble::of_camera(*c);
    let (kind, subject) = match fault {
        PressFault::DataLost { camera: c, .. } => (K::DataLost, camera(c)),
        PressFault::NoData { camera: c } | PressFault::DataLate { camera: c, .. } => {
            (K::DeviceLost, camera(c))
        }
        PressFault::Storm { camera: c, .. } => (K::State, camera(c)),
        PressFault::Late(_)
        | PressFault::ClearLate { .. }
        | PressFault::Aside { .. }
        | PressFault::Moments(MomentFault::Hold { .. })
        | PressFault::Touch(TouchFault::Late(_)) => (K::State, ROBOT),
        PressFault::Moments(_)
        | PressFault::Touch(TouchFault::NoForce { .. } | TouchFault::FewForces(_)) => {
            (K::DeviceLost, ROBOT)
        }
        PressFault::Touch(_) => (K::State, SKIN),
        PressFault::Paused | PressFault::Suspended(_) | PressFault::RunEnded(_) => {
            (K::Stopped, COMPUTER)
        }
    };
    Evidence::new(kind, subject, fault.to_string())
}

/// The evidence that a failed check before a run is.
fn of_check(check: &PreflightCheck) -> Evidence {
    use EvidenceKind as K;
    let (kind, subject) = match check.kind {
        CheckKind::Disk | CheckKind::Recorder => (K::Disk, COMPUTER),
        CheckKind::Frame => (K::State, SKIN),
        CheckKind::Identity(role) => (K::OtherDevice, trouble::subject(role)),
        CheckKind::ReadBack(role) => (K::ReadBack, trouble::subject(role)),
        CheckKind::State(role) => (K::State, trouble::subject(role)),
        CheckKind::Clock(role) => (K::DeviceLost, trouble::subject(role)),
        CheckKind::Trigger(role) => (K::TriggerFault, trouble::subject(role)),
        CheckKind::Other => (K::State, COMPUTER),
    };
    let what = format!(
        "preflight: {}: expected {}, found {}",
        check.check, check.expected, check.found
    );
    Evidence::new(kind, subject, what).next(check.next_step.as_str())
}

#[cfg(test)]
mod tests {
    use skinrig_controller::NotArrived;
    use skinrig_device::DeviceError;
    use skinrig_model::{HostDuration, HostTime, Point3};

    use super::*;

    fn seen(error: ControllerError) -> Vec<(EvidenceKind, String)> {
        let rows = of(&error);
        rows.into_iter().map(|e| (e.kind, e.subject)).collect()
    }

    /// Whatever the words are: serial numbers and details that read like another cause change nothing.
    #[test]
    fn causes_are_told_by_type() {
        let misleading = "recorder: disk full: operator: refused: lost: trigger box camera 1";
        let (role, serial) = (DeviceRole::Camera2, misleading.to_owned());
        let lost = DeviceError::Lost {
            role,
            serial: serial.clone(),
            detail: misleading.to_owned(),
        };
        let read_back = DeviceError::ReadBack {
            role,
            serial,
            name: misleading.to_owned(),
            expected: "1".to_owned(),
            found: "2".to_owned(),
        };
        let not_arrived = NotArrived {
            what: misleading.to_owned(),
            tolerance_mm: 0.05,
            target: Point3::new(0.0, 0.0, 0.0),
            allowed: HostDuration::from_millis(1),
            found: None,
        };
        let one = |kind, subject: &str| vec![(kind, subject.to_owned())];
        assert_eq!(seen(lost.into()), one(EvidenceKind::DeviceLost, "camera2"));
        assert_eq!(
            seen(read_back.into()),
            one(EvidenceKind::ReadBack, "camera2")
        );
        assert_eq!(
            seen(not_arrived.clone().into()),
            one(EvidenceKind::State, "robot")
        );
        let late = Trip::Late {
            limit: HostDuration::from_millis(1),
            found: HostDuration::from_millis(2),
        };
        assert_eq!(seen(late.into()), one(EvidenceKind::HostLate, "computer"));
        let force = Trip::Force {
            limit_n: 1.0,
            found_n: 2.0,
            t: HostTime(0),
        };
        assert_eq!(seen(force.into()), one(EvidenceKind::Trip, "robot"));
        let row = ControllerError::InvalidInARow {
            limit: 2,
            faults: vec![
                PressFault::Late(not_arrived),
                PressFault::NoData {
                    camera: CameraId::One,
                },
            ],
        };
        let both = [
            (EvidenceKind::State, "robot".to_owned()),
            (EvidenceKind::DeviceLost, "camera1".to_owned()),
        ];
        assert_eq!(seen(row), both);
        let full = PreflightCheck::new(misleading, "", "", false, "").about(CheckKind::Disk);
        let failed = vec![full];
        assert_eq!(
            seen(ControllerError::Preflight { failed }),
            one(EvidenceKind::Disk, "computer")
        );
    }
}
