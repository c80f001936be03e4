//! Event rates: a streamed histogram in fine bins, and the reduced series that a report draws.

use skinrig_model::{AnalysisSettings, CdEvent};

use crate::result::{ClockFit, RateSeries};

/// Maximum number of fine bins: 46 hours of 10 ms. A longer stream has broken times.
const MAX_BINS: u64 = 1 << 24;
/// Bins that clocks, silences and the audit use, µs, as in the paper: `rate_bin_ms` changes what is drawn and nothing else.
const FIXED_BIN_US: u64 = 10_000;
/// Maximum number of bins in a [`RateSeries`].
const MAX_SERIES: usize = 4000;

/// Event counts of a camera: in fixed bins, and in the bins that are drawn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CameraRates {
    fixed: RateHistogram,
    /// If its bins are others.
    drawn: Option<RateHistogram>,
}

impl CameraRates {
    /// No counts yet.
    pub(crate) fn new(settings: &AnalysisSettings) -> Self {
        let bin_us = drawn_bin_us(settings);
        Self {
            fixed: RateHistogram::new(FIXED_BIN_US),
            drawn: (bin_us != FIXED_BIN_US).then(|| RateHistogram::new(bin_us)),
        }
    }

    /// Counts events in time order.
    pub(crate) fn add_in_order(&mut self, events: &[CdEvent]) {
        self.fixed.add_in_order(events);
        if let Some(drawn) = &mut self.drawn {
            drawn.add_in_order(events);
        }
    }

    /// Counts in bins that no setting changes.
    pub(crate) const fn fixed(&self) -> &RateHistogram {
        &self.fixed
    }

    /// Counts in bins of `rate_bin_ms`.
    pub(crate) fn drawn(&self) -> &RateHistogram {
        self.drawn.as_ref().unwrap_or(&self.fixed)
    }
}

/// Width of a drawn bin in whole µs, at least 1.
pub(crate) fn drawn_bin_us(settings: &AnalysisSettings) -> u64 {
    (settings.rate_bin_ms * 1e3).round().max(1.0) as u64
}

/// Event counts in equal bins of camera time, growing with the stream.
#[derive(Debug, Clone, PartialEq)]
pub struct RateHistogram {
    bin_us: u64,
    first_bin: u64,
    counts: Vec<u32>,
    /// Left edge of the last bin used, and its index: most events are in the same bin as their predecessor.
    last_us: u64,
    last: usize,
    beyond: u64,
}

impl RateHistogram {
    /// An empty histogram with bins of `bin_us` (at least 1).
    #[must_use]
    pub const fn new(bin_us: u64) -> Self {
        Self {
            bin_us: if bin_us == 0 { 1 } else { bin_us },
            first_bin: 0,
            counts: Vec::new(),
            last_us: 0,
            last: 0,
            beyond: 0,
        }
    }

    /// Counts an event at camera time `t_us`. Times may be out of order.
    pub fn add(&mut self, t_us: u64) {
        self.add_many(t_us, 1);
    }

    /// Counts events in time order.
    pub(crate) fn add_in_order(&mut self, events: &[CdEvent]) {
        let mut rest = events;
        while let Some(first) = rest.first() {
            let end_us = (first.t_us - first.t_us % self.bin_us).saturating_add(self.bin_us);
            let same_bin = rest.partition_point(|e| e.t_us < end_us).max(1);
            self.add_many(first.t_us, same_bin);
            rest = &rest[same_bin..];
        }
    }

    /// Counts `n` events in the bin of camera time `t_us`.
    fn add_many(&mut self, t_us: u64, n: usize) {
        let elsewhere = t_us.wrapping_sub(self.last_us) >= self.bin_us || self.counts.is_empty();
        if elsewhere && !self.seek(t_us / self.bin_us) {
            self.beyond += n as u64;
            return;
        }
        let count = &mut self.counts[self.last];
        let fitting = n.min((u32::MAX - *count) as usize);
        *count += fitting as u32;
        self.beyond += (n - fitting) as u64;
    }

