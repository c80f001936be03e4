//! What to do next about each fault.

use crate::result::Fault;

/// The next step for the user.
pub const fn of(fault: Fault) -> &'static str {
    match fault {
        Fault::CamerasSwapped => {
            "exchange the two camera files of the import (--camera1, --camera2), or the camera serials of the rig"
        }
        Fault::OneCameraTwice => {
            "give the import the recording of the other camera, or the rig two different camera serials"
        }
        Fault::PictureTurned => {
            "check how the camera is mounted and whether its recording was mirrored or turned afterwards; record again or turn it back"
        }
        Fault::GeometryOff => {
            "compare the positions of the cameras with the rig description; the calibration makes up for it, but starts far away"
        }
        Fault::AxesExchanged => {
            "compare the columns of the position table with the skin frame of the rig description: which is x, which is y"
        }
        Fault::PositionsDisplaced => {
            "give the positions in the skin frame of the rig description (its origin, not the middle of the skin), or correct the camera positions there"
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
        Fault::OrderOfPresses => {
            "use the press list of this very recording, row by row in the order in which it was pressed"
        }
        Fault::PressesUnlisted => {
            "correct presses_per_repetition and repetitions of the schedule, and the press list, to what was recorded"
        }
        Fault::SyncPattern => {
            "correct sync.count, sync.interval and sync.pause_after of the schedule to what was recorded"
        }
        Fault::RecordingShort => {
            "find out why the camera started late or stopped early; the presses that it has not recorded do not count"
        }
        Fault::RecordingGap => {
            "check cable, power and load of the computer; the presses in the gap do not count"
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
        Fault::HeightOff => {
            "either may be off, and the cameras cannot tell which. On the bench `skinrig hil run hil/nightly.yaml --rig NAME.yaml \
             --only depth` touches the surface: when it FAILs, calibrate the robot and touch the frame off again (`skinrig jog --rig \
             NAME.yaml`); when it PASSes, mend the skin's frame in the protocol, or look at what was mounted for this run. Events \
             come early as well when poses are stamped late"
        }
        Fault::NotTouched => {
            "both cameras send noise, so this is neither a camera nor its cable. Either the tip did not reach the skin (surface lower \
             than the frame says, no skin, or the robot reports its tip lower than it is), or there was no light, or the crop shows rows \
             without the skin. On the bench \
             `skinrig hil run hil/nightly.yaml --rig NAME.yaml --only depth,noise_lit` tells which: a FAIL of `depth` is the height, \
             one of `noise_lit` the light"
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
