//! Estimates the night of a change.

use serde::Serialize;

use super::chart::{ChartPoint, Direction};

/// Maximum number of scored nights that are searched.
const MAX_LOOKBACK: usize = 120;
/// Squares of scores, and of their distances from a mean, count up to that of this: one outlier is not a change.
const MAX_SCORE: f64 = 4.0;
/// Larger scores count as this: by how much the values after a large change differ says nothing of its night.
const LARGEST: f64 = 3.0 * MAX_SCORE;
/// Drop in log-likelihood that bounds the interval: half the 95 % quantile of chi-squared with one
/// degree of freedom.
const LIKELIHOOD_DROP: f64 = 1.92;

/// Estimated first night of a change, with its interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ChangeWindow {
    /// The most likely first night.
    pub likeliest: usize,
    /// The earliest and the latest plausible first night.
    pub nights: [usize; 2],
}

/// Estimates the first night of a change toward `way` that lasts until the end of `nights`. Model: scores are normal about zero
/// before the change and about a mean of their own after it (D. V. Hinkley, Biometrika 57 (1970) 1-17), with squares up to a
/// limit, because of outliers (P. Fearnhead, G. Rigaill, JASA 114 (2019) 169-183). The gain in log-likelihood over no change is half
/// of what the squares lose by the mean.
pub(super) fn locate(nights: &[ChartPoint], way: Direction) -> ChangeWindow {
    let sign = if way == Direction::Up { 1.0 } else { -1.0 };
    let mut candidates: Vec<(usize, f64)> = Vec::new();
    // Scores from a night on, ascending.
    let mut after: Vec<f64> = Vec::new();
    for night in nights.iter().rev().take(MAX_LOOKBACK) {
        let Some(score) = night.score else { break };
        let score = sign * score.clamp(-LARGEST, LARGEST);
        after.insert(after.partition_point(|s| *s < score), score);
        candidates.push((night.night, gain(&after)));
    }
    let best = candidates
        .iter()
        .copied()
        .max_by(|a, b| a.1.total_cmp(&b.1));
    let (likeliest, most) = best.unwrap_or_default();
    let plausible = |f: &&(usize, f64)| f.1 >= most - LIKELIHOOD_DROP;
    let plausible = || candidates.iter().filter(plausible).map(|f| f.0);
    ChangeWindow {
        likeliest,
        nights: [
            plausible().min().unwrap_or(likeliest),
            plausible().max().unwrap_or(likeliest),
        ],
    }
}

/// Gain in log-likelihood of a mean of these scores, ascending and not empty; 0 unless it is positive.
fn gain(scores: &[f64]) -> f64 {
    let median = scores[scores.len() / 2];
    let near = scores.iter().filter(|s| (**s - median).abs() <= MAX_SCORE);
    let (sum, n) = near.fold((0.0, 0.0), |(sum, n), s| (sum + s, n + 1.0));
    let mean = sum / n;
    if mean <= 0.0 {
        return 0.0;
    }
    let square = |x: f64| x.abs().min(MAX_SCORE).powi(2);
    let lost = scores.iter().map(|s| square(*s) - square(s - mean));
    (0.5 * lost.sum::<f64>()).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A large change of the newest nights, after a while in which the series was somewhat high by chance.
    #[test]
    fn a_large_change_is_dated_by_its_size_and_not_by_what_was_high_before() {
        let point = |night: usize, score: f64| ChartPoint {
            night,
            value: score,
            score: Some(score),
        };
        let high = [0.3, -0.4, 1.6, 0.9, 1.8, 1.2, 1.4, 2.0, 1.1, 1.7, 0.8, 1.9];
        let dated = |newest: &[f64]| {
            let scores = high.iter().chain(newest);
            let nights: Vec<ChartPoint> = scores.enumerate().map(|(n, s)| point(n, *s)).collect();
            locate(&nights, Direction::Up)
        };
        for size in [5.0, 30.0, 1e12] {
            let found = dated(&[size, 1.1 * size, 0.9 * size]);
            assert_eq!((found.likeliest, found.nights[1]), (12, 12), "{size}");
            // A night of 1.9 before one of 5 may be the first.
            assert!(found.nights[0] >= 11, "{size}: {found:?}");
        }
        // Chance alone is dated as before, and one outlier at the end is not the change.
        assert_eq!(dated(&[1.5, 1.2, 1.6]).likeliest, 2);
        assert_eq!(dated(&[1.5, 1.2, 30.0]).likeliest, 2);
    }
}
