//! Column from a running histogram: one update per event, constant memory, a result at any time.

use skinrig_model::SENSOR_WIDTH;

use super::{ColumnEstimate, Real};
use crate::press_events::PackedEvent;

/// Width of a bin, px. The mean within each bin gives sub-bin resolution.
const BIN_PX: u16 = 16;
const BIN_SHIFT: u32 = BIN_PX.trailing_zeros();
const BINS: usize = (SENSOR_WIDTH / BIN_PX) as usize;
/// Number of decay steps per time constant; within a step events have equal weight.
const STEPS: f64 = 64.0;
/// The result uses adjacent bins around the heaviest one with at least this share of its weight.
const MIN_SHARE: f64 = 0.1;

/// Forty bins, each with a weight and a first moment that decay exponentially: 336 bytes with `f32`, 664 with `f64`.
///
/// An event adds 1 to the weight of its bin, and its distance from the middle of the bin to the moment. The result subtracts
/// the median weight from every bin (the uniform background; a press covers far less than half of the columns), finds the
/// heaviest bin, and takes the mean over it and its neighbours. It costs a sum over forty bins, whatever the number of
/// events.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamingEstimator<R> {
    weights: [R; BINS],
    moments: [R; BINS],
    /// Decay factor of one step.
    decay: R,
    step_us: u32,
    /// Time of the next step, µs.
    next_us: u64,
    /// Distance from the first column of a pixel bin to its middle, px.
    middle_px: R,
    /// Clears the low bits of a column, so that pixels of one bin coincide.
    mask: u16,
}

impl<R: Real> StreamingEstimator<R> {
    /// For pixel bins of side `side_px`; the weight of an event is 1/e after `forget_ms` (above 0).
    #[must_use]
    pub fn new(side_px: u16, forget_ms: f64) -> Self {
        let step_us = (forget_ms * 1e3 / STEPS).round().max(1.0);
        Self {
            weights: [R::default(); BINS],
            moments: [R::default(); BINS],
            decay: R::of(libm::exp(-step_us / (forget_ms * 1e3))),
            step_us: step_us as u32,
            next_us: 0,
            middle_px: R::of((f64::from(side_px) - 1.0) / 2.0),
            mask: !(side_px.max(1) - 1),
        }
    }

    /// Resets the state; time begins at `from_us`.
    pub fn restart(&mut self, from_us: u32) {
        self.weights.fill(R::default());
        self.moments.fill(R::default());
        self.next_us = u64::from(from_us) + u64::from(self.step_us);
    }

    /// Adds the next event: time, not before the previous one (µs), and column.
    pub fn add(&mut self, t_us: u32, x: u16) {
        if u64::from(t_us) >= self.next_us {
            self.discard_before(t_us);
        }
        let bin = usize::from(x >> BIN_SHIFT);
        let within = R::of(f64::from(x & (BIN_PX - 1) & self.mask)) + self.middle_px;
        if bin < BINS {
            self.weights[bin] += R::of(1.0);
            self.moments[bin] += within - R::of(f64::from(BIN_PX - 1) / 2.0);
        }
    }

    fn discard_before(&mut self, t_us: u32) {
        let steps = (u64::from(t_us) - self.next_us) / u64::from(self.step_us) + 1;
        self.next_us += steps * u64::from(self.step_us);
        let mut factor = R::of(1.0);
        // After 40 time constants no count has any weight left.
        for _ in 0..steps.min(STEPS as u64 * 40) {
            factor *= self.decay;
        }
        for value in self.weights.iter_mut().chain(&mut self.moments) {
            *value *= factor;
        }
    }

    /// Current result.
    #[must_use]
    pub fn now(&self) -> ColumnEstimate {
        let zero = R::default();
        let level = self.background();
        let net = |bin: usize| {
            let above = self.weights[bin] - level;
            if above > zero { above } else { zero }
        };
        let mut top = 0;
        for bin in 1..BINS {
            if net(bin) > net(top) {
                top = bin;
            }
        }
        let least = R::of(MIN_SHARE) * net(top);
        if least <= zero {
            return ColumnEstimate::default();
        }
        let mut first = top;
        while first > 0 && net(first - 1) >= least {
            first -= 1;
        }
        let mut last = top;
        while last + 1 < BINS && net(last + 1) >= least {
            last += 1;
        }
        let (mut weight, mut sum) = (zero, zero);
        for bin in first..=last {
            // Relative to the heaviest bin, so that the numbers stay small.
            let distance = R::of((bin as f64 - top as f64) * f64::from(BIN_PX));
            // The background is uniform over the bin, so it has no first moment.
            weight += net(bin);
            sum += net(bin) * distance + self.moments[bin];
        }
        let middle = top as f64 * f64::from(BIN_PX) + f64::from(BIN_PX - 1) / 2.0;
        let column = middle + (sum / weight).wide();
        ColumnEstimate::at(column, weight.wide() as u32)
    }

    /// Median weight, the lower one of two.
    fn background(&self) -> R {
        let mut sorted = self.weights;
        let order = |a: &R, b: &R| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal);
        let (_, median, _) = sorted.select_nth_unstable_by((BINS - 1) / 2, order);
        *median
    }

    /// See `super::PressEstimator::estimate`.
    pub fn estimate(&mut self, events: &[PackedEvent], from_us: u32) -> ColumnEstimate {
        self.restart(from_us);
        for event in events {
            self.add(event.t_us(), event.x());
        }
        self.now()
    }
}
