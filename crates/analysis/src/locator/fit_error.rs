//! Owns the reasons for which a locator cannot learn, or not be made from its serialised form.

use serde::{Deserialize, Serialize};

use crate::calibrate::PARAMETERS;
use crate::with_text::with_text;

/// Why a method could not be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(remote = "Self", tag = "kind", rename_all = "snake_case")]
pub enum FitError {
    /// Too few calibration locations.
    #[error("it needs {needed} calibration locations, found {found}")]
    Locations {
        /// Required number.
        needed: u32,
        /// Number of the set.
        found: u32,
    },
    /// The calibration locations lie on a line or a conic.
    #[error("the calibration locations lie on a line or a curve; spread them over the skin")]
    Line,
    /// The kernel is not positive definite, or the residuals are not finite.
    #[error("the residuals of the calibration presses determine no field")]
    Degenerate,
}

with_text!(FitError);

/// Why a serialised locator gives none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LocatorModelError {
    /// A covariance has another size than the parameters of the geometry.
    #[error("expected covariances of {n} by {n}, found another size", n = PARAMETERS)]
    CovarianceSize,
    /// Fields without a prior, a prior without fields, or a polynomial for one camera only.
    #[error("expected fields and polynomials for both cameras, with a prior, or for none")]
    Incomplete,
    /// The prior or the kernel of a field is not positive definite, or its residuals are not finite.
    #[error("expected a prior and fields of positive variance, found singular ones")]
    Singular,
}
