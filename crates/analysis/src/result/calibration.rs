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
    /// Where the comparison bounds errors, mm: five robust standard deviations of one coordinate of the most accurate model's
    /// errors, at least 1 mm. `None` without a comparison.
    #[serde(default)]
    pub bound_mm: Option<f64>,
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
    /// The same with every error bounded at [`CalibrationResult::bound_mm`], mm: what the models are compared by.
    #[serde(default)]
    pub bounded_rmse_mm: Option<f64>,
    /// How it did against the model in hand when its turn came; `None` for the smallest one, and where it could not be
    /// validated.
    #[serde(default)]
    pub test: Option<ModelTest>,
    /// RMSE over the presses that it was fitted to, mm.
    pub fitted_rmse_mm: Option<f64>,
    /// True for the one that is used.
    pub chosen: bool,
}

/// One step of the choice of a model: paired by location, errors bounded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ModelTest {
    /// The model in hand: the smallest, or the last one that was better than what was in hand before it.
    pub against: CalibrationModel,
    /// Bounded error of the one in hand less that of this one, mm. Above 0: this one is better.
    pub gain_mm: f64,
    /// Standard error of the gain over locations, mm.
    pub standard_error_mm: f64,
    /// Gain over standard error; 0 when the gain is below 1e-6 mm.
    pub ratio: f64,
    /// The ratio from which this model replaces the one in hand: Student's t at a level of 0.3 shared by all
    /// comparisons, one degree of freedom less than locations.
    pub needed: f64,
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
    /// How often a threshold gains as much as the best one by chance: by presses whose errors have nothing to do with their
    /// cluster events. The best one is taken below 0.05. `None` when no threshold gains anything.
    #[serde(default)]
    pub chance: Option<f64>,
    /// (threshold, root mean square cost in mm) of the candidates, ascending; thinned to at most 60.
    pub candidates: Vec<(u32, f64)>,
}
