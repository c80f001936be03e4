//! Owns the description of a geometry whose parameters and their covariance come from elsewhere.

use nalgebra::DMatrix;
use skinrig_model::{CalibrationModel, StereoGeometry};

use super::parameters::{NAMES, PARAMETERS, parameter_count, parameters_of};
use crate::result::{CalibrationResult, Termination};

/// The calibration that leads from `start` to `values`, with this covariance, without presses. Scales are relative to
/// `start` in the values, to the result in the covariance.
pub(crate) fn standard_fit(
    start: &StereoGeometry,
    model: CalibrationModel,
    values: &[f64; PARAMETERS],
    covariance: &DMatrix<f64>,
) -> CalibrationResult {
    let count = parameter_count(model);
    let errors: Vec<f64> = (0..count)
        .map(|i| covariance[(i, i)].max(0.0).sqrt())
        .collect();
    let correlation = |i: usize, j: usize| {
        let scale = errors[i] * errors[j];
        (scale > 0.0).then(|| (covariance[(i, j)] / scale).clamp(-1.0, 1.0))
    };
    let own = |i: usize| if i < 8 { 1.0 } else { values[i] };
    let known: Vec<usize> = (0..count).filter(|i| errors[*i] > 0.0).collect();
    let scaled = DMatrix::from_fn(known.len(), known.len(), |i, j| {
        correlation(known[i], known[j]).unwrap_or(0.0)
    });
    let split = scaled.symmetric_eigenvalues();
    let condition = (split.max() / split.min()).sqrt();
    CalibrationResult {
        model,
        lens: start.cameras[0].lens.kind(),
        start: *start,
        names: NAMES[..count].iter().map(|n| (*n).to_owned()).collect(),
        start_values: parameters_of(start).as_slice()[..count].to_vec(),
        values: values[..count].to_vec(),
        standard_errors: (0..count).map(|i| Some(errors[i] * own(i))).collect(),
        correlation: (0..count)
            .map(|i| (0..count).map(|j| correlation(i, j)).collect())
            .collect(),
        condition: condition.is_finite().then_some(condition),
        rank: count as u32,
        rmse_before_mm: 0.0,
        rmse_after_mm: 0.0,
        n: 0,
        outliers: 0,
        starts: 0,
        starts_agreeing: 0,
        termination: Termination::NoChange,
        compared: Vec::new(),
        bound_mm: None,
    }
}
