//! The test behind the charts: so many nights in a row on one side of a limit, and how long it runs before it raises a false alarm.
//!
//! The run is what makes it hold: however heavy the tail of a metric, one odd night or two raise nothing. Its mean run length has a
//! closed form: W. Feller, An Introduction to Probability Theory and Its Applications, volume 1, third edition, section XIII.7.

use serde::Serialize;

/// Nights in a row that make a large change: it is found in as many.
pub const QUICK: usize = 3;
/// Nights in a row that make a smaller one.
pub(crate) const SLOW: usize = 9;

/// So many nights in a row beyond a limit raise an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rule {
    /// In a row.
    pub nights: usize,
    /// Scores beyond this count, on one side.
    pub limit: f64,
}

impl Rule {
    /// The rule that raises one false alarm in `every` nights when `series` charts with two sides each follow it, all together.
    #[must_use]
    pub fn of(nights: usize, series: usize, every: f64) -> Self {
        let wanted = every * 2.0 * series.max(1) as f64;
        let (mut low, mut high) = (0.0, 8.0);
        for _ in 0..60 {
            let limit = f64::midpoint(low, high);
            if (Self { nights, limit }).mean_run_length(0.0) < wanted {
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

    /// Mean number of nights until it raises an alarm on one side, when scores are normal about `shift` and know nothing of each
    /// other.
    #[must_use]
    pub fn mean_run_length(self, shift: f64) -> f64 {
        let beyond = 0.5 * libm::erfc((self.limit - shift) / std::f64::consts::SQRT_2);
        let all = beyond.powf(self.nights as f64);
        if beyond >= 1.0 {
            return self.nights as f64;
        }
        (1.0 - all) / ((1.0 - beyond) * all)
    }

    /// Whether the last of `scores` make an alarm above the centre (`sign` 1) or below it (-1).
    #[must_use]
    pub fn speaks(self, scores: &[f64], sign: f64) -> bool {
        let last = scores
            .len()
            .checked_sub(self.nights)
            .map(|at| &scores[at..]);
        last.is_some_and(|last| last.iter().all(|z| sign * z > self.limit))
    }
}

/// The rules of a bench with so many series: the quick one raises one false alarm in `every` nights. The slow one has a hundredth of
/// that, for nights resemble their neighbours, and what does so makes long runs by itself.
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
        // A fair coin: three heads in a row take 14 throws in the mean, nine take 1022.
        let coin = |nights| Rule { nights, limit: 0.0 };
        assert!((coin(3).mean_run_length(0.0) - 14.0).abs() < 1e-9);
        assert!((coin(9).mean_run_length(0.0) - 1022.0).abs() < 1e-6);
        assert!((coin(3).mean_run_length(50.0) - 3.0).abs() < 1e-9);
    }

    #[test]
    fn a_rule_gives_the_run_length_it_was_asked_for_and_nothing_less_than_all_nights_speak() {
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
        assert!(rule.speaks(&[0.0, 2.1, 9.0, 2.1], 1.0));
        assert!(!rule.speaks(&[0.0, 9.0, 9.0], 1.0) && !rule.speaks(&[9.0, 9.0], 1.0));
        assert!(rule.speaks(&[-3.0; 3], -1.0) && !rule.speaks(&[-3.0; 3], 1.0));
    }
}
