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
    /// An axis of the measured positions (or of the skin frame) is mirrored.
    AxisMirrored,
    /// Positions are in another unit (metres for millimetres, or the reverse).
    UnitOfPositions,
    /// The press list is shifted against the recording.
    IndexShifted,
    /// A camera saw nothing, or nothing but noise.
    CameraBlind,
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
    /// The robot did not do what was commanded.
    RobotOff,
    /// Skin, camera or light moved between repetitions.
    RigMoved,
    /// No single cause explains it.
    Unknown,
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
}
