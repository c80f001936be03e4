//! Run rule of the control charts: a number of consecutive scores beyond a limit, and its mean run length to a false alarm.
//!
//! Runs are robust: one or two outliers never raise an alarm, whatever the tails of a metric. The mean run length has a closed form:
//! W. Feller, An Introduction to Probability Theory and Its Applications, volume 1, third edition, section XIII.7.

use serde::Serialize;

/// Run length that detects a large change, nights.
pub const QUICK: usize = 3;
/// Run length that detects a smaller change, nights.
pub(crate) const SLOW: usize = 9;

/// Raises an alarm after a number of consecutive scores beyond a limit on the same side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rule {
    /// Length of the run.
    pub nights: usize,
    /// Scores beyond this limit count.
    pub limit: f64,
}

impl Rule {
    /// The rule with one false alarm per `every` nights, for `series` two-sided charts together.
    #[must_use]
    pub fn of(nights: usize, series: usize, every: f64) -> Self {
        let required = every * 2.0 * series.max(1) as f64;
        let (mut low, mut high) = (0.0, 8.0);
        for _ in 0..60 {
            let limit = f64::midpoint(low, high);
            if (Self { nights, limit }).mean_run_length(0.0) < required {
                low = limit;
            } else {
                high = limit;
            }
        }
        Self {
            nights,
            limit: high,
        }
    }

    /// Mean number of nights until an alarm on one side, for independent normal scores about `shift`.
    #[must_use]
    pub fn mean_run_length(self, shift: f64) -> f64 {
        let exceedance = 0.5 * libm::erfc((self.limit - shift) / std::f64::consts::SQRT_2);
        let all = libm::pow(exceedance, self.nights as f64);
        if exceedance >= 1.0 {
            return self.nights as f64;
        }
        (1.0 - all) / ((1.0 - exceedance) * all)
    }

    /// Whether the latest scores raise an alarm above the centre (`sign` 1) or below it (-1).
    #[must_use]
    pub(crate) fn raises_alarm(self, scores: &[f64], sign: f64) -> bool {
        let last = scores
            .len()
            .checked_sub(self.nights)
            .map(|at| &scores[at..]);
        last.is_some_and(|last| last.iter().all(|z| sign * z > self.limit))
    }
}

/// Rules for `series` charts. The quick one has one false alarm per `every` nights. The slow one
/// has a hundredth of that rate, because correlated nights produce long runs.
#[must_use]
pub fn rules(series: usize, every: f64) -> [Rule; 2] {
    [
        Rule::of(QUICK, series, every),
        Rule::of(SLOW, series, 100.0 * every),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn run_lengths_are_those_of_runs_of_heads() {
        // Fair coin: the mean wait for three heads in a row is 14 tosses, for nine 1022.
        let coin = |nights| Rule { nights, limit: 0.0 };
        assert!((coin(3).mean_run_length(0.0) - 14.0).abs() < 1e-9);
        assert!((coin(9).mean_run_length(0.0) - 1022.0).abs() < 1e-6);
        assert!((coin(3).mean_run_length(50.0) - 3.0).abs() < 1e-9);
    }

    #[test]
    fn a_rule_has_the_requested_run_length_and_needs_a_complete_run() {
        for series in [1, 80] {
            for (rule, every) in rules(series, 1000.0).into_iter().zip([1e3, 1e5]) {
                let run = rule.mean_run_length(0.0) / (2 * series) as f64;
                assert!((run / every - 1.0).abs() < 1e-6, "{run}");
            }
        }
        let rule = Rule {
            nights: 3,
            limit: 2.0,
        };
        assert!(rule.raises_alarm(&[0.0, 2.1, 9.0, 2.1], 1.0));
        assert!(!rule.raises_alarm(&[0.0, 9.0, 9.0], 1.0) && !rule.raises_alarm(&[9.0, 9.0], 1.0));
        assert!(rule.raises_alarm(&[-3.0; 3], -1.0) && !rule.raises_alarm(&[-3.0; 3], 1.0));
    }
}
