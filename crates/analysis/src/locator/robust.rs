//! Scales and weights that outliers move little, and how the number of events changes the scatter of a column.

use crate::sets::CalibrationPress;

/// Degrees of freedom of the weights of outliers.
const FREEDOM: f64 = 4.0;
/// Median of the absolute value of a standard normal number.
const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;
/// Smallest scale.
pub(super) const LEAST: f64 = 1e-4;

/// Weight of an observation of `dimensions` numbers with this squared error in units of its variance, as for Student's t with
/// 4 degrees of freedom; at most 1.
pub(super) fn weight(square: f64, dimensions: f64) -> f64 {
    student_weight(square, dimensions).min(1.0)
}

/// The same without a limit, as the most likely variance requires.
pub(crate) fn student_weight(square: f64, dimensions: f64) -> f64 {
    (FREEDOM + dimensions) / (FREEDOM + square)
}

/// Logarithm of the density of `dimensions` numbers with this squared error in units of their variance, as for Student's t
/// with 4 degrees of freedom, up to a constant.
pub(crate) fn log_density(square: f64, dimensions: f64) -> f64 {
    -0.5 * (FREEDOM + dimensions) * libm::log1p(square / FREEDOM)
}

/// Robust standard deviation of numbers about zero, at least [`LEAST`].
pub(super) fn scale(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    (median / NORMAL_MEDIAN).max(LEAST)
}

/// Column variance of a press with this many cluster events relative to one with the median number.
pub(super) fn response(cluster_events: u32, reference_events: f64) -> f64 {
    reference_events / f64::from(cluster_events.max(1))
}

/// Median cluster events, at least 1.
pub(super) fn reference_events(presses: &[CalibrationPress]) -> f64 {
    let mut events: Vec<u32> = presses.iter().map(|p| p.cluster_events).collect();
    events.sort_unstable();
    f64::from(events.get(events.len() / 2).copied().unwrap_or(1).max(1))
}
