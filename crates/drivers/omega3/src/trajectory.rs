//! The set point: moves along straight lines with limited speed, acceleration and jerk, and never far ahead of the tip.

use skinrig_model::{Point3, Robot};

use crate::config::Motion;
use crate::profile::{Profile, ProfileLimits};

/// A change of direction below this distance between the lines does not need a stop, mm.
const COLLINEAR_MM: f64 = 1e-3;

/// Share of the longest step that is used, as a margin for rounding.
const STEP_SHARE: f64 = 0.99;

/// A line in progress.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    from: [f64; 3],
    to: [f64; 3],
    profile: Profile,
}

impl Line {
    fn new(from: [f64; 3], to: [f64; 3], limits: ProfileLimits) -> Self {
        Self {
            from,
            to,
            profile: Profile::at_rest(distance(from, to), limits),
        }
    }

    fn point(&self) -> [f64; 3] {
        let length = distance(self.from, self.to);
        let travelled = self.profile.travelled();
        if travelled >= length {
            return self.to;
        }
        let share = travelled / length;
        std::array::from_fn(|i| self.from[i] + share * (self.to[i] - self.from[i]))
    }
}

/// Moves the set point from target to target.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Trajectory {
    limits: Motion,
    set_point: [f64; 3],
    line: Option<Line>,
    next: Option<([f64; 3], f64)>,
}

impl Trajectory {
    /// At rest at a point.
    #[must_use]
    pub const fn at_rest(limits: Motion, at: Point3<Robot>) -> Self {
        Self {
            limits,
            set_point: [at.x_mm, at.y_mm, at.z_mm],
            line: None,
            next: None,
        }
    }

    /// Sets the acceleration limit from the next move on, mm/s².
    pub const fn set_acceleration(&mut self, acceleration_mm_s2: f64) {
        self.limits.acceleration_mm_s2 = acceleration_mm_s2;
    }

    /// Position of the set point.
    #[must_use]
    pub const fn set_point(&self) -> Point3<Robot> {
        let [x, y, z] = self.set_point;
        Point3::new(x, y, z)
    }

    /// Whether no motion is left.
    #[must_use]
    pub(crate) const fn is_still(&self) -> bool {
        self.line.is_none() && self.next.is_none()
    }

    /// Moves to `target` in a straight line. A running move in that direction continues without a stop; any other first stops on its
    /// own line.
    pub fn go(&mut self, target: Point3<Robot>, speed_mm_s: f64) {
        let target = target.to_array();
        self.next = None;
        let Some(line) = &mut self.line else {
            self.begin(target, speed_mm_s);
            return;
        };
        let is_collinear = distance_from_ray(target, self.set_point, line.to) <= COLLINEAR_MM;
        let continued = line.profile.continue_on(
            distance(self.set_point, target),
            profile_limits(&self.limits, speed_mm_s),
        );
        if is_collinear && continued.can_stop_at(distance(self.set_point, target)) {
            *line = Line {
                from: self.set_point,
                to: target,
                profile: continued,
            };
        } else {
            line.profile.stop_early();
            self.next = Some((target, speed_mm_s));
        }
    }

    /// Stops as soon as the limits allow.
    pub fn hold(&mut self) {
        self.next = None;
        if let Some(line) = &mut self.line {
            line.profile.stop_early();
        }
    }

    /// Stops immediately.
    pub const fn halt(&mut self) {
        self.next = None;
        self.line = None;
    }

    fn begin(&mut self, target: [f64; 3], speed_mm_s: f64) {
        let line = Line::new(
            self.set_point,
            target,
            profile_limits(&self.limits, speed_mm_s),
        );
        self.line = (!line.profile.is_done()).then_some(line);
    }

    /// Advances by `dt_s` seconds. If that would exceed the allowed lead over `measured`, the set point waits and restarts from rest.
    /// Steps never exceed the limit.
    pub fn step(&mut self, dt_s: f64, measured: Point3<Robot>) {
        if self.line.is_none()
            && let Some((target, speed)) = self.next.take()
        {
            self.begin(target, speed);
        }
        let Some(line) = &mut self.line else { return };
        let mut ahead = *line;
        let longest_s = STEP_SHARE * self.limits.max_step_mm / ahead.profile.top_speed();
        ahead.profile.step(dt_s.min(longest_s));
        let point = ahead.point();
        let tip = measured.to_array();
        let (lead, was) = (distance(point, tip), distance(self.set_point, tip));
        let step = distance(point, self.set_point);
        if (lead > self.limits.max_lead_mm && lead > was) || step > self.limits.max_step_mm {
            line.profile.halt();
            return;
        }
        self.set_point = point;
        self.line = (!ahead.profile.is_done()).then_some(ahead);
    }
}

