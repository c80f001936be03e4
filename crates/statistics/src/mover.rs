//! Limits of a difference from the limits of its parts (MOVER).

use super::influence::{InferenceData, Measure, error};
use super::percentile::Percentile;
use super::scores;

/// Confidence limits of one metric at a given number of standard errors.
pub(super) enum Limits {
    /// Share and effective number of independent trials.
    Share(f64, f64),
    /// Events and exposure of a Poisson process with the same uncertainty.
    Rate(f64, f64),
    /// Percentile of times.
    Percentile(Percentile),
    /// Distance between two percentiles, and the correlation of their estimates.
    Width(Percentile, Percentile, f64),
    /// Value and standard error.
    Plain(f64, f64),
}

impl Limits {
    /// Limits of `measure`; without any event it takes the overdispersion of `other`.
    pub(super) fn of(measure: &Measure, other: Option<&Measure>) -> Self {
        let error_of = |of: &Measure| error(&of.totals());
        match &measure.shape {
            InferenceData::Ratio(_) => Self::Plain(measure.value, error_of(measure)),
            InferenceData::Share(trials) => {
                let (p, n) = (measure.value, f64::from(*trials));
                let worth = scores::effective(p, n, error_of(measure), measure.locations());
                Self::Share(p, worth)
            }
            InferenceData::Counts(events, exposure, _) => {
                let effect = |of: &Measure| match of.shape {
                    InferenceData::Counts(events, exposure, _) => {
                        scores::overdispersion(events, exposure, error_of(of))
                    }
                    _ => None,
                };
                let effect = effect(measure).or_else(|| effect(other?)).unwrap_or(1.0);
                Self::Rate(f64::from(*events) / effect, exposure / effect)
            }
            InferenceData::Percentile(at) => Self::Percentile(at.clone()),
            InferenceData::Width(low, high, together) => {
                Self::Width(low.clone(), high.clone(), *together)
            }
        }
    }

    /// Limits at `c` standard errors; infinite where open.
    pub(super) fn at(&self, c: f64) -> (f64, f64) {
        match self {
            Self::Share(p, trials) => scores::wilson(*p, *trials, c),
            Self::Rate(events, exposure) => scores::poisson(*events, *exposure, c),
            Self::Percentile(at) => at.limits(c),
            Self::Width(low, high, together) => mover_limits(
                (low.value, low.limits(c)),
                (high.value, high.limits(c)),
                *together,
            ),
            Self::Plain(value, error) => (value - c * error, value + c * error),
        }
    }
}

/// Limits of `b - a` from (value, limits) of each (MOVER, method of variance estimates recovery, Zou and Donner 2008). For
/// two shares this is the hybrid score method of Newcombe 1998; for paired ones, with their correlation.
pub(super) fn mover_limits(
    a: (f64, (f64, f64)),
    b: (f64, (f64, f64)),
    correlation: f64,
) -> (f64, f64) {
    let distance = |x: f64, y: f64| {
        if x.is_infinite() || y.is_infinite() {
            return f64::INFINITY;
        }
        (x * x + y * y - 2.0 * correlation * x * y).max(0.0).sqrt()
    };
    let difference = b.0 - a.0;
    let low = difference - distance(b.0 - b.1.0, a.1.1 - a.0);
    let high = difference + distance(b.1.1 - b.0, a.0 - a.1.0);
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_shares_get_the_hybrid_score_interval() {
        // Newcombe 1998 (Stat Med 17:873), method 10: 56/70 - 48/80 gives 0.0524 to 0.3339.
        let limits = |r: f64, n: f64| (r / n, scores::wilson(r / n, n, 1.959_964));
        let (low, high) = mover_limits(limits(48.0, 80.0), limits(56.0, 70.0), 0.0);
        assert!(
            (low - 0.0524).abs() < 5e-5 && (high - 0.3339).abs() < 5e-5,
            "{low} {high}"
        );
    }
}
