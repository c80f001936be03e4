//! Offset on the set point that makes the tip itself arrive.
//!
//! Without integral gain the regulation stops short of its target by force divided by stiffness; with it, the force on a blocked tip
//! grows without a limit of ours. So the driver integrates the error itself, with limits on lead, step and force: slowly while the set
//! point rests; the offset decays at the same rate while it moves.

use crate::config::Motion;
use crate::trajectory::distance;

/// The offset and its state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Correction {
    limits: Motion,
    offset_mm: [f64; 3],
    sent_mm: [f64; 3],
}

impl Correction {
    /// No offset yet; the last target was `sent_mm`.
    pub(crate) const fn none(limits: Motion, sent_mm: [f64; 3]) -> Self {
        Self {
            limits,
            offset_mm: [0.0; 3],
            sent_mm,
        }
    }

    /// The tip without the offset, as the reference for the lead of the set point.
    pub(crate) fn uncorrected_tip(&self, tip_mm: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| tip_mm[i] - self.offset_mm[i])
    }

    /// The next target: `set_point_mm` plus the offset, at most one step from the previous target. `resting`: whether the set point rests
    /// and may be corrected; `None` freezes the offset.
    pub(crate) fn target(
        &mut self,
        set_point_mm: [f64; 3],
        tip_mm: [f64; 3],
        resting: Option<bool>,
        dt_s: f64,
    ) -> [f64; 3] {
        let share = (self.limits.correction_per_s * dt_s).min(1.0);
        let next: [f64; 3] = std::array::from_fn(|i| match resting {
            Some(true) => self.offset_mm[i] + share * (set_point_mm[i] - tip_mm[i]),
            Some(false) => self.offset_mm[i] * (1.0 - share),
            None => self.offset_mm[i],
        });
        let add = |offset: [f64; 3]| std::array::from_fn(|i| set_point_mm[i] + offset[i]);
        let lead = |target| distance(target, tip_mm);
        let far = lead(add(next));
        if far <= self.limits.max_lead_mm || far <= lead(add(self.offset_mm)) {
            self.offset_mm = next;
        }
        let requested: [f64; 3] = add(self.offset_mm);
        let step = distance(requested, self.sent_mm);
        let share = (self.limits.max_step_mm / step).min(1.0);
        if step > 0.0 {
            for (sent, requested) in self.sent_mm.iter_mut().zip(requested) {
                *sent += share * (requested - *sent);
            }
        }
        self.sent_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.000_5;

    #[test]
    fn a_tip_held_back_by_a_spring_arrives_and_the_offset_decays_again() {
        let limits = Motion::default();
        let mut correction = Correction::none(limits, [0.0; 3]);
        // The tip covers two thirds of the distance.
        let mut tip = [0.0; 3];
        for _ in 0..6000 {
            let target = correction.target([0.0, 0.0, -0.8], tip, Some(true), DT);
            tip[2] = target[2] * 2.0 / 3.0;
        }
        assert!((tip[2] + 0.8).abs() < 0.01, "{tip:?}");
        for _ in 0..4000 {
            tip = correction.target([0.0; 3], tip, Some(false), DT);
        }
        assert!(distance(tip, [0.0; 3]) < 0.01, "{tip:?}");
    }

    #[test]
    fn a_blocked_tip_stays_within_the_lead_and_step_limits() {
        let limits = Motion::default();
        let mut correction = Correction::none(limits, [0.0; 3]);
        let mut last = [0.0; 3];
        for _ in 0..20_000 {
            let target = correction.target([1.5, 0.0, 0.0], [0.0; 3], Some(true), DT);
            assert!(distance(target, last) <= limits.max_step_mm + 1e-12);
            assert!(distance(target, [0.0; 3]) <= limits.max_lead_mm);
            last = target;
        }
        assert!(last[0] > 1.9, "{last:?}");
    }
}