const fn profile_limits(limits: &Motion, speed_mm_s: f64) -> ProfileLimits {
    ProfileLimits {
        speed: speed_mm_s,
        acceleration: limits.acceleration_mm_s2,
        jerk: limits.jerk_mm_s3,
    }
}

/// Distance between two points.
pub(crate) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z] = std::array::from_fn(|i| a[i] - b[i]);
    norm([x, y, z])
}

/// Length of a vector.
pub(crate) fn norm([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

/// Distance of `p` from the ray that starts at `from` and passes `through`.
fn distance_from_ray(p: [f64; 3], from: [f64; 3], through: [f64; 3]) -> f64 {
    let length = distance(from, through);
    if length == 0.0 {
        return distance(p, from);
    }
    let along: f64 = (0..3)
        .map(|i| (p[i] - from[i]) * (through[i] - from[i]) / length)
        .sum::<f64>()
        .max(0.0);
    let foot: [f64; 3] = std::array::from_fn(|i| from[i] + along * (through[i] - from[i]) / length);
    distance(p, foot)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DT: f64 = 0.0005;

    fn point(p: [f64; 3]) -> Point3<Robot> {
        let [x, y, z] = p;
        Point3::new(x, y, z)
    }

    fn coordinates() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3(-40.0f64..40.0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn every_set_point_lies_in_the_hull_of_start_and_targets(
            targets in prop::collection::vec((coordinates(), 1.0f64..50.0, 0usize..3000), 1..5),
        ) {
            let limits = Motion::default();
            let mut t = Trajectory::at_rest(limits, point([0.0; 3]));
            let mut corners = (0.0f64, 0.0f64);
            for (to, speed, cycles) in &targets {
                for c in to {
                    corners = (corners.0.min(*c), corners.1.max(*c));
                }
                t.go(point(*to), *speed);
                for _ in 0..*cycles {
                    let before = t.set_point();
                    t.step(DT, before);
                    let step = t.set_point().distance_mm(before);
                    prop_assert!(step <= limits.max_step_mm);
                    for c in t.set_point().to_array() {
                        prop_assert!(c >= corners.0 - 1e-9 && c <= corners.1 + 1e-9);
                    }
                }
            }
            let mut n = 0;
            while !t.is_still() {
                t.step(DT, t.set_point());
                n += 1;
                prop_assert!(n < 400_000);
            }
            let (last, ..) = targets[targets.len() - 1];
            prop_assert_eq!(t.set_point().to_array(), last);
        }

        #[test]
        fn a_line_is_straight(to in coordinates(), speed in 1.0f64..50.0) {
            let mut t = Trajectory::at_rest(Motion::default(), point([0.0; 3]));
            t.go(point(to), speed);
            while !t.is_still() {
                t.step(DT, t.set_point());
                let p = t.set_point().to_array();
                prop_assert!(distance_from_ray(p, [0.0; 3], to) < 1e-9);
            }
        }
    }

    #[test]
    fn a_tip_that_does_not_follow_stops_the_set_point_within_the_lead() {
        let limits = Motion::default();
        let stuck = point([0.0; 3]);
        let mut t = Trajectory::at_rest(limits, stuck);
        t.go(point([0.0, 0.0, -10.0]), 20.0);
        for _ in 0..20_000 {
            t.step(DT, stuck);
            assert!(t.set_point().distance_mm(stuck) <= limits.max_lead_mm);
        }
        assert!(t.set_point().z_mm < -0.9 * limits.max_lead_mm && !t.is_still());
        // Once released, it arrives.
        for _ in 0..20_000 {
            t.step(DT, t.set_point());
        }
        assert_eq!(t.set_point().to_array(), [0.0, 0.0, -10.0]);
    }

    #[test]
    fn a_deeper_target_on_the_same_line_needs_no_stop() {
        let mut t = Trajectory::at_rest(Motion::default(), point([1.0, 2.0, 5.0]));
        t.go(point([1.0, 2.0, 0.0]), 10.0);
        let mut slowest = f64::INFINITY;
        for n in 0..2000 {
            if n == 700 {
                t.go(point([1.0, 2.0, -3.0]), 5.0);
            }
            let before = t.set_point();
            t.step(DT, before);
            let speed = t.set_point().distance_mm(before) / DT;
            if (500..1000).contains(&n) {
                slowest = slowest.min(speed);
            }
        }
        assert!((4.8..5.1).contains(&slowest), "{slowest} mm/s");
        t.hold();
        for _ in 0..2000 {
            t.step(DT, t.set_point());
        }
        assert!(t.is_still());
    }
}
