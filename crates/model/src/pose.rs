//! Samples of the robot's pose, commanded and measured, in the skin frame.

use serde::{Deserialize, Serialize};

use crate::frame::{Point3, Skin};
use crate::time::HostTime;

/// One sample of the pose stream (at least 1 kHz of rig time).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PoseSample {
    /// Time of the measurement.
    pub t: HostTime,
    /// The set point at that time, skin frame, mm.
    pub commanded: Point3<Skin>,
    /// The measured tip position, skin frame, mm.
    pub measured: Point3<Skin>,
    /// Force on the tip along the skin's normal as reported by the device, N; positive pushes the tip out.
    /// `NaN` if the device does not measure or estimate it.
    #[serde(with = "crate::number")]
    pub force_n: f64,
}
