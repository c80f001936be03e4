//! The detector: a one-sided CUSUM (Page 1954) on Poisson counts, tuned to a rate increase.

/// Minimum number of events assumed in a background. Without this floor, the first event after a silent background is a
/// detection.
const MIN_EVENTS: f64 = 0.5;

/// Rate of a background of `events` in `length_s` (above 0), events per second.
///
/// Divides by the length of the *window*, with at least half an event. (The public code divides by the time between the
/// first and the last event, which is 0 for simultaneous events and undefined for a single one.)
#[must_use]
pub fn background_rate_per_s(events: u64, length_s: f64) -> f64 {
    (events as f64).max(MIN_EVENTS) / length_s
}

/// Each bin with x counts adds the log-likelihood ratio of `alpha` times the background rate to the background rate, x
/// ln(alpha) - (alpha - 1) lambda0 dt; the sum never falls below 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cusum {
    gain: f64,
    loss: f64,
    consecutive: usize,
}

impl Cusum {
    /// A detector of an `alpha`-fold (above 1) increase over `rate_per_s` that requires `consecutive` bins (at least 1) in a
    /// row at or above the threshold.
    #[must_use]
    pub(crate) fn new(alpha: f64, rate_per_s: f64, bin_s: f64, consecutive: u32) -> Self {
        Self {
            gain: libm::log(alpha),
            loss: (alpha - 1.0) * rate_per_s * bin_s,
            consecutive: consecutive.max(1) as usize,
        }
    }

    /// The sum after adding a bin of `x` (smoothed) counts.
    fn step(&self, sum: f64, x: f64) -> f64 {
        (sum + (x * self.gain - self.loss)).max(0.0)
    }

    /// First bin of the first run at or above each of `thresholds` (ascending), in one pass: the sum does not depend on the
    /// threshold, and a run at a higher threshold never begins before the first at a lower one.
    #[must_use]
    pub(crate) fn onsets(&self, smoothed: &[f64], thresholds: &[f64]) -> Vec<Option<usize>> {
        let mut found = vec![None; thresholds.len()];
        let mut open = 0;
        let mut sum = 0.0;
        let mut last = vec![0.0; self.consecutive];
        let mut slots = (0..self.consecutive).cycle();
        for (bin, (x, slot)) in smoothed.iter().zip(&mut slots).enumerate() {
            sum = self.step(sum, *x);
            last[slot] = sum;
            let Some(threshold) = thresholds.get(open) else {
                break;
            };
            if sum < *threshold || bin + 1 < self.consecutive {
                continue;
            }
            let lowest = last.iter().copied().fold(f64::INFINITY, f64::min);
            while thresholds.get(open).is_some_and(|h| lowest >= *h) {
                found[open] = Some(bin + 1 - self.consecutive);
                open += 1;
            }
        }
        found
    }
}