    /// Makes `bin` the current one; false if that would exceed [`MAX_BINS`].
    fn seek(&mut self, bin: u64) -> bool {
        if self.counts.is_empty() {
            self.first_bin = bin;
        }
        // Compares last bins instead of ends: the last bin of 64 bits has no end.
        let last = self.first_bin + (self.counts.len() as u64).saturating_sub(1);
        let (low, high) = (bin.min(self.first_bin), bin.max(last));
        if high - low >= MAX_BINS {
            return false;
        }
        if low < self.first_bin {
            let missing = (self.first_bin - low) as usize;
            self.counts.splice(0..0, std::iter::repeat_n(0, missing));
            self.first_bin = low;
        }
        self.counts.resize((high - low) as usize + 1, 0);
        self.last = (bin - self.first_bin) as usize;
        self.last_us = bin * self.bin_us;
        true
    }

    /// Width of a bin, µs.
    #[must_use]
    pub(crate) const fn bin_us(&self) -> u64 {
        self.bin_us
    }

    /// Camera time of the first bin's left edge, µs.
    #[must_use]
    pub const fn start_us(&self) -> u64 {
        self.first_bin * self.bin_us
    }

    /// The counts.
    #[must_use]
    pub fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// Ignored events: too far from the others in time, or in a full bin (2^32 - 1).
    #[must_use]
    pub const fn beyond(&self) -> u64 {
        self.beyond
    }

    /// The series in at most 4000 bins; on the host clock if there is a fit.
    #[must_use]
    pub fn series(&self, clock: Option<&ClockFit>) -> RateSeries {
        if self.counts.is_empty() {
            return RateSeries::default();
        }
        let merge = self.counts.len().div_ceil(MAX_SERIES);
        let camera_s = self.start_us() as f64 * 1e-6;
        let fine_s = self.bin_us as f64 * 1e-6;
        let (start_s, stretch) = clock.map_or((camera_s, 1.0), |c| {
            (
                c.host_us_of_camera(self.start_us() as f64) * 1e-6,
                1.0 / (1.0 + c.drift_ppm * 1e-6),
            )
        });
        let bins = self.counts.chunks(merge);
        let mean = |bin: &[u32]| {
            let sum: u64 = bin.iter().map(|c| u64::from(*c)).sum();
            (sum as f64 / (fine_s * bin.len() as f64)) as f32
        };
        let peak =
            |bin: &[u32]| (f64::from(bin.iter().copied().max().unwrap_or(0)) / fine_s) as f32;
        RateSeries {
            start_s,
            bin_s: fine_s * merge as f64 * stretch,
            mean_per_s: bins.clone().map(mean).collect(),
            peak_per_s: bins.map(peak).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_survive_disorder_huge_times_and_thinning() {
        let base = 1u64 << 44;
        let mut h = RateHistogram::new(10_000);
        let times: Vec<u64> = (0..50_000u64)
            .map(|i| base + (i * 7919) % 89_990_000)
            .collect();
        times.iter().for_each(|t| h.add(*t));
        assert_eq!(
            h.counts().iter().map(|c| u64::from(*c)).sum::<u64>(),
            50_000
        );
        for t in [base + 12, base + 5_000_000] {
            let in_bin = |x: &&u64| **x / 10_000 == t / 10_000;
            let bin = (t / 10_000 - h.start_us() / 10_000) as usize;
            assert_eq!(
                h.counts()[bin] as usize,
                times.iter().filter(in_bin).count()
            );
        }
        let series = h.series(None);
        assert!(series.mean_per_s.len() <= 4000 && series.mean_per_s.len() > 2000);
        let last = h.counts().len() % 3;
        assert_eq!(last, 0, "the check of the sum below needs full bins");
        let events: f64 = series
            .mean_per_s
            .iter()
            .map(|r| f64::from(*r) * series.bin_s)
            .sum();
        assert!((events - 50_000.0).abs() < 0.1);
        h.add(base + (1 << 43));
        assert_eq!(h.beyond(), 1);
        assert_eq!(
            h.counts().iter().map(|c| u64::from(*c)).sum::<u64>(),
            50_000
        );
    }

    #[test]
    fn empty_input_gives_empty_output() {
        assert_eq!(
            RateHistogram::new(10_000).series(None),
            RateSeries::default()
        );
    }
}
