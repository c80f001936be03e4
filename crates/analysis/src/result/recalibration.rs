//! Owns the result of a recalibration: where the calibration comes from, and how far the skin moved since.

use serde::{Deserialize, Serialize};
use skinrig_model::{CameraId, PressId};

/// The session whose calibration is in use.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct EarlierSession {
    /// Identifier of the session.
    pub session_id: String,
    /// Lower-case hex SHA-256 of its content; `None` for a session that is not sealed.
    pub content_sha256: Option<String>,
    /// Start, civil time, RFC 3339.
    pub started: String,
}

/// A calibration of an earlier session, corrected by a few presses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recalibration {
    /// The earlier session.
    pub from: EarlierSession,
    /// Presses that corrected it.
    pub presses: u32,
    /// Those that count less than a quarter.
    pub outliers: Vec<PressId>,
    /// Shift of skin and cameras along x and y, mm.
    pub shift_mm: [Move; 2],
    /// Turn of skin and cameras about the centre of the outline, degrees, counter-clockwise.
    pub turn_deg: Move,
    /// Moves of the cameras on the skin.
    pub cameras: [CameraMove; 2],
    /// Probability that presses of a skin to which the earlier calibration applies disagree as much, the worst press left out.
    pub chance: f64,
}

/// Move of a camera on the skin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CameraMove {
    /// Shift along x and y, mm.
    pub shift_mm: [Move; 2],
    /// Turn of its axis, degrees, clockwise.
    pub turn_deg: Move,
}

/// One part of a move.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Move {
    /// The most likely value.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Standard deviation before any press, from the settings and the earlier calibration.
    pub expected: f64,
}

impl Move {
    /// Its size in standard deviations before any press.
    #[must_use]
    pub fn sigmas(&self) -> f64 {
        (self.value / self.expected).abs()
    }
}

/// Names of the parts of a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "part", rename_all = "snake_case")]
pub enum RemountPart {
    /// Shift of the whole along x.
    #[error("shift along x (mm)")]
    ShiftX,
    /// Shift of the whole along y.
    #[error("shift along y (mm)")]
    ShiftY,
    /// Turn of the whole.
    #[error("turn (degrees)")]
    Turn,
    /// Shift of a camera along x.
    #[error("shift of {camera} along x (mm)")]
    CameraShiftX {
        /// The camera.
        camera: CameraId,
    },
    /// Shift of a camera along y.
    #[error("shift of {camera} along y (mm)")]
    CameraShiftY {
        /// The camera.
        camera: CameraId,
    },
    /// Turn of a camera.
    #[error("turn of {camera} (degrees)")]
    CameraTurn {
        /// The camera.
        camera: CameraId,
    },
}
