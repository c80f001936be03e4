//! Next step for each fault.

use crate::result::Fault;

/// The next step for the user.
pub(super) const fn of(fault: Fault) -> &'static str {
    match fault {
        Fault::CamerasSwapped => {
            "swap the two camera files of the import (--camera1, --camera2), or the camera serials in the rig file"
        }
        Fault::OneCameraTwice => {
            "import the recording of the other camera, or set two different camera serials in the rig file"
        }
        Fault::PictureTurned => {
            "check the camera mounting, and whether the recording was mirrored or rotated afterwards; undo that or record again"
        }
        Fault::GeometryOff => {
            "compare the camera positions with the rig description; the calibration compensates, but starts far off"
        }
        Fault::AxesExchanged => {
            "compare the columns of the position table with the skin frame of the rig description: which is x, which is y"
        }
        Fault::PositionsDisplaced => {
            "give positions in the skin frame of the rig description (its origin is not the middle of the skin), or correct the camera positions there"
        }
        Fault::AxisMirrored => {
            "compare the sign of the axis in the position table with the skin frame of the rig description"
        }
        Fault::UnitOfPositions => {
            "check unit and scale of the position table (csv.unit of the schedule) and of the robot, and the camera positions in the rig description"
        }
        Fault::IndexShifted => {
            "compare the first and last rows of the press list with the recording: extra or missing rows, sync presses"
        }
        Fault::OrderOfPresses => {
            "use the press list of this recording, with rows in the order of pressing"
        }
        Fault::PressesUnlisted => {
            "correct presses_per_repetition and repetitions in the schedule, and the press list, to match the recording"
        }
        Fault::SyncPattern => {
            "correct sync.count, sync.interval and sync.pause_after in the schedule to match the recording"
        }
        Fault::RecordingShort => {
            "find out why the camera started late or stopped early; presses that it did not record do not count"
        }
        Fault::RecordingGap => "check cable, power and CPU load; presses in the gap do not count",
        Fault::CameraBlind => {
            "look at the event images; check lens cap, light, focus, hot pixels, rows of the crop and cable"
        }
        Fault::NoEvents => {
            "check that the camera was connected and running, and that the right stream was read"
        }
        Fault::EventsOutOfOrder => {
            "`skinrig inspect` shows where the time of the recording runs backwards: blocks of it were exchanged. Copy an imported \
             file from the camera's computer again"
        }
        Fault::NoTriggers => "check the cable, the channel and the level of the trigger line",
        Fault::NoTruth => "check the pose stream of the robot, or the position table of the import",
        Fault::PressesMissing => {
            "find out why the run or the recording ended early, and record the rest"
        }
        Fault::ClockWrong => {
            "check that journal and recording belong together, and check the trigger line; a longer session determines the drift better"
        }
        Fault::JournalContradictory => {
            "press times contradict each other; check their source and unit"
        }
        Fault::HeightOff => {
            "either may be off, and the cameras cannot tell which. On the bench, `skinrig hil run hil/nightly.yaml \
             --rig NAME.yaml --only depth` finds the surface: if it FAILs, calibrate the robot and touch off the \
             frame again (`skinrig jog --rig NAME.yaml`); if it PASSes, correct the skin frame in the protocol, or \
             check what was mounted for this run. Poses with late timestamps also make events appear early"
        }
        Fault::NotTouched => {
            "both cameras record noise, so neither a camera nor its cable is at fault. Either the tip did not reach \
             the skin (surface lower than in the frame, no skin, or the robot reports its tip too low), or there was \
             no light, or the crop shows rows without the skin. On the bench, `skinrig hil run hil/nightly.yaml --rig \
             NAME.yaml --only depth,noise_lit` decides: if `depth` FAILs it is the height, if `noise_lit` FAILs the \
             light"
        }
        Fault::RobotOff => {
            "check the robot's calibration, its limits and the skin frame before using the positions as truth"
        }
        Fault::RigMoved => {
            "check that skin, cameras and light are fixed; analyse the repetitions separately"
        }
        Fault::Unknown => {
            "if a warning asks for it, raise `min_samples`; else look at the images: the nominal camera geometry may be wrong"
        }
    }
}
