//! Evidence from the analysis of a golden campaign: which device its violations and findings point to.

use skinrig_analysis::Analysis;
use skinrig_analysis::result::{AlignmentViolation, Fault, MapName};
use skinrig_model::{CameraId, DeviceRole};
use skinrig_nightly::EvidenceKind;

use crate::device_evidence::{SKIN, camera_subject, subject};
use crate::findings::Findings;

/// Adds evidence of everything that makes the numbers of `analysis` unreliable. `lost_bytes` is by camera.
pub(crate) fn add(analysis: &Analysis, lost_bytes: [u64; 2], findings: &mut Findings) {
    let violations = &analysis.alignment.violations;
    let cameras: Vec<CameraId> = violations.iter().filter_map(camera_of).collect();
    let both = CameraId::ALL.iter().all(|c| cameras.contains(c));
    for violation in violations {
        let (kind, subject) = source_of(violation, both);
        let what = format!("the clocks of the session are not aligned: {violation}");
        findings.add_evidence(kind, subject, what);
    }
    for finding in &analysis.findings {
        let what = format!("{}; {}", finding.evidence, finding.advice);
        let camera = camera_subject(finding.camera.unwrap_or(CameraId::One));
        let (kind, subject) = evidence_of(finding.fault, camera);
        findings.add_evidence(kind, subject, what);
    }
    for (camera, lost) in CameraId::ALL.into_iter().zip(lost_bytes) {
        if lost > 0 {
            let what = format!("expected no lost data, found {lost} bytes lost");
            findings.add_evidence(EvidenceKind::DataLost, camera_subject(camera), what);
        }
    }
}

/// The camera whose clock or trigger input a violation is about.
const fn camera_of(violation: &AlignmentViolation) -> Option<CameraId> {
    use AlignmentViolation as V;
    match violation {
        V::NoTrainsClock { camera, .. }
        | V::NoMap { camera, .. }
        | V::FarFromTies { camera, .. }
        | V::LostEdges { camera, .. }
        | V::ExtraEdges { camera, .. } => Some(*camera),
        V::Residuals { map, .. }
        | V::Interval { map, .. }
        | V::Coverage { map, .. }
        | V::Bound { map, .. }
        | V::Drift { map, .. } => match map {
            MapName::Camera1FromBox | MapName::Camera1FromHost => Some(CameraId::One),
            MapName::Camera2FromBox | MapName::Camera2FromHost | MapName::Camera2FromCamera1 => {
                Some(CameraId::Two)
            }
            MapName::HostFromBox | MapName::RobotFromHost => None,
        },
        V::NoExchanges
        | V::ExchangesFitNoClock { .. }
        | V::ExchangesInconsistent
        | V::ClockDrifts { .. }
        | V::NoRatesClock { .. }
        | V::PressesWithoutBursts { .. }
        | V::BurstsWithoutPresses { .. }
        | V::UncertainRates { .. } => None,
    }
}

/// Kind of evidence and device of a violation. What `both` cameras show comes from the trigger box that they share.
const fn source_of(violation: &AlignmentViolation, both: bool) -> (EvidenceKind, &'static str) {
    use AlignmentViolation as V;
    let trigger_box = subject(DeviceRole::TriggerBox);
    match violation {
        V::NoRatesClock { .. }
        | V::PressesWithoutBursts { .. }
        | V::BurstsWithoutPresses { .. }
        | V::UncertainRates { .. } => (EvidenceKind::Audit, SKIN),
        V::ClockDrifts { clock, .. } => (EvidenceKind::TriggerFault, subject(*clock)),
        _ => match camera_of(violation) {
            Some(camera) if !both => (EvidenceKind::TriggerFault, camera_subject(camera)),
            _ => (EvidenceKind::TriggerFault, trigger_box),
        },
    }
}

/// Kind of evidence and device of an audit finding. Contradictions between the recording and the
/// rig file are faults of the rig, not of the skin.
const fn evidence_of(fault: Fault, camera: &'static str) -> (EvidenceKind, &'static str) {
    match fault {
        Fault::CameraBlind | Fault::NoEvents => (EvidenceKind::DeviceLost, camera),
        Fault::RecordingShort | Fault::RecordingGap | Fault::EventsOutOfOrder => {
            (EvidenceKind::DataLost, camera)
        }
        Fault::CamerasSwapped
        | Fault::OneCameraTwice
        | Fault::PictureTurned
        | Fault::GeometryOff
        | Fault::RigMoved => (EvidenceKind::OtherDevice, camera),
        Fault::NoTriggers | Fault::ClockWrong => (EvidenceKind::TriggerFault, "trigger box"),
        Fault::RobotOff
        | Fault::HeightOff
        | Fault::NoTruth
        | Fault::UnitOfPositions
        | Fault::AxisMirrored
        | Fault::AxesExchanged
        | Fault::PositionsDisplaced => (EvidenceKind::State, "robot"),
        Fault::NotTouched
        | Fault::IndexShifted
        | Fault::OrderOfPresses
        | Fault::PressesUnlisted
        | Fault::SyncPattern
        | Fault::PressesMissing
        | Fault::JournalContradictory
        | Fault::Unknown => (EvidenceKind::Audit, SKIN),
    }
}

#[cfg(test)]
mod tests {
    use skinrig_nightly::Cause;
    use skinrig_nightly::rules::RULES;

    use super::*;

    #[test]
    fn contradictions_of_the_rig_file_are_faults_of_the_rig() {
        let faults = [
            (Fault::CamerasSwapped, "camera2"),
            (Fault::OneCameraTwice, "camera2"),
            (Fault::PictureTurned, "camera2"),
            (Fault::GeometryOff, "camera2"),
            (Fault::RecordingShort, "camera2"),
            (Fault::AxisMirrored, "robot"),
            (Fault::AxesExchanged, "robot"),
            (Fault::PositionsDisplaced, "robot"),
            (Fault::UnitOfPositions, "robot"),
        ];
        for (fault, device) in faults {
            let (kind, subject) = evidence_of(fault, "camera2");
            assert_eq!(subject, device, "{fault:?}");
            let rule = RULES.iter().find(|r| r.kinds.contains(&kind));
            assert_eq!(rule.and_then(|r| r.cause), Some(Cause::Rig), "{fault:?}");
        }
    }

    #[test]
    fn a_violation_names_the_camera_unless_both_cameras_show_it() {
        let lost = |camera| AlignmentViolation::LostEdges {
            camera,
            limit_percent: 1.0,
            found_percent: 50.0,
        };
        let noisy = AlignmentViolation::Residuals {
            map: MapName::Camera2FromBox,
            limit_us: 10.0,
            found_us: 90.0,
        };
        for (violation, both, subject) in [
            (lost(CameraId::Two), false, "camera2"),
            (lost(CameraId::Two), true, "trigger box"),
            (noisy, false, "camera2"),
            (AlignmentViolation::NoExchanges, false, "trigger box"),
        ] {
            let (kind, found) = source_of(&violation, both);
            assert_eq!((kind, found), (EvidenceKind::TriggerFault, subject));
        }
        let doubtful = AlignmentViolation::PressesWithoutBursts {
            camera: CameraId::One,
            least_percent: 90.0,
            presses: 100,
            found: 12,
        };
        assert_eq!(source_of(&doubtful, false), (EvidenceKind::Audit, SKIN));
    }
}
