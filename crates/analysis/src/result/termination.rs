//! Owns the reasons for which the optimiser of a calibration stops.

use serde::{Deserialize, Serialize};

/// Why the optimiser stopped. In JSON its text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Termination {
    /// The error is flat here.
    #[serde(rename = "converged: the gradient is zero")]
    ZeroGradient,
    /// Further steps change the error by less than the tolerance.
    #[serde(rename = "converged: the error does not change any more")]
    NoChange,
    /// Further steps change the error by less than floating point can express.
    #[serde(rename = "converged to the resolution of floating point")]
    FloatingPoint,
    /// The error is infinite or NaN.
    #[serde(rename = "not converged: the error is not a number")]
    NotANumber,
    /// The equations of a step have no solution.
    #[serde(rename = "not converged: no step can be computed")]
    NoStep,
    /// The maximum number of steps was made.
    #[serde(rename = "not converged: too many steps")]
    TooManySteps,
}

impl Termination {
    /// Whether the optimiser found a minimum.
    #[must_use]
    pub const fn is_converged(self) -> bool {
        matches!(
            self,
            Self::ZeroGradient | Self::NoChange | Self::FloatingPoint
        )
    }

    /// Text for reports.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::ZeroGradient => "converged: the gradient is zero",
            Self::NoChange => "converged: the error does not change any more",
            Self::FloatingPoint => "converged to the resolution of floating point",
            Self::NotANumber => "not converged: the error is not a number",
            Self::NoStep => "not converged: no step can be computed",
            Self::TooManySteps => "not converged: too many steps",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_holds_the_text() {
        for reason in [
            Termination::ZeroGradient,
            Termination::NoChange,
            Termination::FloatingPoint,
            Termination::NotANumber,
            Termination::NoStep,
            Termination::TooManySteps,
        ] {
            let json = serde_json::to_value(reason).unwrap();
            assert_eq!(json, reason.text());
            assert_eq!(
                reason.is_converged(),
                reason.text().starts_with("converged")
            );
        }
    }
}
