//! A predicted position with its covariance: distances of errors, ellipses.

use crate::result::Region;

/// Symmetric 2 x 2 matrix: xx, xy, yy.
pub(super) type Covariance = [f64; 3];

/// A position and what is known about its error.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Prediction {
    pub at: [f64; 2],
    pub uncertainty: Option<Uncertainty>,
    pub extrapolated: bool,
}

/// Scatter of a press and uncertainty of the model, kept apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Uncertainty {
    /// Of the crossing of two rays, mm².
    Crossing {
        scatter: Covariance,
        model: Covariance,
    },
    /// Of the position that explains all readings: precision of the prior, 1/mm², and the readings.
    Readings {
        prior: Covariance,
        readings: Box<[ReadingUncertainty; READINGS]>,
    },
}

/// Column of each camera; spreads of columns and rows in camera 1, in camera 2.
pub(super) const READINGS: usize = 6;

/// How well a reading is known; all zero for a missing one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ReadingUncertainty {
    /// Change per mm, px.
    pub slope: [f64; 2],
    /// Weight, below 1 for an outlier.
    pub weight: f64,
    /// Variance from press to press, px².
    pub scatter: f64,
    /// Variance of the expected reading, px².
    pub model: f64,
}

impl Uncertainty {
    /// Covariance of the position with the model's variance multiplied by `inflation`; `None` if degenerate.
    pub(super) fn covariance(&self, inflation: f64) -> Option<Covariance> {
        match self {
            Self::Crossing { scatter, model } => {
                let sum = [0, 1, 2].map(|i| scatter[i] + inflation * model[i]);
                sum.iter().all(|v| v.is_finite()).then_some(sum)
            }
            Self::Readings { prior, readings } => {
                let mut precision = *prior;
                for reading in readings.iter().filter(|r| r.weight > 0.0) {
                    let known = reading.weight / (reading.scatter + inflation * reading.model);
                    let [x, y] = reading.slope;
                    precision[0] += known * x * x;
                    precision[1] += known * x * y;
                    precision[2] += known * y * y;
                }
                inverted(precision)
            }
        }
    }
}

/// Squared Mahalanobis distance of an error; `None` for a degenerate covariance.
pub(super) fn distance(covariance: Covariance, error: [f64; 2]) -> Option<f64> {
    let [xx, xy, yy] = covariance;
    let determinant = xx * yy - xy * xy;
    let [dx, dy] = error;
    let square = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
    (determinant > 0.0 && square.is_finite()).then_some(square.max(0.0))
}

/// The ellipse of this squared size.
pub(super) fn ellipse([xx, xy, yy]: Covariance, factor: f64) -> Option<Region> {
    let (middle, off) = (0.5 * (xx + yy), libm::hypot(0.5 * (xx - yy), xy));
    let variances = [middle + off, middle - off];
    let region = Region {
        semi_axes_mm: variances.map(|v| (v * factor).sqrt()),
        angle_deg: 0.5 * libm::atan2(2.0 * xy, xx - yy).to_degrees(),
    };
    let usable = region
        .semi_axes_mm
        .iter()
        .all(|a| a.is_finite() && *a > 0.0);
    usable.then_some(region)
}

/// Inverse of a symmetric 2 x 2 matrix; `None` unless positive definite.
pub(super) fn inverted([xx, xy, yy]: Covariance) -> Option<Covariance> {
    let determinant = xx * yy - xy * xy;
    let inverse = [yy / determinant, -xy / determinant, xx / determinant];
    (determinant > 0.0 && inverse.iter().all(|v| v.is_finite())).then_some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_holds_what_its_covariance_holds() {
        let covariance = [4.0, 1.2, 1.0];
        let region = ellipse(covariance, 5.0).unwrap();
        assert!(region.semi_axes_mm[0] > region.semi_axes_mm[1] && region.angle_deg > 0.0);
        for error in [[1.0, 0.0], [0.0, 1.0], [3.0, -2.0], [4.4, 1.3]] {
            let reach = distance(covariance, error).unwrap() / 5.0;
            assert!((region.reach(error) - reach).abs() < 1e-12, "{error:?}");
        }
        assert_eq!(distance([1.0, 1.0, 1.0], [1.0, 0.0]), None);
        assert_eq!(ellipse([0.0, 0.0, 0.0], 5.0), None);
    }
}
