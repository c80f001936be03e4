//! Random choice of events for thinning.

use std::collections::BTreeSet;

use rand_xoshiro::Xoshiro256PlusPlus;

use skinrig_statistics::seeded;

/// Indices of the kept events out of `n` at factor `factor` (at least 1): n / factor of them, rounded, ties to even (public
/// code), without replacement, ascending. Floyd's method (Bentley and Floyd 1987): one random number per kept event.
#[must_use]
pub fn choose_events(n: usize, factor: u32, rng: &mut Xoshiro256PlusPlus) -> Vec<usize> {
    let keep = ((n as f64 / f64::from(factor.max(1))).round_ties_even() as usize).min(n);
    let mut retained = BTreeSet::new();
    for last in n - keep..n {
        let pick = seeded::index(rng, last + 1);
        if !retained.insert(pick) {
            retained.insert(last);
        }
    }
    retained.into_iter().collect()
}
