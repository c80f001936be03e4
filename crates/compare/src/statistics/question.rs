//! Owns what is asked of two samples: which direction is better, the margin, and how sure the answer must be.

use serde::{Deserialize, Serialize};

use super::refusal::Refusal;

/// Which direction of a metric is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Better {
    /// The lower the better: errors, latencies, false alarms, bytes.
    Lower,
    /// The higher the better: rates of success, taxels, response.
    Higher,
    /// The nearer to zero the better: bias.
    NearerZero,
}

/// What is asked of one metric.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Question {
    /// Which direction is better.
    pub better: Better,
    /// Differences smaller than this do not matter, in the unit of the metric; `None`: never equivalent.
    pub margin: Option<f64>,
}

/// Which locations of two samples are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pairing {
    /// Those that both have, each against itself.
    #[default]
    SharedLocations,
    /// All of each, as independent draws: for skins that cannot be pressed at the same places.
    Independent,
}

/// How sure, and how.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Probability of a false claim that is put up with: of a difference when there is none, and of equivalence when the
    /// difference is as large as the margin. Intervals cover 1 - alpha.
    pub alpha: f64,
    /// Power that [`super::Needed`] asks for.
    pub power: f64,
    /// Which locations.
    pub pairing: Pairing,
    /// Draws of the bootstrap, where one is used.
    pub resamples: u32,
    /// Its seed.
    pub seed: u64,
}

impl Default for Settings {
    /// 5 %, a power of 80 %, shared locations, 3999 draws, seed 1.
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

impl Question {
    pub(super) fn check(&self) -> Result<(), Refusal> {
        match self.margin {
            Some(margin) if !(margin > 0.0 && margin.is_finite()) => {
                Err(Refusal::setting("margin", "a number above 0", margin))
            }
            _ => Ok(()),
        }
    }
}

impl Settings {
    pub(super) fn check(&self) -> Result<(), Refusal> {
        if !(self.alpha > 0.0 && self.alpha < 0.5) {
            let expected = "a probability between 0 and 0.5";
            return Err(Refusal::setting("alpha", expected, self.alpha));
        }
        if !(self.power > 0.0 && self.power < 1.0) {
            let expected = "a probability between 0 and 1";
            return Err(Refusal::setting("power", expected, self.power));
        }
        // An interval leaves at least one draw outside on each side.
        if (f64::from(self.resamples) + 1.0) * 0.5 * self.alpha < 1.0 {
            let expected = format!("{:.0} at the least", (2.0 / self.alpha).ceil());
            return Err(Refusal::setting(
                "resamples",
                &expected,
                f64::from(self.resamples),
            ));
        }
        Ok(())
    }
}
