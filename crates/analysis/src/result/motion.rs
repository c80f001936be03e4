//! Owns what is said of the robot's path: how far the tip was from where it was told to be.

use serde::{Deserialize, Serialize};
use skinrig_model::PressId;

/// The measured path of the tip against the commanded one. Distances are Euclidean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Pose samples with finite positions.
    pub samples: u64,
    /// Pose samples without: they are in no number here.
    pub broken: u64,
    /// Root mean square distance between measured and commanded position over all samples, mm.
    pub rms_mm: f64,
    /// The largest distance, mm.
    pub max_mm: f64,
    /// Width of a bin of the course, s.
    pub bin_s: f64,
    /// The course over the session; bins without a sample are missing.
    pub course: Vec<MotionBin>,
    /// The path during a few presses.
    pub presses: Vec<PressMotion>,
}

/// One bin of the course.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotionBin {
    /// Host time of its left edge, s.
    pub start_s: f64,
    /// Root mean square distance, mm.
    pub rms_mm: f64,
    /// The largest distance, mm.
    pub max_mm: f64,
}

/// The path of the tip during one press, from the beginning of the approach until it is clear again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PressMotion {
    /// Which press.
    pub press: PressId,
    /// Every n-th sample is kept, so that a few hundred are left.
    pub kept_each: u32,
    /// In order of time.
    pub samples: Vec<TipSample>,
}

/// One sample of the path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TipSample {
    /// Since the measured contact, s.
    pub since_contact_s: f64,
    /// Commanded position (x, y, z) in the skin frame, mm.
    pub commanded_mm: [f64; 3],
    /// Measured position, mm.
    pub measured_mm: [f64; 3],
}
