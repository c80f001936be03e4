//! Owns the spread between sessions: what mounting, light and calibration add to a difference, the same for every location.

use serde::{Deserialize, Serialize};

use super::influence::variance;
use crate::distributions::student_quantile;

/// Most sessions of each skin that [`SessionSpread::enough`] considers.
const MAX_SESSIONS: u32 = 100;

/// Uncertainty of a difference that comes from having few sessions. The variance between the sessions of a skin is taken to be the
/// same for both skins, so that a skin with one session borrows it from the other. It includes what presses and locations scatter,
/// which the interval over locations includes as well: intervals are wider than necessary rather than narrower.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SessionSpread {
    /// Variance between sessions of one skin, in squared units of the metric.
    pub between: f64,
    /// Its degrees of freedom.
    pub df: f64,
    /// Sessions of A and B.
    pub sessions: [u32; 2],
}

impl SessionSpread {
    /// From the values of the metric in the sessions of A and B; `None` if neither has two.
    pub(super) fn of(values: [&[f64]; 2]) -> Option<Self> {
        let free = values.map(|v| v.len().saturating_sub(1) as f64);
        let df = free[0] + free[1];
        let squares = free[0] * variance(values[0]) + free[1] * variance(values[1]);
        (df > 0.0).then(|| Self {
            between: squares / df,
            df,
            sessions: values.map(|v| v.len().max(1) as u32),
        })
    }

    /// Standard error that this spread alone gives the difference.
    pub(super) fn error(&self) -> f64 {
        let [a, b] = self.sessions.map(f64::from);
        (self.between * (1.0 / a + 1.0 / b)).sqrt()
    }

    /// Half of the two-sided interval with coverage 1 - `alpha` that this spread alone gives the difference.
    pub(super) fn half_width(&self, alpha: f64) -> f64 {
        student_quantile(1.0 - 0.5 * alpha, self.df) * self.error()
    }

    /// Sessions of each skin with which a `distance` from a limit decides, if this spread is the true one: more than now. `times`:
    /// standard errors from the limit at these degrees of freedom; `rest`: what the interval over locations takes of the distance.
    pub(super) fn enough(
        &self,
        distance: f64,
        rest: f64,
        times: impl Fn(f64) -> f64,
    ) -> Option<u32> {
        let [a, b] = self.sessions;
        (a.max(b) + 1..=MAX_SESSIONS).find(|each| {
            let n = f64::from(*each);
            let own = times(2.0 * n - 2.0) * (2.0 * self.between / n).sqrt();
            libm::hypot(rest, own) <= distance
        })
    }
}
