//! Seeded random numbers that are equal on every machine: integer generators, and few transcendental functions, from `libm`.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Purpose of a random stream. Each purpose has its own stream, so that they do not influence each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Deviation of the simulated rig from its nominal geometry.
    Geometry = 1,
    /// The robot's settling and measurement noise.
    Robot = 2,
    /// The trigger box.
    TriggerBox = 3,
    /// Offset, drift and trigger jitter of camera 1 (camera 2: the next).
    CameraClock = 10,
    /// Pixels of camera 1 (camera 2: the next).
    Pixels = 20,
    /// Properties of contacts, by location and number.
    Contacts = 30,
    /// Properties of the skin and its light, which both cameras see.
    Skin = 40,
}

/// Seed of a stream: mixes `seed` and purpose (SplitMix64's finaliser); `index` distinguishes instances.
#[must_use]
pub(crate) const fn derive_seed(seed: u64, purpose: Purpose, index: u64) -> u64 {
    let mut z = seed
        .wrapping_add((purpose as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15))
        .wrapping_add(index.wrapping_mul(0xd1b5_4a32_d192_ed03));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Stream(Xoshiro256PlusPlus);

impl Stream {
    /// Stream for `purpose`.
    #[must_use]
    pub fn new(seed: u64, purpose: Purpose, index: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(derive_seed(
            seed, purpose, index,
        )))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Mean 0, standard deviation 1: the sum of four uniform numbers. Nearly normal, within ±3.47, without transcendental functions.
    pub(crate) fn gauss(&mut self) -> f64 {
        let b = self.bits();
        let sum = (b & 0xffff) + ((b >> 16) & 0xffff) + ((b >> 32) & 0xffff) + (b >> 48);
        // Sum of four uniform integers 0..=65535: mean 2 * 65535, variance 4 (65536^2 - 1) / 12.
        (sum as f64 - 131_070.0) * (1.0 / 37_837.227_214_0)
    }

    /// Exponential with mean 1: distance of consecutive events of a Poisson process with rate 1.
    pub fn exponential(&mut self) -> f64 {
        -libm::log(1.0 - self.unit())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_promised() {
        let mut s = Stream::new(7, Purpose::Robot, 0);
        let n = 200_000;
        let (mut g, mut g2, mut e, mut e2) = (0.0, 0.0, 0.0, 0.0);
        for _ in 0..n {
            let (x, y) = (s.gauss(), s.exponential());
            g += x;
            g2 += x * x;
            e += y;
            e2 += y * y;
        }
        let n = f64::from(n);
        assert!((g / n).abs() < 0.01, "{}", g / n);
        assert!((g2 / n - 1.0).abs() < 0.01, "{}", g2 / n);
        assert!((e / n - 1.0).abs() < 0.01, "{}", e / n);
        assert!((e2 / n - 2.0).abs() < 0.05, "{}", e2 / n);
    }

    #[test]
    fn streams_differ_by_seed_purpose_and_index() {
        let first = |s, p, i| Stream::new(s, p, i).bits();
        let all = [
            first(1, Purpose::Robot, 0),
            first(2, Purpose::Robot, 0),
            first(1, Purpose::Pixels, 0),
            first(1, Purpose::Robot, 1),
        ];
        for (i, a) in all.iter().enumerate() {
            assert!(all[i + 1..].iter().all(|b| a != b));
        }
    }
}
