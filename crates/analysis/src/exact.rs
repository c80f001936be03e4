//! Exact 95 % intervals for shares of 0 or 1, where a bootstrap has no spread, and for counts over a time.
//!
//! Resampling outcomes that never (or always) happened gives an interval of zero width.

use skinrig_statistics::distributions::poisson_interval;

/// Probability outside a 95 % interval on each side.
const TAIL: f64 = 0.025;

/// Interval of a share over this many locations (at least one): the exact two-sided binomial interval if the share is 0 or 1
/// (Clopper and Pearson 1934), otherwise `bootstrap`. The presses of a location count as one draw, as in the bootstrap.
pub(crate) fn share(share: f64, locations: usize, bootstrap: (f64, f64)) -> (f64, f64) {
    let end = libm::pow(TAIL, 1.0 / locations as f64);
    if share == 0.0 {
        (0.0, 1.0 - end)
    } else if share == 1.0 {
        (end, 1.0)
    } else {
        bootstrap
    }
}

/// Exact two-sided Poisson interval (Garwood 1936) of a rate per second, for `count` events in `seconds` (above 0).
pub(crate) fn rate_per_s(count: u64, seconds: f64) -> (f64, f64) {
    let (low, high) = poisson_interval(count, TAIL);
    (low / seconds, high / seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_leave_a_fortieth_of_the_chance_outside() {
        const ANY: (f64, f64) = (0.2, 0.4);
        // Published bounds of 0 and of 10 in 10: 30.85 % and 69.15 %; of 0 counts: 3.689.
        let (low, high) = share(0.0, 10, ANY);
        assert!(low == 0.0 && (high - 0.3085).abs() < 5e-5, "{high}");
        let (low, high) = share(1.0, 10, ANY);
        assert!((low - 0.6915).abs() < 5e-5 && high == 1.0, "{low}");
        let (low, high) = rate_per_s(0, 2.0);
        assert!(low == 0.0 && (2.0 * high - 3.689).abs() < 5e-4, "{high}");
        assert_eq!(share(0.3, 10, ANY), ANY);
    }
}
