//! Which findings follow from others, and which leads.

use crate::result::{Fault, Finding};

/// The findings that do not follow from a more certain one, the most certain first.
pub fn leading_first(mut found: Vec<Finding>) -> Vec<Finding> {
    found.sort_by_key(|f| place(f.fault));
    let mut kept: Vec<Finding> = Vec::new();
    for finding in found {
        if !kept.iter().any(|k| explains(k, &finding)) {
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
        Fault::NoTruth => 2,
        Fault::PressesMissing => 3,
        Fault::UnitOfPositions => 4,
        Fault::CameraBlind => 5,
        Fault::IndexShifted => 6,
        Fault::AxisMirrored => 7,
        Fault::CamerasSwapped => 8,
        Fault::ClockWrong => 9,
        Fault::RobotOff => 10,
        Fault::RigMoved => 11,
        Fault::NoTriggers => 12,
        Fault::Unknown => 13,
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
        Fault::PressesMissing => matches!(b.fault, Fault::CameraBlind | Fault::RobotOff),
        Fault::UnitOfPositions
        | Fault::IndexShifted
        | Fault::AxisMirrored
        | Fault::CamerasSwapped => matches!(
            b.fault,
            Fault::UnitOfPositions
                | Fault::IndexShifted
                | Fault::AxisMirrored
                | Fault::CamerasSwapped
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
                Fault::CameraBlind | Fault::RigMoved | Fault::Unknown
            )
        }
        Fault::RigMoved | Fault::RobotOff => matches!(b.fault, Fault::Unknown),
        Fault::NoTriggers => false,
        // One law that nothing explains is enough.
        Fault::Unknown => b.fault == Fault::Unknown,
    }
}
