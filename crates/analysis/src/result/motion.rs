//! Owns the result on robot motion: distance between measured and commanded position.

use serde::{Deserialize, Serialize};
use skinrig_model::PressId;

/// Measured path of the tip compared with the commanded one. Distances are Euclidean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Pose samples with finite positions.
    pub samples: u64,
    /// Ignored pose samples without finite positions.
    pub broken: u64,
    /// Root mean square distance between measured and commanded position over all samples, mm.
    pub rms_mm: f64,
    /// Largest distance, mm.
    pub max_mm: f64,
    /// Width of a bin, s.
    pub bin_s: f64,
    /// Distances over the session; bins without samples are missing.
    pub course: Vec<MotionBin>,
    /// Path during a few presses.
    pub presses: Vec<PressMotion>,
}

/// One bin of the course.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotionBin {
    /// Host time of its left edge, s.
    pub start_s: f64,
    /// Root mean square distance, mm.
    pub rms_mm: f64,
    /// Largest distance, mm.
    pub max_mm: f64,
}

/// Path of the tip during one press, from the start of the approach until it is clear again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PressMotion {
    /// Press.
    pub press: PressId,
    /// Every n-th sample is kept, which leaves a few hundred.
    pub kept_each: u32,
    /// In time order.
    pub samples: Vec<TipSample>,
}

/// One sample of the path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TipSample {
    /// Time since measured contact, s.
    pub since_contact_s: f64,
    /// Commanded position (x, y, z) in the skin frame, mm.
    pub commanded_mm: [f64; 3],
    /// Measured position, mm.
    pub measured_mm: [f64; 3],
}
