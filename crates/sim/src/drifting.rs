//! Clock of a simulated camera or trigger box: an offset and a constant drift against world time.

use crate::random::Stream;

/// Converts world time (ns) to a device's time (µs) in integer arithmetic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriftingClock {
    /// The device's time at `epoch_ns`, ns.
    origin_ns: i64,
    /// World time at which the clock had its origin, ns.
    epoch_ns: i64,
    /// Rate deviation, parts per billion; positive is fast.
    drift_ppb: i64,
}

impl DriftingClock {
    /// Draws an origin of 0..`max_origin_s` at world time `epoch_ns`, and a drift of at most `max_drift_ppm` either way.
    pub fn draw(max_origin_s: f64, max_drift_ppm: f64, random: &mut Stream, epoch_ns: i64) -> Self {
        let origin_s = random.between(0.0, max_origin_s);
        let drift_ppm = random.between(-max_drift_ppm, max_drift_ppm);
        Self {
            origin_ns: (origin_s * 1e9) as i64,
            epoch_ns,
            drift_ppb: (drift_ppm * 1e3) as i64,
        }
    }

    /// Device time at world time `t_ns`, µs.
    #[must_use]
    pub(crate) const fn own_us(&self, t_ns: i64) -> u64 {
        let passed = t_ns - self.epoch_ns;
        let ns = self.origin_ns + passed + self.gained_ns(passed);
        if ns < 0 { 0 } else { ns as u64 / 1_000 }
    }

    /// The same clock set forward by `by_us`.
    #[must_use]
    pub(crate) const fn stepped(mut self, by_us: i64) -> Self {
        self.origin_ns += by_us * 1_000;
        self
    }

    /// Deviation from world time after `passed` ns.
    const fn gained_ns(&self, passed: i64) -> i64 {
        // Separate whole seconds and fraction, so that no product exceeds 64 bits in any run.
        let (whole, rest) = (passed / 1_000_000_000, passed % 1_000_000_000);
        whole * self.drift_ppb + rest * self.drift_ppb / 1_000_000_000
    }

    /// World time of a device time span, ns; for spans so short that the square of the drift is negligible.
    #[must_use]
    pub(crate) const fn world_ns(&self, own_ns: i64) -> i64 {
        own_ns - self.gained_ns(own_ns)
    }

    /// Rate deviation, parts per billion; positive is fast.
    #[must_use]
    pub const fn drift_ppb(&self) -> i64 {
        self.drift_ppb
    }
}
