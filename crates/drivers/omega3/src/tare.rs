//! The tare: mean motor force of an arm at rest, subtracted from all later readings.

use skinrig_model::HostTime;

use crate::config::Trips;
use crate::span::span;

/// Minimum number of readings.
const MIN_READINGS: u32 = 20;

/// A running mean, restarted whenever the force was not steady.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TareAverage {
    since: HostTime,
    n: u32,
    sum: [f64; 3],
    low: [f64; 3],
    high: [f64; 3],
}

impl TareAverage {
    /// Starts at `now`.
    pub(crate) const fn begin(now: HostTime) -> Self {
        Self {
            since: now,
            n: 0,
            sum: [0.0; 3],
            low: [f64::INFINITY; 3],
            high: [f64::NEG_INFINITY; 3],
        }
    }

    /// Adds a new reading. Returns the mean, N, once it was steady for long enough.
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
        let long = now - self.since >= span(trips.tare) && self.n >= MIN_READINGS;
        long.then(|| self.sum.map(|sum| sum / f64::from(self.n)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_starts_after_the_force_has_settled() {
        let trips = Trips::default();
        let mut average = TareAverage::begin(HostTime::ZERO);
        let mut found = None;
        for ms in 1..2000 {
            let force = if ms < 400 {
                0.01 * f64::from(400 - ms)
            } else {
                0.1
            };
            let t = HostTime(i64::from(ms) * 1_000_000);
            if let Some(mean) = average.add(t, [0.0, force, 0.0], &trips) {
                found = Some((ms, mean[1]));
                break;
            }
        }
        let (ms, mean) = found.unwrap();
        assert!((650..=720).contains(&ms), "{ms}");
        assert!((mean - 0.1).abs() < 0.15, "{mean}");
    }
}
