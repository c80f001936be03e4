//! Evidence from errors of a run: controller errors, press faults and preflight checks.

use std::collections::BTreeMap;

use skinrig_controller::{
    NotAtRest, PressFault, RunFault, RunReport, TimingFault, TouchFault, WatchdogTrip,
};
use skinrig_model::{CameraId, CheckKind, DeviceRole, PreflightCheck, PressId};
use skinrig_nightly::{Evidence, EvidenceKind};

use crate::device_evidence::{self, COMPUTER, SKIN};

const ROBOT: &str = device_evidence::subject(DeviceRole::Indenter);

/// Evidence from a finished run: the faults that ended it, secondary problems, and faults of presses
/// without a valid attempt. A stop by the operator is none.
#[must_use]
pub fn from_report(report: &RunReport) -> Vec<Evidence> {
    let problems = report.problems.iter().map(|p| &p.error);
    let faults = report.end.faults().iter();
    let mut all: Vec<Evidence> = faults
        .filter(|fault| !matches!(fault, RunFault::Stopped(_)))
        .chain(problems)
        .flat_map(from_error)
        .collect();
    all.extend(from_press_faults(report));
    let mut once: Vec<Evidence> = Vec::new();
    for evidence in all {
        if !once.contains(&evidence) {
            once.push(evidence);
        }
    }
    once
}

