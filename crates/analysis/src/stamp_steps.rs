//! Owns how far the timestamps of a camera's events lie apart: a camera counts microseconds, a driver or converter may round them.

use crate::result::ReadoutFault;

/// Distances of stamps, µs, from which they are coarse: the bin of the published latency study.
const COARSE_US: u64 = 1_000;
/// Stamps, at least, that tell.
const LEAST_STAMPS: u64 = 100;
/// One stamp in so many may lie nearer: those of a correction of the clock.
const ONE_IN: u64 = 100;

/// Distances of one event from the one before.
#[derive(Debug, Clone, Default)]
pub(crate) struct StampSteps {
    last_us: Option<u64>,
    same: u64,
    near: u64,
    far: u64,
    nearest_far_us: u64,
}

impl StampSteps {
    /// The next event.
    pub(crate) fn push(&mut self, t_us: u64) {
        match t_us.abs_diff(self.last_us.replace(t_us).unwrap_or(t_us)) {
            0 => self.same += 1,
            1..COARSE_US => self.near += 1,
            far_us => {
                let nearest = if self.far == 0 {
                    far_us
                } else {
                    self.nearest_far_us
                };
                self.nearest_far_us = nearest.min(far_us);
                self.far += 1;
            }
        }
    }

    /// Coarse stamps, if many events share each: a camera that sends few has its events far apart.
    pub(crate) fn found(&self) -> Option<ReadoutFault> {
        let tells = self.far >= LEAST_STAMPS && self.same >= self.far;
        (tells && self.near * ONE_IN <= self.far).then_some(ReadoutFault::CoarseStamps {
            step_ms: self.nearest_far_us as f64 * 1e-3,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(stamps: impl Iterator<Item = u64>) -> Option<ReadoutFault> {
        let mut steps = StampSteps::default();
        stamps.for_each(|t| steps.push(t));
        steps.found()
    }

    #[test]
    fn rounded_stamps_are_coarse_and_sparse_ones_are_not() {
        let busy = || (0..100_000u64).map(|i| 130 * i + i * i % 97);
        let rounded = |step: u64| busy().map(move |t| t / step * step);
        assert_eq!(found(busy()), None);
        assert_eq!(found(rounded(100)), None);
        let coarse = |step_ms| Some(ReadoutFault::CoarseStamps { step_ms });
        assert_eq!(found(rounded(1_000)), coarse(1.0));
        assert_eq!(found(rounded(20_000)), coarse(20.0));
        assert_eq!(found((0..10_000).map(|i| 5_000 * i)), None);
        assert_eq!(found(std::iter::empty()), None);
    }
}
