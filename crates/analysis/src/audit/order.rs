//! Which findings follow from others, and which leads.

use crate::result::{Fault, Finding};

/// The findings that do not follow from a more certain one, the most certain first.
pub fn leading_first(mut found: Vec<Finding>) -> Vec<Finding> {
    found.sort_by_key(|f| (place(f.fault), !f.invalidates));
    let mut kept: Vec<Finding> = Vec::new();
    for finding in found {
        let again = |k: &Finding| k.fault == finding.fault && k.camera == finding.camera;
        if !kept.iter().any(|k| again(k) || explains(k, &finding)) {
            kept.push(finding);
        }
    }
    kept
}

/// How directly a fault is seen: what is simply absent or contradictory first, what is inferred last.
const fn place(fault: Fault) -> u8 {
    match fault {
        Fault::JournalContradictory => 0,
        Fault::NoEvents => 1,
        Fault::RecordingShort => 2,
        Fault::RecordingGap => 3,
        Fault::NoTruth => 4,
        Fault::PressesMissing => 5,
        Fault::OneCameraTwice => 6,
        Fault::UnitOfPositions => 7,
        Fault::CameraBlind => 8,
        Fault::IndexShifted => 9,
        Fault::OrderOfPresses => 10,
        Fault::AxesExchanged => 11,
        Fault::AxisMirrored => 12,
        Fault::PictureTurned => 13,
        Fault::CamerasSwapped => 14,
        Fault::PositionsDisplaced => 15,
        Fault::ClockWrong => 16,
        Fault::SyncPattern => 17,
        Fault::PressesUnlisted => 18,
        Fault::RobotOff => 19,
        Fault::RigMoved => 20,
        Fault::GeometryOff => 21,
        Fault::NoTriggers => 22,
        Fault::Unknown => 23,
    }
}

/// True when `b` is what one has to expect after `a`.
fn explains(a: &Finding, b: &Finding) -> bool {
    let same_camera = a.camera.is_none() || b.camera.is_none() || a.camera == b.camera;
    match a.fault {
        // With wrong times no window holds its press.
        Fault::JournalContradictory => !matches!(
            b.fault,
            Fault::NoEvents | Fault::NoTruth | Fault::NoTriggers | Fault::UnitOfPositions
        ),
        Fault::NoEvents => match b.fault {
            // A camera that is off sees no edges either.
            Fault::CameraBlind | Fault::NoTriggers | Fault::ClockWrong => same_camera,
            Fault::Unknown | Fault::RigMoved => true,
            _ => false,
        },
        Fault::NoTruth => matches!(
            b.fault,
            Fault::RobotOff | Fault::Unknown | Fault::UnitOfPositions
        ),
        Fault::PressesMissing => matches!(
            b.fault,
            Fault::CameraBlind | Fault::RobotOff | Fault::RecordingGap
        ),
        // What is taken for something else: one of them is enough, and makes the rest look wrong.
        Fault::UnitOfPositions
        | Fault::OneCameraTwice
        | Fault::IndexShifted
        | Fault::OrderOfPresses
        | Fault::AxesExchanged
        | Fault::AxisMirrored
        | Fault::PictureTurned
        | Fault::CamerasSwapped
        | Fault::PositionsDisplaced => {
            b.fault.is_mistaken_identity()
                || matches!(
                    b.fault,
                    Fault::RobotOff | Fault::RigMoved | Fault::GeometryOff | Fault::Unknown
                )
        }
        Fault::RecordingShort => match b.fault {
            Fault::CameraBlind | Fault::RecordingGap | Fault::NoTriggers => same_camera,
            Fault::PressesMissing | Fault::RobotOff | Fault::RigMoved | Fault::Unknown => true,
            _ => false,
        },
        Fault::RecordingGap => match b.fault {
            Fault::CameraBlind => same_camera,
            Fault::RobotOff => true,
            _ => false,
        },
        Fault::CameraBlind => match b.fault {
            Fault::ClockWrong => same_camera,
            Fault::RigMoved | Fault::Unknown => true,
            _ => false,
        },
        Fault::ClockWrong => {
            matches!(
                b.fault,
                Fault::CameraBlind | Fault::RigMoved | Fault::Unknown
            )
        }
        Fault::RigMoved | Fault::RobotOff => matches!(b.fault, Fault::Unknown),
        Fault::NoTriggers | Fault::GeometryOff | Fault::PressesUnlisted | Fault::SyncPattern => {
            false
        }
        // One law that nothing explains is enough.
        Fault::Unknown => b.fault == Fault::Unknown,
    }
}
