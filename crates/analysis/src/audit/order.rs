//! Decides which findings follow from others, and which comes first.

use crate::result::{Fault, Finding};

/// Drops findings that follow from a more certain one; the most certain comes first.
pub(crate) fn leading_first(mut found: Vec<Finding>) -> Vec<Finding> {
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

/// Rank by directness: missing or contradictory data first, inferred faults last.
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
        Fault::NotTouched => 8,
        Fault::CameraBlind => 9,
        Fault::IndexShifted => 10,
        Fault::OrderOfPresses => 11,
        Fault::AxesExchanged => 12,
        Fault::AxisMirrored => 13,
        Fault::PictureTurned => 14,
        Fault::CamerasSwapped => 15,
        Fault::PositionsDisplaced => 16,
        Fault::ClockWrong => 17,
        Fault::SyncPattern => 18,
        Fault::PressesUnlisted => 19,
        Fault::HeightOff => 20,
        Fault::RobotOff => 21,
        Fault::RigMoved => 22,
        Fault::GeometryOff => 23,
        Fault::NoTriggers => 24,
        Fault::Unknown => 25,
    }
}

/// True if `a` implies `b`.
fn explains(a: &Finding, b: &Finding) -> bool {
    let same_camera = a.camera.is_none() || b.camera.is_none() || a.camera == b.camera;
    match a.fault {
        // With wrong times no window contains its press.
        Fault::JournalContradictory => !matches!(
            b.fault,
            Fault::NoEvents | Fault::NoTruth | Fault::NoTriggers | Fault::UnitOfPositions
        ),
        Fault::NoEvents => match b.fault {
            // A camera that is off sees no edges either.
            Fault::CameraBlind | Fault::NoTriggers | Fault::ClockWrong => same_camera,
            Fault::NotTouched | Fault::Unknown | Fault::RigMoved => true,
            _ => false,
        },
        Fault::NoTruth => matches!(
            b.fault,
            Fault::RobotOff | Fault::Unknown | Fault::UnitOfPositions
        ),
        Fault::PressesMissing => matches!(
            b.fault,
            Fault::CameraBlind | Fault::NotTouched | Fault::RobotOff | Fault::RecordingGap
        ),
        // Misinterpretations: a single one makes everything else look wrong.
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
            Fault::PressesMissing
            | Fault::NotTouched
            | Fault::RobotOff
            | Fault::RigMoved
            | Fault::Unknown => true,
            _ => false,
        },
        Fault::RecordingGap => match b.fault {
            Fault::CameraBlind => same_camera,
            Fault::RobotOff | Fault::NotTouched => true,
            _ => false,
        },
        Fault::NotTouched => matches!(
            b.fault,
            Fault::CameraBlind
                | Fault::ClockWrong
                | Fault::HeightOff
                | Fault::RobotOff
                | Fault::RigMoved
                | Fault::Unknown
        ),
        Fault::CameraBlind => match b.fault {
            Fault::ClockWrong => same_camera,
            Fault::RigMoved | Fault::Unknown => true,
            _ => false,
        },
        Fault::ClockWrong => {
            matches!(
                b.fault,
                Fault::CameraBlind | Fault::HeightOff | Fault::RigMoved | Fault::Unknown
            )
        }
        Fault::RigMoved | Fault::RobotOff => matches!(b.fault, Fault::Unknown),
        Fault::NoTriggers
        | Fault::GeometryOff
        | Fault::HeightOff
        | Fault::PressesUnlisted
        | Fault::SyncPattern => false,
        // One unexplained violation is enough.
        Fault::Unknown => b.fault == Fault::Unknown,
    }
}
