//! The depth that a touch has reached, by its events so far: that at which calibration presses near it had given as many.
//!
//! Of each camera, the geometric mean of those depths, weighted by a Gaussian of the distance from the touch to the presses, as wide as
//! half the distance between neighbouring places; then that of both cameras, weighted by what their counts tell. Presses that never gave
//! as many events are extended by the power law of the second half of their events, and lose weight. The interval holds at every instant
//! of the touch ([`Envelope`]). It is that of presses with the speed and the tip of the calibration presses. Away from their places, it is
//! learnt from places that are left out, one press each; with too few places, a touch there has no depth.

use serde::{Deserialize, Serialize};
use skinrig_model::TouchDepth;

use crate::envelope::{Distances, Envelope, half};
use crate::rise::Count;

/// Probability of the interval.
const HOLDS: f64 = 0.95;
/// Depths below this count as this where ratios are taken, mm.
const LEAST_MM: f64 = 0.02;
/// A press that is extended by this factor of events has a weight of 1/e: beyond it, presses that went deeper decide.
const EXTENDED: f64 = 1.35;
/// Least and largest exponent of that power law of depth over events: a course of few instants does not tell its own.
const EXPONENTS: (f64, f64) = (0.3, 1.2);
/// Relative error of the depth of one camera that no number of events removes: from some 25 events on, both cameras count nearly alike.
const SCATTER: f64 = 0.2;
/// A touch is at a taught place within this share of the Gaussian's width, a quarter of the distance between neighbouring places.
const AT_A_PLACE: f64 = 0.5;
/// Weight, relative to that of the nearest press, below which a press does not count.
const LEAST_WEIGHT: f64 = 1e-3;

/// An instant of a calibration press while the tip goes in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Instant {
    /// Events of each camera.
    pub counts: [Count; 2],
    /// Depth reached, mm.
    pub depth_mm: f64,
}

/// A calibration press: the instants at which it was felt, in order of time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DepthCourse {
    /// Place, for the order in which presses teach and are judged.
    pub location: u32,
    /// Where it was, mm.
    pub at: [f64; 2],
    /// Each instant with the position that was felt.
    pub instants: Vec<(Instant, [f64; 2])>,
}

/// What a press teaches of one camera: events and depths, both rising.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Rise {
    events: Vec<f64>,
    depth_mm: Vec<f64>,
    /// Of the power law beyond its last event.
    exponent: f64,
}

impl Rise {
    fn new(course: &DepthCourse, camera: usize) -> Option<Self> {
        let (mut events, mut depth_mm): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        for (instant, _) in &course.instants {
            let more = instant.counts[camera].beyond.max(1.0);
            if events.last().is_none_or(|last| more > *last) {
                events.push(more);
                depth_mm.push(instant.depth_mm.max(LEAST_MM));
            }
        }
        let (most, deepest) = (*events.last()?, *depth_mm.last()?);
        let mut rise = Self {
            events,
            depth_mm,
            exponent: 1.0,
        };
        let (half, _) = rise.depth(0.5 * most);
        let (least, largest) = EXPONENTS;
        rise.exponent = libm::log2(deepest / half).clamp(least, largest);
        Some(rise)
    }

    /// Depth at which it had given so many events, and the weight of that.
    fn depth(&self, events: f64) -> (f64, f64) {
        let next = self.events.partition_point(|e| *e < events);
        if next == 0 {
            return (self.depth_mm[0], 1.0);
        }
        let (below, depth) = (self.events[next - 1], self.depth_mm[next - 1]);
        if next == self.events.len() {
            let ratio = libm::log(events / below);
            let far = ratio / libm::log(EXTENDED);
            let weight = libm::exp(-far * far).max(f64::MIN_POSITIVE);
            return (depth * libm::exp(self.exponent * ratio), weight);
        }
        let part = (events - below) / (self.events[next] - below);
        (depth + part * (self.depth_mm[next] - depth), 1.0)
    }
}

