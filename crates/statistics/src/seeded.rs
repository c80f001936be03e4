//! Seeded random numbers: the only randomness of an analysis.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A generator for stream `stream` of `seed`. Streams are independent of each other and of their number.
pub fn generator(seed: u64, stream: u64) -> Xoshiro256PlusPlus {
    // The odd constant is 2^64 / golden ratio (Weyl sequence of SplitMix64); it separates neighbouring streams.
    Xoshiro256PlusPlus::seed_from_u64(seed ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Uniform in `0..n` (multiply-shift; the bias is below n / 2^64). 0 when `n` is 0.
pub fn index(rng: &mut Xoshiro256PlusPlus, n: usize) -> usize {
    ((u128::from(rng.next_u64()) * n as u128) >> 64) as usize
}

/// Uniform in `-1.0..1.0`.
pub fn signed_unit(rng: &mut Xoshiro256PlusPlus) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
