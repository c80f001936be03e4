//! Owns the result of a calibration: parameters with their uncertainty, compared models, threshold.

use serde::{Deserialize, Serialize};
use skinrig_model::{CalibrationModel, LensKind, StereoGeometry};

use super::{Estimate, PairedTest, Termination};

/// A calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationResult {
    /// The model that was fitted, never `Auto`.
    pub model: CalibrationModel,
    /// The lens that was fitted.
    pub lens: LensKind,
    /// Initial geometry.
    pub start: StereoGeometry,
    /// Names of the fitted parameters.
    pub names: Vec<String>,
    /// Initial values.
    pub start_values: Vec<f64>,
    /// Fitted values.
    pub values: Vec<f64>,
    /// Standard errors; `None` if the data do not determine them.
    pub standard_errors: Vec<Option<f64>>,
    /// Correlation of each pair of parameters, row by row; `None` if one of them is not determined.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Condition number of the Jacobian with columns scaled to unit length; `None` if it is rank-deficient.
    pub condition: Option<f64>,
    /// Number of directions in parameter space that the data determine; rank-deficient if below the number of parameters.
    pub rank: u32,
    /// RMSE over the calibration presses before, mm.
    pub rmse_before_mm: f64,
    /// RMSE over the calibration presses after, mm. Always at least as optimistic as the scored RMSE.
    pub rmse_after_mm: f64,
    /// Calibration presses used.
    pub n: u32,
    /// Presses that the robust loss gives less than half weight.
    pub outliers: u32,
    /// Number of starts, and how many of them found the best optimum (within 1e-6 mm of its RMSE).
    pub starts: u32,
    /// See `starts`.
    pub starts_agreeing: u32,
    /// Why the optimiser stopped.
    pub termination: Termination,
    /// Models compared by leave-locations-out cross-validation, smallest first; empty without a choice, or with too few
    /// locations.
    pub compared: Vec<ModelComparison>,
    /// Bound on errors in the comparison, mm: five robust standard deviations of one coordinate of the most accurate model's
    /// errors, at least 1 mm. `None` without a comparison.
    #[serde(default)]
    pub bound_mm: Option<f64>,
}

/// A model of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelComparison {
    /// The model.
    pub model: CalibrationModel,
    /// Number of parameters.
    pub parameters: u32,
    /// Cross-validated RMSE with its interval over locations, mm; the value is `None` if it could not be fitted.
    pub rmse_mm: Estimate,
    /// Cross-validated RMSE with every error bounded at [`CalibrationResult::bound_mm`], mm: the criterion of the
    /// comparison.
    #[serde(default)]
    pub bounded_rmse_mm: Option<f64>,
    /// Comparison with the current model at its turn; `None` for the smallest model, and for one that could not be
    /// validated.
    #[serde(default)]
    pub test: Option<PairedTest<CalibrationModel>>,
    /// RMSE over its fitted presses, mm.
    pub fitted_rmse_mm: Option<f64>,
    /// True for the model in use.
    pub chosen: bool,
}

/// Choice of the minimum number of cluster events, on the calibration presses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThresholdChoice {
    /// The threshold, events in the weaker camera.
    pub events: u32,
    /// Cost of a rejected press, mm: the error of a blind guess.
    pub penalty_mm: f64,
    /// Number of calibration presses, and how many of them the threshold rejects.
    pub n: u32,
    /// See `n`.
    pub left_out: u32,
    /// p value of the best gain: the probability of such a gain if errors were unrelated to cluster events. The best
    /// threshold is used below 0.05. `None` if no threshold gains anything.
    #[serde(default)]
    pub chance: Option<f64>,
    /// (threshold, root mean square cost in mm) of the candidates, ascending; thinned to at most 60.
    pub candidates: Vec<(u32, f64)>,
}
