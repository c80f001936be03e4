//! Owns the parameters of a calibration: names, order, mapping to a camera geometry.

use nalgebra::SVector;
use skinrig_model::{CalibrationModel, StereoGeometry};

/// Two positions, two skews, two distortions, two scales of the field of view.
pub(crate) const PARAMETERS: usize = 10;

/// All parameters; a nested model moves only the first 4, 6, 8 or 10.
pub(super) type Parameters = SVector<f64, PARAMETERS>;

/// Names, in order.
pub(super) const NAMES: [&str; PARAMETERS] = [
    "camera 1 x (mm)",
    "camera 1 y (mm)",
    "camera 2 x (mm)",
    "camera 2 y (mm)",
    "camera 1 skew (deg)",
    "camera 2 skew (deg)",
    "camera 1 distortion W (1)",
    "camera 2 distortion W (1)",
    "camera 1 field of view scale (1)",
    "camera 2 field of view scale (1)",
];

/// Largest perturbation of a start: mm for positions, degrees for skews, 1 for distortions and scales. About half the widths
/// of the public code's search box (positions 5 to 10 mm, skews 5 degrees, W 1).
pub(crate) const SPREAD: [f64; PARAMETERS] = [8.0, 8.0, 8.0, 8.0, 4.0, 4.0, 0.4, 0.4, 0.1, 0.1];

/// Largest plausible distance of a solution from the start, mm.
const FARTHEST_MM: f64 = 60.0;
/// Largest plausible skew, degrees.
const MAX_SKEWED_DEG: f64 = 45.0;

/// The nested models, smallest first.
pub(super) const MODELS: [CalibrationModel; 4] = [
    CalibrationModel::Positions,
    CalibrationModel::PositionsSkews,
    CalibrationModel::Full,
    CalibrationModel::FullScale,
];

/// Number of parameters that a model fits; for `Auto`, the maximum.
#[must_use]
pub const fn parameter_count(model: CalibrationModel) -> usize {
    match model {
        CalibrationModel::None => 0,
        CalibrationModel::Positions => 4,
        CalibrationModel::PositionsSkews => 6,
        CalibrationModel::Full => 8,
        CalibrationModel::FullScale | CalibrationModel::Auto => PARAMETERS,
    }
}

/// (x1, y1, x2, y2, skew 1, skew 2, W 1, W 2, scale 1, scale 2); scales are relative to the geometry itself: 1.
pub(crate) fn parameters_of(geometry: &StereoGeometry) -> Parameters {
    let [a, b] = &geometry.cameras;
    Parameters::from([
        a.position.x_mm,
        a.position.y_mm,
        b.position.x_mm,
        b.position.y_mm,
        a.skew_deg,
        b.skew_deg,
        a.lens.coefficients().1,
        b.lens.coefficients().1,
        1.0,
        1.0,
    ])
}

/// `base` with these parameters.
pub(crate) fn with_parameters(base: &StereoGeometry, p: &Parameters) -> StereoGeometry {
    let mut geometry = *base;
    for (k, camera) in geometry.cameras.iter_mut().enumerate() {
        camera.position.x_mm = p[2 * k];
        camera.position.y_mm = p[2 * k + 1];
        camera.skew_deg = p[4 + k];
        let half_fov_deg = camera.lens.coefficients().0 * p[8 + k];
        camera.lens = camera.lens.with(half_fov_deg, p[6 + k]);
    }
    geometry
}

/// True if `p` is a plausible calibration of the nominal rig `base`: positions within 60 mm of it, skews below 45 degrees,
/// lenses in their monotone range.
pub(crate) fn is_plausible(base: &StereoGeometry, p: &Parameters) -> bool {
    let start = parameters_of(base);
    let geometry = with_parameters(base, p);
    p.iter().all(|v| v.is_finite())
        && (0..4).all(|i| (p[i] - start[i]).abs() <= FARTHEST_MM)
        && p[4].abs().max(p[5].abs()) < MAX_SKEWED_DEG
        && geometry.cameras.iter().all(|c| c.lens.is_monotone())
}
