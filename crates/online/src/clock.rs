//! The common time of both cameras: slots of host time, found from camera time by exact integer arithmetic.

use skinrig_analysis::result::ClockFit;

/// Length of a slot, host µs.
pub const SLOT_US: i64 = 500;
/// Fractional bits of camera times.
const BITS: u32 = 32;

/// A clock fit as a line through the starts of the slots. Every event has one slot, whatever the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ClockLine {
    /// Camera time at the start of slot 0, µs times 2^32.
    origin: i128,
    /// Camera time of a slot, µs times 2^32; above 0.
    step: i128,
}

impl ClockLine {
    /// The line of a fit; `None` if the fit is not finite or its clock does not run forwards.
    pub(crate) fn new(fit: &ClockFit) -> Option<Self> {
        let scale = (1u64 << BITS) as f64;
        let step = SLOT_US as f64 * (1.0 + fit.drift_ppm * 1e-6) * scale;
        let origin = fit.offset_us * scale;
        let usable = step.is_finite() && step >= 1.0 && origin.is_finite();
        usable.then_some(Self {
            origin: origin as i128,
            step: step as i128,
        })
    }

    /// Slot that holds a camera time.
    pub(crate) const fn slot(&self, camera_us: u64) -> i64 {
        (((camera_us as i128) << BITS) - self.origin).div_euclid(self.step) as i64
    }

    /// First camera time of a slot, µs; 0 if the slot begins before the camera's zero.
    pub(crate) fn start_us(&self, slot: i64) -> u64 {
        let at = self.origin + i128::from(slot) * self.step;
        let up = (at + ((1 << BITS) - 1)) >> BITS;
        u64::try_from(up.max(0)).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use skinrig_analysis::result::ClockMethod;

    use super::*;

    fn fit(offset_us: f64, drift_ppm: f64) -> ClockFit {
        ClockFit {
            method: ClockMethod::TimeBase,
            offset_us,
            drift_ppm,
            drift_se_ppm: 0.0,
            residual_rms_us: 0.0,
            residual_max_us: 0.0,
            n: 3,
            rejected: 0,
        }
    }

    proptest! {
        #[test]
        fn a_slot_begins_where_the_one_before_ends(
            offset in -1e8..1e9, drift in -500.0..500.0, t in 0u64..1 << 45,
        ) {
            let line = ClockLine::new(&fit(offset, drift)).unwrap();
            let slot = line.slot(t);
            prop_assert!(line.start_us(slot) <= t && t < line.start_us(slot + 1));
        }
    }

    #[test]
    fn a_clock_that_stands_still_is_refused() {
        for bad in [f64::NAN, -1e6, f64::INFINITY] {
            assert_eq!(ClockLine::new(&fit(0.0, bad)), None);
            assert!(ClockLine::new(&fit(bad.abs(), 0.0)).is_none() || bad.abs() == 1e6);
        }
    }
}
