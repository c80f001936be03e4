//! Owns what the reference-code mode reports: the public code's numbers, computed without its wrong roots.

use serde::{Deserialize, Serialize};

/// The published way of judging: on the presses that calibrated, inside the enclosing square only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceCode {
    /// Presses used: all of the first repetition, whatever their role.
    pub presses: u32,
    /// False when they determine no plausible geometry: the nominal one judges, and the numbers say nothing about the skin.
    pub calibrated: bool,
    /// The parameters of its calibration, by name: positions in mm, skews in degrees, distortions without unit; empty when
    /// it was not calibrated.
    #[serde(default)]
    pub parameters: Vec<(String, f64)>,
    /// How many have two centroids.
    pub with_centroids: u32,
    /// How many of those have their estimate in the enclosing square.
    pub inside: u32,
    /// RMSE of those inside, mm.
    pub rmse_mm: Option<f64>,
    /// Along x, mm.
    pub rmse_x_mm: Option<f64>,
    /// Along y, mm.
    pub rmse_y_mm: Option<f64>,
    /// Population standard deviation of the error lengths, mm.
    pub std_of_errors_mm: Option<f64>,
    /// The published data reduction.
    pub reduction: Vec<ReferenceReduction>,
}

/// The published data reduction at one factor: mean over seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReferenceReduction {
    /// k.
    pub factor: u32,
    /// RMSE of all presses with an estimate, mm.
    pub rmse_mm: Option<f64>,
    /// Share of all presses whose error is strictly below the 95th percentile at factor 1; a press without an
    /// estimate counts with the largest error found, which can pass.
    pub pass_rate: f64,
    /// The same with presses without an estimate failing.
    pub honest_pass_rate: f64,
}
