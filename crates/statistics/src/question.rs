//! Owns the parameters of a comparison: direction, margin and certainty.

use serde::{Deserialize, Serialize};

use super::error::ComparisonError;

/// Direction in which a metric improves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImprovementDirection {
    /// Lower is better: errors, latencies, false alarms, bytes.
    Lower,
    /// Higher is better: success rates, taxels, response.
    Higher,
    /// Nearer to zero is better: bias.
    NearerZero,
}

/// Parameters of the comparison of one metric.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ComparisonTarget {
    /// Direction in which the metric improves.
    pub better: ImprovementDirection,
    /// Equivalence margin in the unit of the metric; `None`: never equivalent.
    pub margin: Option<f64>,
}

/// Which locations are compared, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pairing {
    /// Shared locations, pairwise.
    #[default]
    SharedLocations,
    /// All locations of each skin, as independent samples: for skins that cannot be pressed at the same locations.
    Independent,
}

/// Statistical settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Accepted probability of a false claim: of a difference when there is none, and of equivalence when the difference
    /// equals the margin. Intervals cover 1 - alpha.
    pub alpha: f64,
    /// Power for [`super::PressesNeeded`].
    pub power: f64,
    /// Which locations are compared.
    pub pairing: Pairing,
    /// Bootstrap draws.
    pub resamples: u32,
    /// Seed of the bootstrap.
    pub seed: u64,
}

impl Default for Settings {
    /// Alpha 5 %, power 80 %, shared locations, 3999 draws, seed 1.
    fn default() -> Self {
        Self {
            alpha: 0.05,
            power: 0.8,
            pairing: Pairing::SharedLocations,
            resamples: 3999,
            seed: 1,
        }
    }
}

impl ComparisonTarget {
    pub(super) fn check(&self) -> Result<(), ComparisonError> {
        match self.margin {
            Some(margin) if !(margin > 0.0 && margin.is_finite()) => Err(ComparisonError::setting(
                "margin",
                "a number above 0",
                margin,
            )),
            _ => Ok(()),
        }
    }
}

impl Settings {
    pub(super) fn check(&self) -> Result<(), ComparisonError> {
        if !(self.alpha > 0.0 && self.alpha < 0.5) {
            let expected = "a probability between 0 and 0.5";
            return Err(ComparisonError::setting("alpha", expected, self.alpha));
        }
        if !(self.power > 0.0 && self.power < 1.0) {
            let expected = "a probability between 0 and 1";
            return Err(ComparisonError::setting("power", expected, self.power));
        }
        // At least one draw must lie outside the interval on each side.
        if (f64::from(self.resamples) + 1.0) * 0.5 * self.alpha < 1.0 {
            let expected = format!("at least {:.0}", (2.0 / self.alpha).ceil());
            return Err(ComparisonError::setting(
                "resamples",
                &expected,
                f64::from(self.resamples),
            ));
        }
        Ok(())
    }
}
