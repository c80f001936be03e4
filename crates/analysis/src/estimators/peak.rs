//! Peak of the smoothed histogram of columns, with sub-pixel resolution.

use super::{ColumnCounts, ColumnEstimate, Real, column_px};
use crate::press_events::PackedEvent;

/// Cut-off of the kernel in standard deviations; 0.3 % of it is beyond.
const KERNEL_SIGMAS: f64 = 3.0;
/// Minimum standard deviation, bins: a narrower kernel would not reach the neighbours.
const MIN_SIGMA_BINS: f64 = 0.5;

/// Smooths the events per column with a Gaussian whose standard deviation is the clustering radius, and takes the first
/// maximum; a parabola through it and its neighbours gives the position between bins.
#[derive(Debug, Clone)]
pub(crate) struct Peak<R> {
    side_px: u16,
    reach_px: f64,
    columns: ColumnCounts,
    /// Weights at distances 0, 1, ...
    kernel: Vec<R>,
    /// Counts, zero-padded on both sides for the kernel.
    padded: Vec<R>,
    smooth: Vec<R>,
}

impl<R: Real> Peak<R> {
    /// For bins of this side, smoothed by `sigma_px`.
    #[must_use]
    pub(crate) fn new(side_px: u16, sigma_px: f64) -> Self {
        let columns = ColumnCounts::new(side_px);
        let sigma = (sigma_px / f64::from(side_px.max(1))).max(MIN_SIGMA_BINS);
        let radius = (KERNEL_SIGMAS * sigma).ceil() as usize;
        let weight = |k: usize| libm::exp(-0.5 * (k as f64 / sigma) * (k as f64 / sigma));
        let bins = columns.counts().len();
        Self {
            side_px,
            reach_px: sigma_px,
            kernel: (0..=radius).map(|k| R::of(weight(k))).collect(),
            // One more on each side: the parabola uses the neighbours of the first and last bin.
            padded: vec![R::default(); bins + 2 * (radius + 1)],
            smooth: vec![R::default(); bins + 2],
            columns,
        }
    }

    /// See `super::PressEstimator::estimate`.
    pub(crate) fn estimate(&mut self, events: &[PackedEvent]) -> ColumnEstimate {
        self.columns.fill(events);
        if self.columns.events() == 0 {
            return ColumnEstimate::default();
        }
        let radius = self.kernel.len() - 1;
        let bins = self.columns.counts().len();
        let middle = &mut self.padded[radius + 1..radius + 1 + bins];
        for (to, count) in middle.iter_mut().zip(self.columns.counts()) {
            *to = R::of(f64::from(*count));
        }
        self.convolve(radius);
        let mut at = 1;
        for i in 1..=bins {
            if self.smooth[i] > self.smooth[at] {
                at = i;
            }
        }
        let (left, top, right) = (self.smooth[at - 1], self.smooth[at], self.smooth[at + 1]);
        let bend = (top - left) + (top - right);
        let offset = if bend > R::default() {
            R::of(0.5) * (right - left) / bend
        } else {
            R::default()
        };
        let bin = (at - 1) as f64 + offset.wide();
        let column = column_px(bin, self.side_px);
        ColumnEstimate::at(column, self.events_near(bin))
    }

    /// `smooth[i]` is the kernel about bin `i - 1`; both sides are added before weighting, so that a mirrored histogram
    /// gives the bit-identical mirrored curve.
    fn convolve(&mut self, radius: usize) {
        let length = self.smooth.len();
        let centre = &self.padded[radius..radius + length];
        for (to, value) in self.smooth.iter_mut().zip(centre) {
            *to = self.kernel[0] * *value;
        }
        for k in 1..=radius {
            let weight = self.kernel[k];
            let left = &self.padded[radius - k..radius - k + length];
            let right = &self.padded[radius + k..radius + k + length];
            for ((to, l), r) in self.smooth.iter_mut().zip(left).zip(right) {
                *to += weight * (*l + *r);
            }
        }
    }

    /// Events in the bins within the smoothing radius of the peak, at least those of its own bin.
    fn events_near(&self, bin: f64) -> u32 {
        let reach = (self.reach_px / f64::from(self.side_px)).max(0.5);
        let counts = self.columns.counts();
        let first = (bin - reach).ceil().max(0.0) as usize;
        let last = ((bin + reach).floor().max(0.0) as usize).min(counts.len() - 1);
        counts.get(first..=last).map_or(0, |near| near.iter().sum())
    }
}
