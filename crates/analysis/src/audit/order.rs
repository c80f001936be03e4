//! Decides which findings follow from others, and which comes first.

use crate::result::{Evidence, Fault, Finding, FrameChange, Law, OtherReading};

/// Drops findings that follow from a more certain one, which invalidates if any of them does; the most certain comes first.
pub(crate) fn leading_first(mut found: Vec<Finding>) -> Vec<Finding> {
    found.sort_by_key(|f| (place(f), !f.invalidates));
    let mut reported: Vec<Finding> = Vec::new();
    // A scale has parameters enough to fit some of a move, but makes no repetitions disagree.
    if let Some(moved) = found.iter().position(|f| f.fault == Fault::RigMoved)
        && found.iter().any(is_stretch)
    {
        found[moved].invalidates = true;
        found.retain(|f| !is_stretch(f));
    }
    for finding in found {
        let repeats = |k: &Finding| k.fault == finding.fault && k.camera == finding.camera;
        match reported
            .iter_mut()
            .find(|k| repeats(k) || explains(k, &finding))
        {
            // Whatever makes the numbers unusable still does.
            Some(cause) => cause.invalidates |= finding.invalidates,
            None => reported.push(finding),
        }
    }
    reported
}

/// Rank by directness: missing or contradictory data first, inferred faults last.
fn place(finding: &Finding) -> u8 {
    match finding.fault {
        Fault::ClockWrong if is_seen_in_bursts(finding) => 5,
        Fault::JournalContradictory => 0,
        // A camera without events has none out of order.
        Fault::NoEvents | Fault::EventsOutOfOrder => 1,
        Fault::RecordingShort => 2,
        Fault::RecordingGap => 3,
        Fault::NoTruth => 4,
        Fault::PressesMissing => 6,
        Fault::OneCameraTwice => 7,
        Fault::UnitOfPositions => 8,
        Fault::NotTouched => 9,
        Fault::CameraBlind => 10,
        Fault::IndexShifted => 11,
        Fault::OrderOfPresses => 12,
        Fault::AxesExchanged => 13,
        Fault::AxisMirrored => 14,
        Fault::PictureTurned => 15,
        Fault::CamerasSwapped => 16,
        Fault::PositionsDisplaced => 17,
        Fault::ClockWrong => 18,
        Fault::SyncPattern => 19,
        Fault::PressesUnlisted => 20,
        Fault::HeightOff => 21,
        Fault::RobotOff => 22,
        Fault::RigMoved => 23,
        Fault::GeometryOff => 24,
        Fault::NoTriggers => 25,
        Fault::Unknown => 26,
    }
}

/// True if only another scale of the positions explains the columns.
fn is_stretch(finding: &Finding) -> bool {
    matches!(
        finding.evidence,
        Evidence::OtherReading {
            reading: OtherReading::Frame {
                frame: FrameChange::Stretched { .. }
            },
            ..
        }
    )
}

/// True if the bursts of one camera come at the times of other presses.
fn is_seen_in_bursts(finding: &Finding) -> bool {
    finding.law == Law::BurstWithMotion
        && (finding.camera.is_some() || matches!(finding.evidence, Evidence::ClockStep { .. }))
        || matches!(finding.evidence, Evidence::MarksStep { .. })
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
        // Windows miss events of their presses, and hold those of others.
        Fault::EventsOutOfOrder => !matches!(
            b.fault,
            Fault::EventsOutOfOrder
                | Fault::JournalContradictory
                | Fault::NoTruth
                | Fault::PressesMissing
                | Fault::NoTriggers
        ),
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
        // The views are those of other presses, and the ends of the path have none.
        Fault::ClockWrong if is_seen_in_bursts(a) => {
            b.fault.is_mistaken_identity()
                || matches!(
                    b.fault,
                    Fault::PressesMissing
                        | Fault::CameraBlind
                        | Fault::NoTriggers
                        | Fault::IndexShifted
                        | Fault::HeightOff
                        | Fault::RobotOff
                        | Fault::RigMoved
                        | Fault::GeometryOff
                        | Fault::Unknown
                )
        }
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
