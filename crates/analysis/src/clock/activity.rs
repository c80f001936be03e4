//! Owns the activity of a camera over its recording: event rate on a scale from idle to pressed.

use super::error::RatesError;
use super::span::PressSpan;
use crate::rates::RateHistogram;

/// Rate per bin, scaled to 0..=1.
pub(super) struct Activity {
    pub(super) bin_us: f64,
    /// One value per bin, 0 (idle) to 1 (pressed).
    pub(super) values: Vec<f64>,
}

impl Activity {
    pub(super) fn new(rates: &RateHistogram, presses: &[PressSpan]) -> Result<Self, RatesError> {
        let bin_us = rates.bin_us() as f64;
        // Square roots make Poisson noise equal at all rates.
        let roots: Vec<f64> = rates
            .counts()
            .iter()
            .map(|c| f64::from(*c).sqrt())
            .collect();
        let total_us = roots.len() as f64 * bin_us;
        let pressed_us: f64 = presses.iter().map(|p| p.release_us - p.contact_us).sum();
        let share = (pressed_us / total_us).clamp(0.0, 0.8);
        // Half of the idle bins are below `low`, a quarter of the pressed ones above `high`.
        let low = crate::metrics::quantile(&mut roots.clone(), 0.5 * (1.0 - share)).unwrap_or(0.0);
        let high = crate::metrics::quantile(&mut roots.clone(), 1.0 - 0.25 * share).unwrap_or(0.0);
        if high - low < 0.5 {
            return Err(RatesError::Flat);
        }
        let values: Vec<f64> = roots
            .iter()
            .map(|r| ((r - low) / (high - low)).clamp(0.0, 1.0))
            .collect();
        Ok(Self { bin_us, values })
    }

    pub(super) fn length_us(&self) -> f64 {
        self.values.len() as f64 * self.bin_us
    }

    /// Mean activity in each of `n` adjacent bin-wide intervals, the first about `t_us`. Intervals split bins consistently;
    /// outside the recording activity is 0.
    pub(super) fn samples(&self, t_us: f64, n: usize) -> impl Iterator<Item = f64> {
        let at = t_us / self.bin_us - 0.5;
        let first = at.floor();
        let part = at - first;
        let first = first as i64;
        let value = move |i: i64| {
            let i = usize::try_from(i).ok();
            i.and_then(|i| self.values.get(i)).copied().unwrap_or(0.0)
        };
        let mut left = value(first);
        (1..=n as i64).map(move |k| {
            let right = value(first.saturating_add(k));
            let mean = left + part * (right - left);
            left = right;
            mean
        })
    }
}
