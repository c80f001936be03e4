//! In which night a series began to be off.

use serde::Serialize;

use super::chart::{Charted, Way};

/// How far back a change is sought, nights with a score.
const BACK: usize = 120;
/// A score counts for no more than this: one odd night is no change.
const MOST: f64 = 4.0;
/// Half the 95 % point of chi-squared with one degree of freedom: what the likelihood may fall short of its largest.
const SHORT: f64 = 1.92;

/// A change, and between which nights it lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Between {
    /// The first night that was off, most likely.
    pub likeliest: usize,
    /// The earliest and the latest night that may have been the first.
    pub nights: [usize; 2],
}

/// The likeliest first night of a stay on this side, over the scores of `nights` to the last one: normal scores about zero before it
/// and about their own mean from it on. The log-likelihood gained over no change is then half the number of nights times the square
/// of the mean (D. V. Hinkley, Biometrika 57 (1970) 1-17).
pub(super) fn locate(nights: &[Charted], way: Way) -> Between {
    let sign = if way == Way::Up { 1.0 } else { -1.0 };
    let mut found: Vec<(usize, f64)> = Vec::new();
    let (mut sum, mut n) = (0.0, 0.0);
    for night in nights.iter().rev().take(BACK) {
        let Some(score) = night.score else { break };
        sum += sign * score.clamp(-MOST, MOST);
        n += 1.0;
        let gained = if sum > 0.0 {
            sum * sum / (2.0 * n)
        } else {
            0.0
        };
        found.push((night.night, gained));
    }
    let best = found.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    let (likeliest, most) = best.unwrap_or_default();
    let may = |f: &&(usize, f64)| f.1 >= most - SHORT;
    let may = || found.iter().filter(may).map(|f| f.0);
    Between {
        likeliest,
        nights: [
            may().min().unwrap_or(likeliest),
            may().max().unwrap_or(likeliest),
        ],
    }
}
