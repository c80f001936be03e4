//! The force with which the motors carry an arm that hangs still: it is subtracted from every later reading.

use skinrig_model::HostTime;

use crate::config::Trips;
use crate::span::span;

/// Fewest readings of a mean.
const READINGS: u32 = 20;

/// A mean under way; begins anew whenever the force has not been steady.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Weighing {
    since: HostTime,
    n: u32,
    sum: [f64; 3],
    low: [f64; 3],
    high: [f64; 3],
}

impl Weighing {
    /// Begins at `now`.
    pub(crate) const fn begin(now: HostTime) -> Self {
        Self {
            since: now,
            n: 0,
            sum: [0.0; 3],
            low: [f64::INFINITY; 3],
            high: [f64::NEG_INFINITY; 3],
        }
    }

    /// Adds a new reading. Gives the mean, N, when it was steady for long enough.
    pub(crate) fn add(
        &mut self,
        now: HostTime,
        force_n: [f64; 3],
        trips: &Trips,
    ) -> Option<[f64; 3]> {
        self.n += 1;
        for (i, f) in force_n.into_iter().enumerate() {
            self.sum[i] += f;
            self.low[i] = self.low[i].min(f);
            self.high[i] = self.high[i].max(f);
        }
        let steady = (0..3).all(|i| self.high[i] - self.low[i] <= trips.max_tare_spread_n);
        if !steady {
            *self = Self::begin(now);
            return None;
        }
        let long = now - self.since >= span(trips.tare) && self.n >= READINGS;
        long.then(|| self.sum.map(|sum| sum / f64::from(self.n)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_that_settles_is_weighed_after_it_settled() {
        let trips = Trips::default();
        let mut weighing = Weighing::begin(HostTime::ZERO);
        let mut found = None;
        for ms in 1..2000 {
            let force = if ms < 400 {
                0.01 * f64::from(400 - ms)
            } else {
                0.1
            };
            let t = HostTime(i64::from(ms) * 1_000_000);
            if let Some(mean) = weighing.add(t, [0.0, force, 0.0], &trips) {
                found = Some((ms, mean[1]));
                break;
            }
        }
        let (ms, mean) = found.unwrap();
        assert!((650..=720).contains(&ms), "{ms}");
        assert!((mean - 0.1).abs() < 0.15, "{mean}");
    }
}
