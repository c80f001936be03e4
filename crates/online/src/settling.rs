//! Regions that hold at every instant of a touch: how far positions still move until it ends, learnt from calibration presses.
//!
//! At an instant, the position that the touch will end with lies within the envelope's distance of the position so far, with probability
//! [`STAYS`], at all instants together. The last position lies with probability 0.99 in the 99 % region of its locator. Both together
//! hold with 95 %, whenever one stops.

use std::f64::consts::FRAC_1_SQRT_2;

use serde::{Deserialize, Serialize};
use skinrig_analysis::result::Region;

use crate::envelope::{Distances, Envelope};

/// Probability that the last position stays within reach at every instant.
const STAYS: f64 = 0.96;

/// Positions of one calibration press: clustered events in the weaker camera, and position, mm; in order of time.
pub(crate) type Course = Vec<(u32, [f64; 2])>;

/// How far positions still move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Settling(Envelope);

/// Distance to the last position at each instant.
fn distances(course: &Course) -> Distances {
    let Some((_, last)) = course.last() else {
        return Vec::new();
    };
    let distance = |at: [f64; 2]| libm::hypot(at[0] - last[0], at[1] - last[1]);
    course
        .iter()
        .map(|(events, at)| (*events, distance(*at)))
        .collect()
}

impl Settling {
    /// From the positions of calibration presses; `None` if they are too few for this probability.
    pub(crate) fn learn(courses: &[Course]) -> Option<Self> {
        let presses = courses.iter().map(distances);
        let presses: Vec<_> = presses.filter(|p| !p.is_empty()).collect();
        Envelope::learn(&presses, STAYS).map(Self)
    }

    /// Distance from the position after so many events within which the last one of the touch lies, mm.
    fn reach_mm(&self, events: u32) -> f64 {
        self.0.within_mm(events)
    }

    /// The region of a position after so many events: an ellipse that holds every point within reach of the region of the last position.
    ///
    /// Of two ellipses with shape matrices P and Q, (1 + 1/b) P + (1 + b) Q holds every sum (Schweppe 1973, "Uncertain Dynamic
    /// Systems", section 4.3); b is the ratio of their sizes.
    pub(crate) fn region(&self, last: Region, events: u32) -> Option<Region> {
        let reach = self.reach_mm(events);
        let [a, b] = last.semi_axes_mm;
        let size = FRAC_1_SQRT_2 * libm::hypot(a, b);
        let sum = |axis: f64| {
            libm::sqrt(axis * axis * (1.0 + reach / size) + reach * reach + reach * size)
        };
        let region = Region {
            semi_axes_mm: [sum(a), sum(b)],
            ..last
        };
        let usable = size > 0.0 && region.semi_axes_mm.iter().all(|s| s.is_finite());
        usable.then_some(region)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use skinrig_model::LEAST_PRESSES_OF_REGIONS;
    use skinrig_statistics::seeded;

    use super::*;

    fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
        (0..12).map(|_| 0.5 * seeded::signed_unit(rng)).sum()
    }

    /// A touch of 200 ms whose position walks, ever less, to its last one; one in five is as weak as its scatter is large.
    fn course(rng: &mut Xoshiro256PlusPlus) -> Course {
        let weak = if seeded::index(rng, 5) == 0 { 4.0 } else { 1.0 };
        let mut at = [0.0, 0.0];
        let steps = 30 + seeded::index(rng, 20) as u32;
        (0..steps)
            .map(|i| {
                let scatter = weak / (1.0 + f64::from(i));
                at = at.map(|v| v + scatter * normal(rng));
                (20 * i * i, at)
            })
            .collect()
    }

    /// Share of new touches that stay within reach at every instant, over `rounds` sets of `presses` calibration presses.
    fn coverage(presses: usize, rounds: u64) -> f64 {
        let (mut within, mut all) = (0, 0);
        for round in 0..rounds {
            let mut rng = seeded::generator(round, 3);
            let courses: Vec<Course> = (0..presses).map(|_| course(&mut rng)).collect();
            let settling = Settling::learn(&courses).unwrap();
            for _ in 0..40 {
                let new = course(&mut rng);
                let (_, last) = new[new.len() - 1];
                let stays = |(events, at): &(u32, [f64; 2])| {
                    libm::hypot(at[0] - last[0], at[1] - last[1]) <= settling.reach_mm(*events)
                };
                within += u32::from(new.iter().all(stays));
                all += 1;
            }
        }
        f64::from(within) / f64::from(all)
    }

    #[test]
    fn the_last_position_stays_within_reach_at_every_instant() {
        for presses in [24, 81, 250] {
            let share = coverage(presses, 100);
            assert!(share > STAYS - 0.01 && share < 0.995, "{presses}: {share}");
        }
    }

    #[test]
    fn too_few_presses_give_no_region() {
        let mut rng = seeded::generator(1, 3);
        // Protocols refuse a region of fewer.
        let enough = LEAST_PRESSES_OF_REGIONS;
        let courses: Vec<Course> = (0..enough).map(|_| course(&mut rng)).collect();
        assert!(Settling::learn(&courses).is_some());
        assert_eq!(Settling::learn(&courses[..enough - 1]), None);
        assert_eq!(Settling::learn(&[]), None);
    }

    proptest! {
        #[test]
        fn a_region_holds_every_sum(
            a in 0.01..20.0, b in 0.01..20.0, angle_deg in -90.0..90.0, reach in 0.0..20.0,
            at in 0.0..6.3, to in 0.0..6.3,
        ) {
            let (a, b) = if a > b { (a, b) } else { (b, a) };
            let last = Region { semi_axes_mm: [a, b], angle_deg };
            let settling = Settling(Envelope::of(reach));
            let region = settling.region(last, 0).unwrap();
            let (sin, cos) = libm::sincos(f64::to_radians(angle_deg));
            let (y, x): (f64, f64) = libm::sincos(at);
            let (x, y) = (a * x, b * y);
            let (dy, dx) = libm::sincos(to);
            let point = [x * cos - y * sin + reach * dx, x * sin + y * cos + reach * dy];
            prop_assert!(region.reach(point) <= 1.0 + 1e-9, "{}", region.reach(point));
        }
    }
}
