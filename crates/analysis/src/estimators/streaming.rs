//! A column from a running histogram: one update per event, constant memory, an answer at any instant.

use skinrig_model::SENSOR_WIDTH;

use super::{Real, Sighting};
use crate::kept::KeptEvent;

/// Width of a bin, px. The mean within each bin keeps the answer between pixels.
const BIN_PX: u16 = 16;
const BIN_SHIFT: u32 = BIN_PX.trailing_zeros();
const BINS: usize = (SENSOR_WIDTH / BIN_PX) as usize;
/// Forgetting happens in this many steps per time constant; within a step events weigh the same.
const STEPS: f64 = 64.0;
/// The answer is made of the bins next to each other about the heaviest that have at least this share of its weight.
const LEAST_SHARE: f64 = 0.1;

/// Forty bins, each with a weight and a first moment that decay exponentially: 336 bytes in 32 bits, 664 in 64.
///
/// An event adds 1 to the weight of its bin and its distance from the bin's middle to the moment. The answer takes the
/// median weight off every bin (what the background puts everywhere; a touch covers far less than half of the
/// columns), finds the heaviest one and takes the mean over it and its neighbours. It is a sum over forty bins, whatever the
/// number of events.
#[derive(Debug, Clone, PartialEq)]
pub struct Streaming<R> {
    weights: [R; BINS],
    moments: [R; BINS],
    /// Factor of one step.
    decay: R,
    step_us: u32,
    /// The next step happens at this time, µs.
    next_us: u64,
    /// Distance of the middle of a bin of pixels from its first column, px.
    middle_px: R,
    /// Clears the low bits of a column: pixels of one bin are one.
    mask: u16,
}

impl<R: Real> Streaming<R> {
    /// On bins of pixels of side `side_px`; an event's weight is 1/e after `forget_ms` (above 0).
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

    /// Forgets everything; time begins at `from_us`.
    pub fn restart(&mut self, from_us: u32) {
        self.weights.fill(R::default());
        self.moments.fill(R::default());
        self.next_us = u64::from(from_us) + u64::from(self.step_us);
    }

    /// Takes the next event: time, not before the last one (µs), and column.
    pub fn add(&mut self, t_us: u32, x: u16) {
        if u64::from(t_us) >= self.next_us {
            self.forget(t_us);
        }
        let bin = usize::from(x >> BIN_SHIFT);
        let within = R::of(f64::from(x & (BIN_PX - 1) & self.mask)) + self.middle_px;
        if bin < BINS {
            self.weights[bin] += R::of(1.0);
            self.moments[bin] += within - R::of(f64::from(BIN_PX - 1) / 2.0);
        }
    }

    fn forget(&mut self, t_us: u32) {
        let steps = (u64::from(t_us) - self.next_us) / u64::from(self.step_us) + 1;
        self.next_us += steps * u64::from(self.step_us);
        let mut factor = R::of(1.0);
        // After 40 time constants nothing is left of any count.
        for _ in 0..steps.min(STEPS as u64 * 40) {
            factor *= self.decay;
        }
        for value in self.weights.iter_mut().chain(&mut self.moments) {
            *value *= factor;
        }
    }

    /// The answer now.
    #[must_use]
    pub fn now(&self) -> Sighting {
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
        let least = R::of(LEAST_SHARE) * net(top);
        if least <= zero {
            return Sighting::default();
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
            // From the heaviest bin, so that the numbers stay small.
            let distance = R::of((bin as f64 - top as f64) * f64::from(BIN_PX));
            // The background lies evenly over the bin: it has no first moment.
            weight += net(bin);
            sum += net(bin) * distance + self.moments[bin];
        }
        let middle = top as f64 * f64::from(BIN_PX) + f64::from(BIN_PX - 1) / 2.0;
        let column = middle + (sum / weight).wide();
        Sighting::at(column, weight.wide() as u32)
    }

    /// The median weight, the lower one of two.
    fn background(&self) -> R {
        let mut sorted = self.weights;
        let order = |a: &R, b: &R| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal);
        let (_, median, _) = sorted.select_nth_unstable_by((BINS - 1) / 2, order);
        *median
    }

    /// See `super::PressEstimator::sight`.
    pub fn sight(&mut self, events: &[KeptEvent], from_us: u32) -> Sighting {
        self.restart(from_us);
        for event in events {
            self.add(event.t_us(), event.x());
        }
        self.now()
    }
}
