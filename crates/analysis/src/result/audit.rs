//! Owns what the plausibility audit reports.

use serde::{Deserialize, Serialize};
use skinrig_model::CameraId;

/// A law that every sane session obeys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// Events burst while the tip moves in the skin.
    BurstWithMotion,
    /// The centroid's column follows the viewing angle of the press in rank.
    CentroidFollowsPosition,
    /// Repetitions at one place agree.
    RepetitionsAgree,
    /// Depth, speed and position are as commanded.
    AsCommanded,
    /// The camera clock drifts no more than a crystal does.
    ClockDrift,
    /// Data that a session of this kind has are there.
    Complete,
}

/// What most likely broke a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// The two cameras' streams are exchanged.
    CamerasSwapped,
    /// Both streams come from the same camera.
    OneCameraTwice,
    /// A camera's picture is mirrored or upside down.
    PictureTurned,
    /// A camera is far from where the rig description draws it.
    GeometryOff,
    /// An axis of the measured positions (or of the skin frame) is mirrored.
    AxisMirrored,
    /// The x and y columns of the measured positions are exchanged, or the positions are turned by 90 degrees.
    AxesExchanged,
    /// Positions are relative to another origin than the skin frame's.
    PositionsDisplaced,
    /// Positions are in another unit (metres for millimetres, or the reverse).
    UnitOfPositions,
    /// The press list is shifted against the recording.
    IndexShifted,
    /// The press list is in another order than the presses of the recording.
    OrderOfPresses,
    /// The recording holds presses that are not in the press list.
    PressesUnlisted,
    /// The sync presses are others than the press list says, in number or spacing.
    SyncPattern,
    /// A camera saw nothing, or nothing but noise.
    CameraBlind,
    /// A camera's recording begins after the first press or ends before the last.
    RecordingShort,
    /// A camera sent nothing for a while in the middle of the recording.
    RecordingGap,
    /// A camera sent no events.
    NoEvents,
    /// There are no trigger edges where the rig has a trigger line.
    NoTriggers,
    /// There are no measured positions, or no measured times.
    NoTruth,
    /// Many planned presses are not in the recording.
    PressesMissing,
    /// A clock runs far from its nominal rate, or the alignment is wrong.
    ClockWrong,
    /// The journal contradicts itself: moments out of order or before the session, presses that overlap or are
    /// listed twice.
    JournalContradictory,
    /// The surface is not where the frame and the height that the robot reports say.
    HeightOff,
    /// Both cameras work and saw no press: the tip did not touch the skin, there was no light, or the crop shows
    /// no skin.
    NotTouched,
    /// The robot did not do what was commanded.
    RobotOff,
    /// Skin, camera or light moved between repetitions.
    RigMoved,
    /// No single cause explains it.
    Unknown,
}

impl Fault {
    /// As people read it: `axis mirrored`.
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

    /// True when positions, cameras or rows are taken for others than they are.
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

    /// True for a fault after which the errors of the session are no errors of the skin. What is only absent, or moved,
    /// leaves the rest usable.
    #[must_use]
    pub const fn invalidates(self) -> bool {
        self.is_mistaken_identity() || matches!(self, Self::JournalContradictory)
    }
}

/// One broken law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// The law.
    pub law: Law,
    /// The likely fault.
    pub fault: Fault,
    /// The camera concerned, when it is one.
    pub camera: Option<CameraId>,
    /// What was expected and what was found, in words with numbers and n.
    pub evidence: String,
    /// What to do next.
    pub advice: String,
    /// True when the session's numbers are not to be used ([`Fault::invalidates`], or what a law makes sure of).
    #[serde(default)]
    pub invalidates: bool,
}
