//! Owns the results of reference-code mode: the public code's numbers, computed with exact intersections.

use serde::{Deserialize, Serialize};

/// The published evaluation: on the calibration presses, inside the enclosing square only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceCode {
    /// Presses used: all of the first repetition, whatever their role.
    pub presses: u32,
    /// False if the presses determine no plausible geometry: the nominal one is used, and the numbers do not describe the
    /// skin.
    pub calibrated: bool,
    /// Parameters of its calibration, by name: positions in mm, skews in degrees, distortions without unit; empty if not
    /// calibrated.
    #[serde(default)]
    pub parameters: Vec<(String, f64)>,
    /// Presses with two centroids.
    pub with_centroids: u32,
    /// Presses with two centroids and an estimate in the enclosing square.
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

/// Published data reduction at one factor: mean over seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReferenceReduction {
    /// k.
    pub factor: u32,
    /// RMSE of all presses with an estimate, mm.
    pub rmse_mm: Option<f64>,
    /// Share of all presses with an error strictly below the 95th percentile at factor 1; a press without an estimate counts
    /// with the largest error found, which can pass.
    pub pass_rate: f64,
    /// Same, with presses without an estimate failing.
    pub honest_pass_rate: f64,
}