/// The courses of calibration presses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Courses {
    presses: Vec<([f64; 2], [Rise; 2])>,
    /// Standard deviation of the Gaussian, mm.
    width_mm: f64,
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// Half the median distance from a place to the nearest other one, mm; `None` for a single place.
fn width_mm(courses: &[&DepthCourse]) -> Option<f64> {
    let nearest = courses.iter().filter_map(|one| {
        let others = courses.iter().filter(|o| o.location != one.location);
        others
            .map(|o| distance(o.at, one.at))
            .min_by(f64::total_cmp)
    });
    let mut nearest: Vec<f64> = nearest.collect();
    nearest.sort_by(f64::total_cmp);
    Some(0.5 * nearest.get(nearest.len() / 2)?)
}

impl Courses {
    fn new<'a>(courses: impl Iterator<Item = &'a DepthCourse>, width_mm: f64) -> Self {
        let rises = |c: &DepthCourse| Some((c.at, [Rise::new(c, 0)?, Rise::new(c, 1)?]));
        Self {
            presses: courses.filter_map(rises).collect(),
            width_mm,
        }
    }

    /// Whether a press taught what touches here give.
    fn taught(&self, at: [f64; 2]) -> bool {
        let within = AT_A_PLACE * self.width_mm;
        self.presses
            .iter()
            .any(|(place, _)| distance(*place, at) <= within)
    }

    /// How far the depths of this press are off, as these courses tell them.
    fn distances(&self, course: &DepthCourse) -> Distances {
        let of = |(instant, at): &(Instant, [f64; 2])| {
            let depth = self.depth_mm(*at, instant.counts)?;
            Some((total(instant.counts), (depth - instant.depth_mm).abs()))
        };
        course.instants.iter().filter_map(of).collect()
    }

    /// Depth of a touch here after so many events, mm; `None` far from all presses.
    fn depth_mm(&self, at: [f64; 2], counts: [Count; 2]) -> Option<f64> {
        let weight = |place: [f64; 2]| {
            let far = distance(place, at) / self.width_mm;
            libm::exp(-0.5 * far * far)
        };
        let weights = self.presses.iter().map(|(place, _)| weight(*place));
        let heaviest = weights.clone().fold(f64::MIN_POSITIVE, f64::max);
        let near = weights.zip(&self.presses);
        let near = near.filter(|(weight, _)| *weight >= LEAST_WEIGHT * heaviest);
        let (mut sums, mut logs) = ([0.0; 2], [0.0; 2]);
        for (weight, (_, rises)) in near {
            for camera in [0, 1] {
                let (depth, certain) = rises[camera].depth(counts[camera].beyond.max(1.0));
                sums[camera] += weight * certain;
                logs[camera] += weight * certain * libm::log(depth.max(LEAST_MM));
            }
        }
        let certain = counts.map(certainty);
        let means = [logs[0] / sums[0], logs[1] / sums[1]];
        let mean = (certain[0] * means[0] + certain[1] * means[1]) / (certain[0] + certain[1]);
        mean.is_finite().then(|| libm::exp(mean))
    }
}

/// Weight of a camera: the inverse of the relative variance of its depth.
fn certainty(count: Count) -> f64 {
    let beyond = count.beyond.max(1.0);
    1.0 / (SCATTER * SCATTER + count.all.max(1.0) / (beyond * beyond))
}

/// Total of both cameras, for the envelope.
fn total(counts: [Count; 2]) -> u32 {
    (counts[0].beyond + counts[1].beyond).max(0.0) as u32
}

/// How deep touches are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct DepthModel {
    courses: Courses,
    /// At taught places.
    envelope: Envelope,
    /// At others; `None` if too few places were taught.
    elsewhere: Option<Envelope>,
}

impl DepthModel {
    /// From calibration presses; `None` if they are too few for the interval, or at one place.
    pub(crate) fn learn(mut courses: Vec<DepthCourse>) -> Option<Self> {
        courses.retain(|c| !c.instants.is_empty());
        // Each half of the presses has its share of every place.
        courses.sort_by_key(|c| c.location);
        let width_mm = width_mm(&courses.iter().collect::<Vec<_>>())?;
        let mut distances: Vec<Distances> = vec![Vec::new(); courses.len()];
        for odd in [0, 1] {
            let others = Courses::new(half(&courses, 1 - odd), width_mm);
            for (own, course) in distances
                .iter_mut()
                .skip(odd)
                .step_by(2)
                .zip(half(&courses, odd))
            {
                *own = others.distances(course);
            }
        }
        distances.retain(|d| !d.is_empty());
        Some(Self {
            courses: Courses::new(courses.iter(), width_mm),
            envelope: Envelope::learn(&distances, HOLDS)?,
            elsewhere: Envelope::learn(&at_places_left_out(&courses, width_mm), HOLDS),
        })
    }

