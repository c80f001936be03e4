//! Keeps one event in k at random, independent of the order of arrival.

use skinrig_model::{CameraId, CdEvent, Polarity};

/// Bernoulli thinning with a hash of the event as its coin: the decision does not depend on how the stream is split or which
/// window asks. Events with equal time, pixel and polarity share one decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Thinning {
    key: u64,
    /// Kept if the hash is at most this.
    limit: u64,
}

impl Thinning {
    /// Keeps each event with probability `1 / factor` (all for 0 and 1); cameras and seeds are independent.
    #[must_use]
    pub fn new(factor: u32, camera: CameraId, seed: u64) -> Self {
        Self {
            key: mixed(seed ^ mixed(camera.index() as u64)),
            limit: u64::MAX / u64::from(factor.max(1)),
        }
    }

    /// True if every event is kept.
    #[must_use]
    pub(crate) fn keeps_all(&self) -> bool {
        self.limit == u64::MAX
    }

    /// True if the event is kept; `event` in camera time.
    #[must_use]
    pub fn keeps(&self, event: &CdEvent) -> bool {
        self.keeps_at(event.t_us, event.x, event.y, event.polarity == Polarity::On)
    }

    /// Same for an event of a view.
    #[must_use]
    pub(crate) fn keeps_at(&self, t_us: u64, x: u16, y: u16, on: bool) -> bool {
        let pixel = u64::from(on) << 32 | u64::from(y) << 16 | u64::from(x);
        self.keeps_all() || mixed(mixed(self.key ^ t_us) ^ pixel) <= self.limit
    }
}

/// Output function of SplitMix64 (Steele, Lea and Flood 2014): every bit of the input changes half of the output.
fn mixed(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_one_in_k_per_camera() {
        let retained = |factor: u32, camera: CameraId, seed: u64| -> Vec<u64> {
            let thinning = Thinning::new(factor, camera, seed);
            let times = (0..100_000u64).map(|i| 7 * i + (1 << 50));
            times
                .filter(|t| thinning.keeps_at(*t, 300, 200, t % 2 == 0))
                .collect()
        };
        assert_eq!(retained(1, CameraId::One, 3).len(), 100_000);
        for factor in [2, 8, 64, 1000] {
            let expected = 1e5 / f64::from(factor);
            let one = retained(factor, CameraId::One, 3);
            // Five standard deviations of a binomial count.
            assert!(
                (one.len() as f64 - expected).abs() < 5.0 * expected.sqrt(),
                "{factor}"
            );
            let both = |other: Vec<u64>| other.iter().filter(|t| one.contains(t)).count() as f64;
            let chance = expected / f64::from(factor);
            assert!(both(retained(factor, CameraId::Two, 3)) < chance + 5.0 * chance.sqrt() + 5.0);
            assert!(both(retained(factor, CameraId::One, 4)) < chance + 5.0 * chance.sqrt() + 5.0);
        }
    }
}
