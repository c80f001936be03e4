//! Owns what a calibration reports: parameters with their uncertainty, the models that were compared, the threshold.

use serde::{Deserialize, Serialize};
use skinrig_model::{CalibrationModel, LensKind, StereoGeometry};

use super::Estimate;

/// A calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationResult {
    /// The model that was fitted, never `Auto`.
    pub model: CalibrationModel,
    /// The lens that was fitted.
    pub lens: LensKind,
    /// Where it started.
    pub start: StereoGeometry,
    /// Names of the fitted parameters.
    pub names: Vec<String>,
    /// The values they started from.
    pub start_values: Vec<f64>,
    /// Their values.
    pub values: Vec<f64>,
    /// Their standard errors; `None` where the data do not determine them.
    pub standard_errors: Vec<Option<f64>>,
    /// Correlation of each pair of parameters, row by row; `None` where one of them is not determined.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Condition number of the Jacobian with columns scaled to unit length; `None` when it is rank-deficient.
    pub condition: Option<f64>,
    /// Directions in parameter space that the data determine; below the number of parameters: rank-deficient.
    pub rank: u32,
    /// RMSE over the calibrating presses before, mm.
    pub rmse_before_mm: f64,
    /// And after, mm. Always at least as optimistic as the scored RMSE.
    pub rmse_after_mm: f64,
    /// Calibrating presses used.
    pub n: u32,
    /// Presses whose residual the robust loss reduced to less than half of its weight.
    pub outliers: u32,
    /// Starts of the multi-start, and how many of them ended in the best optimum (within 1e-6 mm of its RMSE).
    pub starts: u32,
    /// See `starts`.
    pub starts_agreeing: u32,
    /// Why the optimiser stopped.
    pub termination: String,
    /// The models compared by leave-locations-out cross-validation, smallest first; empty when there was no choice
    /// or too few locations for one.
    pub compared: Vec<ModelComparison>,
}

/// One model of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelComparison {
    /// The model.
    pub model: CalibrationModel,
    /// Its parameters.
    pub parameters: u32,
    /// Cross-validated RMSE with its interval over locations, mm; the value is `None` when it could not be fitted.
    pub rmse_mm: Estimate,
    /// Its standard error over locations, mm.
    pub standard_error_mm: Option<f64>,
    /// RMSE over the presses that it was fitted to, mm.
    pub fitted_rmse_mm: Option<f64>,
    /// True for the one that is used.
    pub chosen: bool,
}

/// How the least number of cluster events was chosen on the calibrating presses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThresholdChoice {
    /// The threshold, events in the weaker camera.
    pub events: u32,
    /// What a press left out costs, mm: the error of an answer that knows nothing.
    pub penalty_mm: f64,
    /// Calibrating presses, and how many of them the threshold leaves out.
    pub n: u32,
    /// See `n`.
    pub left_out: u32,
    /// (threshold, root mean square cost in mm) of the candidates, ascending; thinned to at most 60.
    pub candidates: Vec<(u32, f64)>,
}