    /// Whether touches away from the taught places have depths.
    pub(crate) const fn is_known_elsewhere(&self) -> bool {
        self.elsewhere.is_some()
    }

    /// Depth that a touch here has reached with so many events; `None` with more than any calibration press gave, and where the places
    /// tell nothing.
    pub(crate) fn reached(&self, at: [f64; 2], counts: [Count; 2]) -> Option<TouchDepth> {
        let all = total(counts);
        if !self.envelope.has_seen(all) {
            return None;
        }
        let mm = self.courses.depth_mm(at, counts)?;
        let mut within_mm = self.envelope.within_mm(all);
        if !self.courses.taught(at) {
            within_mm = within_mm.max(self.elsewhere.as_ref()?.within_mm(all));
        }
        Some(TouchDepth { mm, within_mm })
    }
}

/// The first press of each place, as the presses of all other places tell its depths. Ordered by place.
fn at_places_left_out(courses: &[DepthCourse], width_mm: f64) -> Vec<Distances> {
    let first = courses.chunk_by(|a, b| a.location == b.location);
    let first = first.filter_map(<[DepthCourse]>::first);
    let left_out = first.map(|course| {
        let others = courses.iter().filter(|c| c.location != course.location);
        Courses::new(others, width_mm).distances(course)
    });
    left_out.filter(|d| !d.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use rand_xoshiro::Xoshiro256PlusPlus;
    use skinrig_model::LEAST_PRESSES_OF_DEPTHS;
    use skinrig_statistics::seeded;

    use super::*;

    fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
        (0..12).map(|_| 0.5 * seeded::signed_unit(rng)).sum()
    }

    fn counted(events: [f64; 2]) -> [Count; 2] {
        events.map(|beyond| Count {
            all: beyond + 100.0,
            beyond,
        })
    }

    /// A press here to 2 mm, felt from 0.2 mm on: more events where a camera is near, and presses differ.
    fn press(at: [f64; 2], location: u32, rng: &mut Xoshiro256PlusPlus) -> DepthCourse {
        let own = libm::exp(0.1 * normal(rng));
        let near = [
            500.0 / (1.0 + 0.05 * distance(at, [-30.0, 0.0])),
            500.0 / (1.0 + 0.05 * distance(at, [30.0, 0.0])),
        ];
        let mut events = [0.0; 2];
        let mut before: f64 = 0.0;
        let instants = (4..=40).map(|step| {
            let depth_mm = 0.05 * f64::from(step);
            for camera in [0, 1] {
                let expected = |mm: f64| own * near[camera] * libm::pow(mm, 1.6);
                let more = expected(depth_mm) - expected(before);
                events[camera] += more + libm::sqrt(more) * normal(rng);
            }
            before = depth_mm;
            let felt = at.map(|v| v + 0.5 * normal(rng));
            (
                Instant {
                    counts: counted(events),
                    depth_mm,
                },
                felt,
            )
        });
        DepthCourse {
            location,
            at,
            instants: instants.collect(),
        }
    }

    /// So many presses at each place of a grid, 8 mm apart.
    fn presses(side: u32, each: u32, rng: &mut Xoshiro256PlusPlus) -> Vec<DepthCourse> {
        let places = (0..each).flat_map(|_| 0..side * side);
        let at = |place: u32| [place % side, place / side].map(|v| 8.0 * f64::from(v) - 16.0);
        places.map(|p| press(at(p), p, rng)).collect()
    }

    #[test]
    fn the_interval_holds_at_every_instant_of_new_presses() {
        for (side, each) in [(5, 1), (5, 3), (9, 2)] {
            let (mut held, mut all, mut worst_mm) = (0, 0, 0.0_f64);
            for round in 0..20 {
                let mut rng = seeded::generator(round, 5);
                let model = DepthModel::learn(presses(side, each, &mut rng)).unwrap();
                for new in presses(side, 1, &mut rng) {
                    let off = new.instants.iter().filter_map(|(instant, at)| {
                        let found = model.reached(*at, instant.counts)?;
                        Some(((found.mm - instant.depth_mm).abs(), found.within_mm))
                    });
                    let off: Vec<(f64, f64)> = off.collect();
                    held += u32::from(off.iter().all(|(error, within)| error <= within));
                    all += 1;
                    worst_mm = off.iter().map(|o| o.0).fold(worst_mm, f64::max);
                }
            }
            let share = f64::from(held) / f64::from(all);
            assert!(share > HOLDS - 0.01, "{side} x {side}, {each}: {share}");
            assert!(share < 0.999 && worst_mm < 0.8, "{share}, {worst_mm} mm");
        }
    }

    #[test]
    fn away_from_the_places_the_interval_is_wider_and_holds() {
        let (mut held, mut all) = (0, 0);
        for round in 0..30 {
            let mut rng = seeded::generator(round, 5);
            let (taught, others): (Vec<_>, Vec<_>) = presses(9, 1, &mut rng)
                .into_iter()
                .partition(|_| seeded::signed_unit(&mut rng) < 0.0);
            let model = DepthModel::learn(taught).unwrap();
            for new in others {
                let holds = |(instant, at): &(Instant, [f64; 2])| {
                    let found = model.reached(*at, instant.counts);
                    found.is_none_or(|d| (d.mm - instant.depth_mm).abs() <= d.within_mm)
                };
                held += u32::from(new.instants.iter().all(holds));
                all += 1;
            }
        }
        let share = f64::from(held) / f64::from(all);
        assert!((HOLDS - 0.02..0.999).contains(&share), "{share} of {all}");
    }

    /// With 9 places, nothing tells how far it is off between them.
    #[test]
    fn away_from_few_places_there_is_no_depth() {
        let mut rng = seeded::generator(3, 5);
        let model = DepthModel::learn(presses(3, 4, &mut rng)).unwrap();
        assert!(!model.is_known_elsewhere());
        let counts = counted([300.0; 2]);
        assert!(model.reached([-8.0, -8.0], counts).is_some());
        assert_eq!(model.reached([-12.0, -12.0], counts), None);
        assert_eq!(model.reached([6.0, 0.0], counts), None);
    }

    /// Deeper than any calibration press: no depth, rather than that of the deepest.
    #[test]
    fn more_events_than_taught_have_no_depth() {
        let mut rng = seeded::generator(1, 5);
        let model = DepthModel::learn(presses(5, 1, &mut rng)).unwrap();
        let at = [0.0, 0.0];
        assert!(model.reached(at, counted([300.0; 2])).is_some());
        assert_eq!(model.reached(at, counted([5_000.0; 2])), None);
        assert_eq!(model.reached([f64::NAN, 0.0], counted([300.0; 2])), None);
    }

    /// A camera that sees little says little.
    #[test]
    fn a_camera_that_sees_nothing_does_not_decide() {
        let mut rng = seeded::generator(2, 5);
        let model = DepthModel::learn(presses(5, 3, &mut rng)).unwrap();
        let mm = |events| model.reached([0.0, 0.0], counted(events)).unwrap().mm;
        let both = mm([300.0, 300.0]);
        assert!((mm([300.0, -20.0]) - both).abs() < 0.05 * both);
        assert!((mm([-20.0, 300.0]) - both).abs() < 0.05 * both);
    }

    #[test]
    fn too_few_presses_give_no_depth() {
        let mut rng = seeded::generator(1, 5);
        let enough = LEAST_PRESSES_OF_DEPTHS;
        let all: Vec<DepthCourse> = presses(5, 1, &mut rng).into_iter().take(enough).collect();
        assert!(DepthModel::learn(all[1..].to_vec()).is_none());
        assert!(DepthModel::learn(all.clone()).is_some());
        let here = |c: &DepthCourse| DepthCourse {
            location: 0,
            ..c.clone()
        };
        assert!(DepthModel::learn(all.iter().map(here).collect()).is_none());
        assert!(DepthModel::learn(Vec::new()).is_none());
    }
}