/// Faults of the last attempts at invalid presses, merged by kind of evidence and device.
fn from_press_faults(report: &RunReport) -> Vec<Evidence> {
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
            let evidence = from_press_fault(fault);
            let same = |(e, _): &&mut (Evidence, u32)| {
                (e.kind, &e.subject) == (evidence.kind, &evidence.subject)
            };
            match rows.iter_mut().find(same) {
                Some((_, n)) => *n += 1,
                None => rows.push((evidence, 1)),
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

/// Evidence from a controller error; never empty.
#[must_use]
pub fn from_error(error: &RunFault) -> Vec<Evidence> {
    use EvidenceKind as K;
    let (kind, subject) = match error {
        RunFault::Device(device) => return vec![*device_evidence::from_error(device)],
        RunFault::InvalidInARow { faults, .. } => {
            return faults.iter().map(from_press_fault).collect();
        }
        RunFault::Preflight { failed } => {
            return failed.iter().map(from_preflight_check).collect();
        }
        RunFault::Sink(_) => (K::Disk, COMPUTER),
        RunFault::Watchdog(WatchdogTrip::Feedback { .. } | WatchdogTrip::Stale { .. })
        | RunFault::PoseStream { .. } => (K::DeviceLost, ROBOT),
        RunFault::Watchdog(WatchdogTrip::Late { .. }) => (K::HostLate, COMPUTER),
        RunFault::Watchdog(_) => (K::Trip, ROBOT),
        RunFault::NotArrived(_) | RunFault::NotAtRest(_) => (K::State, ROBOT),
        RunFault::Guard(_) | RunFault::Rig { .. } => (K::Refused, ROBOT),
        RunFault::Surface { .. } => (K::State, SKIN),
        RunFault::ChunkOrder { camera, .. } => {
            (K::Software, device_evidence::camera_subject(*camera))
        }
        RunFault::ClockStep { camera, .. } => {
            (K::DeviceLost, device_evidence::camera_subject(*camera))
        }
        RunFault::Suspended { .. } => (K::TimeOut, COMPUTER),
        RunFault::Halted | RunFault::Stopped(_) => (K::Stopped, ROBOT),
        RunFault::Plan { .. } | RunFault::Internal(_) | RunFault::Recorded { .. } => {
            (K::Software, COMPUTER)
        }
    };
    let entry = Evidence::new(kind, subject, error.to_string());
    vec![match next_step(error) {
        Some(step) => entry.next(step),
        None => entry,
    }]
}

/// Next step for errors whose text has none.
const fn next_step(error: &RunFault) -> Option<&'static str> {
    Some(match error {
        RunFault::PoseStream { .. }
        | RunFault::Watchdog(WatchdogTrip::Feedback { .. } | WatchdogTrip::Stale { .. }) => {
            "check the robot's power, its light and its cable, then run `skinrig doctor`"
        }
        RunFault::Watchdog(WatchdogTrip::Late { .. }) => {
            "find out what else this computer runs at that time"
        }
        RunFault::Watchdog(_) | RunFault::NotArrived(_) => {
            "check the arm: is anything in its way, does it move freely by hand?"
        }
        RunFault::NotAtRest(NotAtRest::NotClear | NotAtRest::NotDisarmed) => {
            "check where the arm is before powering it"
        }
        RunFault::Guard(_) => {
            "compare `limits` and `frame` of the rig file with the real positions of arm and skin"
        }
        RunFault::Internal(_) | RunFault::ChunkOrder { .. } => {
            "this is a bug in skinrig: please report it with the night's folder"
        }
        _ => return None,
    })
}

/// Evidence from a press fault.
#[must_use]
pub(crate) fn from_press_fault(fault: &PressFault) -> Evidence {
    use EvidenceKind as K;
    let camera = |c: &CameraId| device_evidence::camera_subject(*c);
    let (kind, subject) = match fault {
        PressFault::DataLost { camera: c, .. } => (K::DataLost, camera(c)),
        PressFault::NoData { camera: c } | PressFault::DataLate { camera: c, .. } => {
            (K::DeviceLost, camera(c))
        }
        PressFault::EventStorm { camera: c, .. } => (K::State, camera(c)),
        PressFault::MotionLate(_)
        | PressFault::ClearLate { .. }
        | PressFault::PushedAside { .. }
        | PressFault::Timing(TimingFault::Hold { .. })
        | PressFault::Touch(TouchFault::Late(_)) => (K::State, ROBOT),
        PressFault::Timing(_)
        | PressFault::Touch(TouchFault::NoForce { .. } | TouchFault::ShortTare(_)) => {
            (K::DeviceLost, ROBOT)
        }
        PressFault::Touch(_) => (K::State, SKIN),
        PressFault::Paused | PressFault::Suspended(_) | PressFault::RunEnded(_) => {
            (K::Stopped, COMPUTER)
        }
    };
    Evidence::new(kind, subject, fault.to_string())
}

/// Evidence from a failed preflight check.
fn from_preflight_check(check: &PreflightCheck) -> Evidence {
    use EvidenceKind as K;
    let (kind, subject) = match check.kind {
        CheckKind::Disk | CheckKind::Recorder => (K::Disk, COMPUTER),
        CheckKind::Frame => (K::State, SKIN),
        CheckKind::Identity(role) => (K::OtherDevice, device_evidence::subject(role)),
        CheckKind::ReadBack(role) => (K::ReadBack, device_evidence::subject(role)),
        CheckKind::State(role) => (K::State, device_evidence::subject(role)),
        CheckKind::Clock(role) => (K::DeviceLost, device_evidence::subject(role)),
        CheckKind::Trigger(role) => (K::TriggerFault, device_evidence::subject(role)),
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
    use skinrig_model::{Causes, HostDuration, HostTime, Point3};

    use super::*;

    fn kinds_and_subjects(error: RunFault) -> Vec<(EvidenceKind, String)> {
        let rows = from_error(&error);
        rows.into_iter().map(|e| (e.kind, e.subject)).collect()
    }

    /// Evidence depends on types only; misleading serial numbers and details change nothing.
    #[test]
    fn evidence_depends_on_types_and_not_on_text() {
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
            max_force_n: 8.0,
            found: None,
        };
        let one = |kind, subject: &str| vec![(kind, subject.to_owned())];
        assert_eq!(
            kinds_and_subjects(lost.into()),
            one(EvidenceKind::DeviceLost, "camera2")
        );
        assert_eq!(
            kinds_and_subjects(read_back.into()),
            one(EvidenceKind::ReadBack, "camera2")
        );
        assert_eq!(
            kinds_and_subjects(not_arrived.clone().into()),
            one(EvidenceKind::State, "robot")
        );
        let late = WatchdogTrip::Late {
            limit: HostDuration::from_millis(1),
            found: HostDuration::from_millis(2),
        };
        assert_eq!(
            kinds_and_subjects(late.into()),
            one(EvidenceKind::HostLate, "computer")
        );
        let force = WatchdogTrip::Force {
            limit_n: 1.0,
            found_n: 2.0,
            t: HostTime(0),
        };
        assert_eq!(
            kinds_and_subjects(force.into()),
            one(EvidenceKind::Trip, "robot")
        );
        let row = RunFault::InvalidInARow {
            limit: 2,
            faults: Causes::try_from(vec![
                PressFault::MotionLate(not_arrived),
                PressFault::NoData {
                    camera: CameraId::One,
                },
            ])
            .unwrap(),
        };
        let both = [
            (EvidenceKind::State, "robot".to_owned()),
            (EvidenceKind::DeviceLost, "camera1".to_owned()),
        ];
        assert_eq!(kinds_and_subjects(row), both);
        let full = PreflightCheck::new(misleading, "", "", false, "").about(CheckKind::Disk);
        let failed = vec![full];
        assert_eq!(
            kinds_and_subjects(RunFault::Preflight { failed }),
            one(EvidenceKind::Disk, "computer")
        );
    }
}
