//! A percentile of times with misses, and its limits.

use super::scores;

/// A percentile of times with misses.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Percentile {
    pub value: f64,
    /// Rank, 0..1.
    pub q: f64,
    /// Times, ascending; misses are infinite.
    pub sorted: Vec<f64>,
    /// Effective number of independent trials.
    pub effective: f64,
}

impl Percentile {
    /// Limits at `c` standard errors; infinite where misses begin or trials end.
    pub(super) fn limits(&self, c: f64) -> (f64, f64) {
        let (low, high) = scores::wilson(self.q, self.effective, c);
        (self.at(low), self.at(high))
    }

    /// Number of missed trials.
    pub(super) fn missed(&self) -> u32 {
        let times = self.sorted.partition_point(|t| t.is_finite());
        (self.sorted.len() - times) as u32
    }

    /// Time at rank `p` by the mean rank of order statistics (type 6 of Hyndman and Fan 1996); infinite beyond the first and
    /// the last.
    fn at(&self, p: f64) -> f64 {
        let position = p * (self.sorted.len() as f64 + 1.0) - 1.0;
        if position < 0.0 {
            return f64::NEG_INFINITY;
        }
        let index = position.floor() as usize;
        let time = |i: usize| self.sorted.get(i).copied().unwrap_or(f64::INFINITY);
        between(time(index), time(index + 1), position - index as f64)
    }
}

/// Interpolates from `low` to `high`, which may be infinite.
pub(super) fn between(low: f64, high: f64, share: f64) -> f64 {
    if share > 0.0 && low < high {
        low + share * (high - low)
    } else {
        low
    }
}
