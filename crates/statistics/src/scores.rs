//! Score limits of shares and count rates, for the effective number of independent trials.
//!
//! Trials at one location tend to fail together. Dividing their number by the design effect (Rao and Scott 1992; Korn and
//! Graubard 1998) gives the number of independent trials with the same uncertainty.

/// Limits of a share `p` of `n` trials at `c` standard errors (Wilson 1927).
pub(super) fn wilson(p: f64, n: f64, c: f64) -> (f64, f64) {
    let square = c * c / n;
    let centre = p + 0.5 * square;
    let half = (square * (p * (1.0 - p) + 0.25 * square)).sqrt();
    let end = |v: f64| (v / (1.0 + square)).clamp(0.0, 1.0);
    (end(centre - half), end(centre + half))
}

/// Effective number of independent trials: those whose share `p` has this standard error, at most `n`. A share of 0 or 1 has
/// no spread, so each location counts once.
pub(super) fn effective(p: f64, n: f64, error: f64, locations: usize) -> f64 {
    if p <= 0.0 || p >= 1.0 {
        return (locations as f64).min(n);
    }
    let variance = error * error;
    if variance * n <= p * (1.0 - p) {
        return n;
    }
    (p * (1.0 - p) / variance).max(1.0)
}

/// Limits of a rate of `events` per unit of `exposure` at `c` standard errors: score interval of a Poisson mean (Rao 1948;
/// compared by Barker 2002).
pub(super) fn poisson(events: f64, exposure: f64, c: f64) -> (f64, f64) {
    let centre = events + 0.5 * c * c;
    let half = c * (events + 0.25 * c * c).sqrt();
    (
        (centre - half).max(0.0) / exposure,
        (centre + half) / exposure,
    )
}

/// Overdispersion of counts relative to a Poisson process (design effect), at least 1; `None` without events.
pub(super) fn overdispersion(events: u32, exposure: f64, error: f64) -> Option<f64> {
    let variance = f64::from(events) / (exposure * exposure);
    (events > 0).then(|| (error * error / variance).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_the_published_ones() {
        // Newcombe 1998 (Stat Med 17:857), method 3: 81/263, 15/148, 0/20, 1/29.
        for (r, n, low, high) in [
            (81.0, 263.0, 0.2553, 0.3662),
            (15.0, 148.0, 0.0624, 0.1605),
            (0.0, 20.0, 0.0, 0.1611),
            (1.0, 29.0, 0.0061, 0.1718),
        ] {
            let (l, h) = wilson(r / n, n, 1.959_964);
            assert!((l - low).abs() < 5e-5 && (h - high).abs() < 5e-5, "{l} {h}");
        }
        let (low, high) = poisson(0.0, 2.0, 1.959_964);
        assert!(low == 0.0 && (high - 1.9207).abs() < 1e-4, "{high}");
    }

    #[test]
    fn clustered_trials_are_worth_less() {
        // Ten locations with five trials each: five all successful, five all failed.
        let totals: Vec<f64> = (0..10)
            .map(|i| if i % 2 == 0 { 0.05 } else { -0.05 })
            .collect();
        let worth = effective(0.5, 50.0, crate::influence::error(&totals), 10);
        assert!((worth - 9.0).abs() < 1e-9, "{worth}");
        assert_eq!(effective(1.0, 50.0, 0.0, 10), 10.0);
        assert_eq!(effective(0.5, 50.0, 0.0, 10), 50.0);
    }
}
