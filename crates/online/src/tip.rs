//! How deep the tip was during presses, as the robot measured it: what calibration presses teach of depth.

use std::collections::BTreeMap;

use skinrig_model::PressId;

/// The way of the tip during a press.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TipCourse {
    /// Host time, µs, and depth reached by then, mm; both rise.
    reached: Vec<(f64, f64)>,
}

/// The way of the tip during each press.
pub type TipCourses = BTreeMap<PressId, TipCourse>;

impl TipCourse {
    /// From host times, µs, in order, and depths below the surface, mm.
    #[must_use]
    pub fn new(depths: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut reached: Vec<(f64, f64)> = Vec::new();
        for (host_us, depth_mm) in depths {
            let deepest = reached.last().map_or(0.0, |(_, mm)| *mm);
            reached.push((host_us, depth_mm.max(deepest)));
        }
        Self { reached }
    }

    /// Depth reached by this host time, µs, in mm; 0 before the first measurement, `None` without any.
    #[must_use]
    pub fn reached_mm(&self, host_us: f64) -> Option<f64> {
        let next = self.reached.partition_point(|(us, _)| *us < host_us);
        let (_, deepest) = self.reached.last()?;
        let Some((to_us, to_mm)) = self.reached.get(next) else {
            return Some(*deepest);
        };
        let Some((us, mm)) = next.checked_sub(1).and_then(|i| self.reached.get(i)) else {
            return Some(0.0);
        };
        Some(mm + (to_mm - mm) * (host_us - us) / (to_us - us))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_depth_reached_never_falls() {
        let tip = TipCourse::new([(0.0, -1.0), (10.0, 0.5), (20.0, 1.5), (30.0, 1.0)]);
        let at = |us| tip.reached_mm(us).unwrap();
        assert_eq!([-5.0, 5.0, 10.0, 15.0].map(at), [0.0, 0.25, 0.5, 1.0]);
        assert_eq!([20.0, 25.0, 99.0].map(at), [1.5; 3]);
        assert_eq!(TipCourse::default().reached_mm(1.0), None);
    }
}
