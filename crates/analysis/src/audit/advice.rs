//! What to do next about each fault.

use crate::result::Fault;

/// The next step for the user.
pub const fn of(fault: Fault) -> &'static str {
    match fault {
        Fault::CamerasSwapped => {
            "exchange the two camera files of the import (--camera1, --camera2), or the camera serials of the rig"
        }
        Fault::AxisMirrored => {
            "compare the sign of the axis in the position table with the skin frame of the rig description"
        }
        Fault::UnitOfPositions => {
            "check the unit of the position table (csv.unit of the schedule) and of the robot"
        }
        Fault::IndexShifted => {
            "compare the first and last rows of the press list with the recording: rows too many or too few, sync presses"
        }
        Fault::CameraBlind => {
            "look at the event pictures: lens cap, light, focus, hot pixels, rows of the crop, cable"
        }
        Fault::NoEvents => {
            "check that the camera was connected and running, and that the right stream was read"
        }
        Fault::NoTriggers => "check the cable, the channel and the level of the trigger line",
        Fault::NoTruth => "check the pose stream of the robot, or the position table of the import",
        Fault::PressesMissing => {
            "find out why the run or the recording ended early; record the rest again"
        }
        Fault::ClockWrong => {
            "check that journal and recording belong together, and the trigger line; record a longer session to know the drift better"
        }
        Fault::JournalContradictory => {
            "the journal's times or rows cannot all be true: check where the press times come from, and their unit"
        }
        Fault::RobotOff => {
            "check the robot's calibration, its limits and the skin frame before using the positions as truth"
        }
        Fault::RigMoved => {
            "check that skin, cameras and light are fixed; analyse the repetitions apart"
        }
        Fault::Unknown => {
            "look at the pictures and centroid tracks; the nominal camera geometry may be wrong"
        }
    }
}
