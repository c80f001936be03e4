//! Owns the findings of the plausibility audit.

use serde::{Deserialize, Serialize};
use skinrig_model::CameraId;

use super::evidence::Evidence;

/// A law that every valid session obeys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// Events burst while the tip moves in the skin.
    BurstWithMotion,
    /// The centroid's column follows the viewing angle of the press in rank.
    CentroidFollowsPosition,
    /// Repetitions at one location agree.
    RepetitionsAgree,
    /// Depth, speed and position match the commands.
    AsCommanded,
    /// The drift of a camera clock is plausible for a crystal.
    ClockDrift,
    /// All data of such a session exist.
    Complete,
}

/// Likely cause of a violation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// The streams of the two cameras are swapped.
    CamerasSwapped,
    /// Both streams come from the same camera.
    OneCameraTwice,
    /// The image of a camera is mirrored or upside down.
    PictureTurned,
    /// A camera is far from its position in the rig description.
    GeometryOff,
    /// An axis of the measured positions (or of the skin frame) is mirrored.
    AxisMirrored,
    /// The x and y columns of the measured positions are exchanged, or the positions are rotated by 90 degrees.
    AxesExchanged,
    /// Positions have another origin than the skin frame.
    PositionsDisplaced,
    /// Positions are in another unit (metres for millimetres, or the reverse).
    UnitOfPositions,
    /// The press list is shifted against the recording.
    IndexShifted,
    /// The press list is in another order than the presses of the recording.
    OrderOfPresses,
    /// The recording holds presses that are not in the press list.
    PressesUnlisted,
    /// The number or spacing of the sync presses differs from the press list.
    SyncPattern,
    /// A camera saw nothing, or nothing but noise.
    CameraBlind,
    /// A camera's recording begins after the first press or ends before the last.
    RecordingShort,
    /// A camera sent nothing for some time in the middle of the recording.
    RecordingGap,
    /// A camera sent no events.
    NoEvents,
    /// The events of a camera are not in the order of their times.
    EventsOutOfOrder,
    /// No trigger edges although the rig has a trigger line.
    NoTriggers,
    /// No measured positions, or no measured times.
    NoTruth,
    /// Many planned presses are not in the recording.
    PressesMissing,
    /// A clock runs far from its nominal rate, or the alignment is wrong.
    ClockWrong,
    /// The journal contradicts itself: times out of order or before the session, presses that overlap or are listed twice.
    JournalContradictory,
    /// The surface is not at the height given by the frame and the robot.
    HeightOff,
    /// Both cameras work but saw no press: the tip did not touch the skin, there was no light, or the crop does not show the
    /// skin.
    NotTouched,
    /// The robot did not execute its commands.
    RobotOff,
    /// Skin, camera or light moved between repetitions.
    RigMoved,
    /// No single cause explains it.
    Unknown,
}

impl Fault {
    /// Name for people: `axis mirrored`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::CamerasSwapped => "cameras swapped",
            Self::OneCameraTwice => "one camera twice",
            Self::PictureTurned => "picture turned",
            Self::GeometryOff => "geometry off",
            Self::AxisMirrored => "axis mirrored",
            Self::AxesExchanged => "axes exchanged",
            Self::PositionsDisplaced => "positions displaced",
            Self::UnitOfPositions => "unit of positions",
            Self::IndexShifted => "index shifted",
            Self::OrderOfPresses => "order of presses",
            Self::PressesUnlisted => "presses unlisted",
            Self::SyncPattern => "sync pattern",
            Self::CameraBlind => "camera blind",
            Self::RecordingShort => "recording short",
            Self::RecordingGap => "recording gap",
            Self::NoEvents => "no events",
            Self::EventsOutOfOrder => "events out of order",
            Self::NoTriggers => "no triggers",
            Self::NoTruth => "no truth",
            Self::PressesMissing => "presses missing",
            Self::ClockWrong => "clock wrong",
            Self::JournalContradictory => "journal contradictory",
            Self::HeightOff => "height off",
            Self::NotTouched => "not touched",
            Self::RobotOff => "robot off",
            Self::RigMoved => "rig moved",
            Self::Unknown => "unknown",
        }
    }

    /// True if positions, cameras or rows are confused with others.
    #[must_use]
    pub(crate) const fn is_mistaken_identity(self) -> bool {
        matches!(
            self,
            Self::CamerasSwapped
                | Self::OneCameraTwice
                | Self::PictureTurned
                | Self::AxisMirrored
                | Self::AxesExchanged
                | Self::PositionsDisplaced
                | Self::UnitOfPositions
                | Self::IndexShifted
                | Self::OrderOfPresses
        )
    }

    /// True if the errors of the session do not describe the skin. Missing or displaced data leave the rest usable.
    #[must_use]
    pub const fn invalidates(self) -> bool {
        self.is_mistaken_identity()
            || matches!(self, Self::JournalContradictory | Self::EventsOutOfOrder)
    }
}

/// A violated law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// The law.
    pub law: Law,
    /// The likely fault.
    pub fault: Fault,
    /// Camera concerned, if it is a single one.
    pub camera: Option<CameraId>,
    /// What was expected and what was found, with numbers and n.
    pub evidence: Evidence,
    /// What to do next.
    pub advice: String,
    /// True if the session's numbers must not be used ([`Fault::invalidates`], or established by the law itself).
    #[serde(default)]
    pub invalidates: bool,
}
