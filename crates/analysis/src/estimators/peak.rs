//! The peak of the smoothed histogram of columns, between pixels.

use super::{ColumnCounts, Real, Sighting, column_px};
use crate::kept::KeptEvent;

/// The kernel ends at this many standard deviations; what is beyond is 0.3 % of it.
const KERNEL_SIGMAS: f64 = 3.0;
/// Smallest standard deviation, bins: a narrower kernel would not reach the neighbours.
const LEAST_SIGMA_BINS: f64 = 0.5;

/// Smooths the events per column with a Gaussian whose standard deviation is the clustering radius and takes the
/// highest place, the first of equal ones; a parabola through it and its neighbours says where between the bins it
/// lies.
#[derive(Debug, Clone)]
pub struct Peak<R> {
    side_px: u16,
    reach_px: f64,
    columns: ColumnCounts,
    /// Weights at distance 0, 1, ...
    kernel: Vec<R>,
    /// Counts with as many zeros on both sides as the kernel needs.
    padded: Vec<R>,
    smooth: Vec<R>,
}

impl<R: Real> Peak<R> {
    /// On bins of this side, smoothed by `sigma_px`.
    #[must_use]
    pub fn new(side_px: u16, sigma_px: f64) -> Self {
        let columns = ColumnCounts::new(side_px);
        let sigma = (sigma_px / f64::from(side_px.max(1))).max(LEAST_SIGMA_BINS);
        let radius = (KERNEL_SIGMAS * sigma).ceil() as usize;
        let weight = |k: usize| libm::exp(-0.5 * (k as f64 / sigma) * (k as f64 / sigma));
        let bins = columns.counts().len();
        Self {
            side_px,
            reach_px: sigma_px,
            kernel: (0..=radius).map(|k| R::of(weight(k))).collect(),
            // One more on each side: the parabola looks at the neighbours of the first and last bin.
            padded: vec![R::default(); bins + 2 * (radius + 1)],
            smooth: vec![R::default(); bins + 2],
            columns,
        }
    }

    /// See `super::PressEstimator::sight`.
    pub fn sight(&mut self, events: &[KeptEvent]) -> Sighting {
        self.columns.fill(events);
        if self.columns.events() == 0 {
            return Sighting::default();
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
        Sighting::at(column, self.events_near(bin))
    }

    /// `smooth[i]` is the kernel about bin `i - 1`; both sides are added before they are weighted, so that a mirrored
    /// histogram gives the mirrored curve to the last bit.
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

    /// Events of the bins that lie within the smoothing radius of the peak, at least its own.
    fn events_near(&self, bin: f64) -> u32 {
        let reach = (self.reach_px / f64::from(self.side_px)).max(0.5);
        let counts = self.columns.counts();
        let first = (bin - reach).ceil().max(0.0) as usize;
        let last = ((bin + reach).floor().max(0.0) as usize).min(counts.len() - 1);
        counts.get(first..=last).map_or(0, |near| near.iter().sum())
    }
}
