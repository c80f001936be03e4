//! Owns the reasons for which a locator cannot learn.

use serde::{Deserialize, Serialize};

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
