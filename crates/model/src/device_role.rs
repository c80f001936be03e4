//! Roles of devices in a rig.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::id::CameraId;

/// Role of a device in the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeviceRole {
    /// The robot that presses.
    Indenter,
    /// Camera 1.
    Camera1,
    /// Camera 2.
    Camera2,
    /// The box that pulses the trigger line.
    TriggerBox,
}

impl DeviceRole {
    /// The role of `camera`.
    #[must_use]
    pub const fn of_camera(camera: CameraId) -> Self {
        match camera {
            CameraId::One => Self::Camera1,
            CameraId::Two => Self::Camera2,
        }
    }

    /// The name used in sessions.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Indenter => "indenter",
            Self::Camera1 => "camera1",
            Self::Camera2 => "camera2",
            Self::TriggerBox => "trigger_box",
        }
    }
}

impl fmt::Display for DeviceRole {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Indenter => "indenter",
            Self::Camera1 => "camera 1",
            Self::Camera2 => "camera 2",
            Self::TriggerBox => "trigger box",
        })
    }
}
