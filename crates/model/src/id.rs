//! Identifiers: which camera, which planned press, which attempt at it.

use std::fmt;

use serde::{Deserialize, Serialize};

/// One of the two event cameras. The paper's camera 1 sits at negative y, camera 2 at positive y of the
/// skin's right edge (paper, section "Geometric Triangulation").
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum CameraId {
    /// Camera 1.
    #[serde(rename = "camera1")]
    One,
    /// Camera 2.
    #[serde(rename = "camera2")]
    Two,
}

impl CameraId {
    /// Both cameras, in order.
    pub const ALL: [Self; 2] = [Self::One, Self::Two];

    /// 0 for camera 1, 1 for camera 2: the position in per-camera arrays.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::One => 0,
            Self::Two => 1,
        }
    }

    /// The number that people use: 1 or 2.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.index() as u8 + 1
    }

    /// The camera with the number 1 or 2.
    #[must_use]
    pub const fn from_number(number: i64) -> Option<Self> {
        match number {
            1 => Some(Self::One),
            2 => Some(Self::Two),
            _ => None,
        }
    }
}

impl fmt::Display for CameraId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "camera {}", self.number())
    }
}

/// A planned press: its position in the plan, counted from 0, sync presses included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PressId(pub u32);

impl fmt::Display for PressId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "press {}", self.0)
    }
}

/// One attempt at a planned press. The first is number 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct AttemptId {
    /// The planned press.
    pub press: PressId,
    /// 1 for the first attempt.
    pub number: u32,
}

impl fmt::Display for AttemptId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (attempt {})", self.press, self.number)
    }
}
