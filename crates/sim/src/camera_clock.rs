//! A simulated camera's own clock: an offset and a constant drift against world time.

use crate::config::CameraClockConfig;
use crate::random::Stream;

/// World time (ns) to camera time (µs), in integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CameraClock {
    /// Camera time at `epoch_ns`, ns.
    origin_ns: i64,
    /// World time at which the camera first started, ns.
    epoch_ns: i64,
    /// Parts per billion by which the camera's clock is fast.
    drift_ppb: i64,
}

impl CameraClock {
    /// Draws origin and drift; the camera starts at world time `epoch_ns`.
    pub fn draw(config: &CameraClockConfig, random: &mut Stream, epoch_ns: i64) -> Self {
        let origin_s = random.between(0.0, config.max_origin_s);
        let drift_ppm = random.between(-config.max_drift_ppm, config.max_drift_ppm);
        Self {
            origin_ns: (origin_s * 1e9) as i64,
            epoch_ns,
            drift_ppb: (drift_ppm * 1e3) as i64,
        }
    }

    /// The camera's time at world time `t_ns`, µs.
    #[must_use]
    pub const fn camera_us(&self, t_ns: i64) -> u64 {
        let passed = t_ns - self.epoch_ns;
        // Whole and broken seconds apart, so that no product leaves 64 bits in any run.
        let (whole, rest) = (passed / 1_000_000_000, passed % 1_000_000_000);
        let drift = whole * self.drift_ppb + rest * self.drift_ppb / 1_000_000_000;
        let ns = self.origin_ns + passed + drift;
        if ns < 0 { 0 } else { ns as u64 / 1_000 }
    }

    /// Parts per billion by which the camera's clock is fast.
    #[must_use]
    pub const fn drift_ppb(&self) -> i64 {
        self.drift_ppb
    }
}
