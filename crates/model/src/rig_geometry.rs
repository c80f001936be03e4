//! Owns the geometry of a rig as an analysis needs it.

use serde::{Deserialize, Serialize};

use crate::camera::StereoGeometry;
use crate::skin::SkinOutline;

/// Rig geometry for an analysis: part of `RunHeader::rig_json`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RigGeometry {
    /// The skin's outline.
    pub outline: SkinOutline,
    /// The nominal (drawn or measured, not calibrated) camera geometry: the start of the calibration.
    pub nominal: StereoGeometry,
    /// The camera trigger channel that carries the marks; `None` without a trigger line.
    pub trigger_channel: Option<u8>,
    /// Delay per camera from an edge at its trigger input to its time stamp, whole µs; 0 if not measured.
    #[serde(default)]
    pub trigger_delay_us: [u16; 2],
}
