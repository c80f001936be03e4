//! Estimates the night of a change.

use serde::Serialize;

use super::chart::{ChartPoint, Direction};

/// Maximum number of scored nights that are searched.
const MAX_LOOKBACK: usize = 120;
/// Scores are clamped to this, so that a single outlier is not a change.
const MAX_SCORE: f64 = 4.0;
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

/// Estimates the first night of a change toward `way` that lasts until the end of `nights`. Model:
/// scores are normal about zero before the change and about a mean of their own after it. The gain
/// in log-likelihood over no change is half the number of nights after the change times the square
/// of their mean (D. V. Hinkley, Biometrika 57 (1970) 1-17).
pub(super) fn locate(nights: &[ChartPoint], way: Direction) -> ChangeWindow {
    let sign = if way == Direction::Up { 1.0 } else { -1.0 };
    let mut candidates: Vec<(usize, f64)> = Vec::new();
    let (mut sum, mut n) = (0.0, 0.0);
    for night in nights.iter().rev().take(MAX_LOOKBACK) {
        let Some(score) = night.score else { break };
        sum += sign * score.clamp(-MAX_SCORE, MAX_SCORE);
        n += 1.0;
        let gain = if sum > 0.0 {
            sum * sum / (2.0 * n)
        } else {
            0.0
        };
        candidates.push((night.night, gain));
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
