//! Owns repeated fits of one camera model to parts of the calibration presses.

use nalgebra::DMatrix;
use skinrig_model::StereoGeometry;

use super::crossval::fitted;
use super::parameters::{PARAMETERS, Parameters, parameters_of};
use crate::result::CalibrationResult;
use crate::sets::CalibrationSet;

/// A camera model, fitted to all presses, that other presses can fit again.
#[derive(Debug, Clone)]
pub(crate) struct Refit {
    start: StereoGeometry,
    count: usize,
    full: Parameters,
}

impl Refit {
    /// The model of a calibration.
    pub(crate) fn new(calibration: &CalibrationResult) -> Self {
        let mut full = parameters_of(&calibration.start);
        for (value, fitted) in full.iter_mut().zip(&calibration.values) {
            *value = *fitted;
        }
        Self {
            start: calibration.start,
            count: calibration.values.len(),
            full,
        }
    }

    /// The geometry that fits `presses`; `None` if there are too few or the fit is not plausible.
    pub(crate) fn geometry(&self, presses: &CalibrationSet) -> Option<StereoGeometry> {
        fitted(presses.sights(), &self.start, self.count, &self.full)
    }
}

/// Covariance of the parameters of the calibrated geometry; scales of the field of view are relative to it. Zero for
/// parameters that the model keeps; `None` if the data leave one open.
pub(crate) fn covariance(calibration: &CalibrationResult) -> Option<DMatrix<f64>> {
    let count = calibration.values.len();
    let errors: Vec<f64> = (0..count)
        .map(|p| {
            let scale = if p < 8 { 1.0 } else { calibration.values[p] };
            Some(calibration.standard_errors.get(p).copied()?? / scale)
        })
        .collect::<Option<_>>()?;
    let mut out = DMatrix::zeros(PARAMETERS, PARAMETERS);
    for p in 0..count {
        for q in 0..count {
            let correlation = if p == q {
                1.0
            } else {
                calibration.correlation.get(p)?.get(q).copied().flatten()?
            };
            out[(p, q)] = correlation * errors[p] * errors[q];
        }
    }
    Some(out)
}
