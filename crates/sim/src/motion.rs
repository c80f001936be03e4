//! Motion of the simulated robot: a set point with limited acceleration, a lagging tip, noise, and force.

use skinrig_model::{Point3, Robot};

use crate::random::{Purpose, Stream};

/// Time step of the motion, s.
const DT_S: f64 = 1e-3;

/// Motion parameters. Values marked *assumed* have no public source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionConfig {
    /// Acceleration and deceleration of the set point, mm/s² (omega3.md quotes public sample values of 0.1 to 10 m/s²; assumed within this
    /// range).
    pub acceleration_mm_s2: f64,
    /// Natural frequency of the tip behind its set point, rad/s (assumed).
    pub lag_rad_s: f64,
    /// Damping ratio of the tip (assumed).
    pub damping: f64,
    /// Standard deviation of the tip's wander per axis, mm (assumed).
    pub wander_mm: f64,
    /// Correlation time of the wander, s (assumed).
    pub wander_s: f64,
    /// Standard deviation of the position measurement, per axis, mm (assumed).
    pub measurement_mm: f64,
    /// Standard deviation of the force measurement, N (assumed).
    pub force_noise_n: f64,
    /// Skin stiffness under the flat tip, N/mm: for a punch of radius a on a half space `2 a E*`; 5 mm and
    /// 60 kPa give 0.6. The stiffness of the paper's 30:1 PDMS is not published (assumed).
    pub skin_n_per_mm: f64,
    /// Viscous part of the contact force, N s/mm (assumed).
    pub skin_n_s_per_mm: f64,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            acceleration_mm_s2: 500.0,
            lag_rad_s: 90.0,
            damping: 0.9,
            wander_mm: 0.004,
            wander_s: 0.02,
            measurement_mm: 0.003,
            force_noise_n: 0.02,
            skin_n_per_mm: 0.6,
            skin_n_s_per_mm: 0.01,
        }
    }
}

/// State of the motion in the robot frame, in steps of one millisecond.
#[derive(Debug, Clone)]
pub struct Motion {
    config: MotionConfig,
    noise: Stream,
    target: Option<([f64; 3], f64)>,
    set_point: [f64; 3],
    set_velocity: [f64; 3],
    tip: [f64; 3],
    velocity: [f64; 3],
    wander: [f64; 3],
    powered: bool,
    /// Factor on the lag frequency; reduced by a fault.
    pub bandwidth: f64,
    /// Whether a fault holds the tip in place.
    pub stalled: bool,
}

impl Motion {
    /// At rest with the brakes on.
    #[must_use]
    pub fn new(config: MotionConfig, seed: u64, legs_before: u32, at: Point3<Robot>) -> Self {
        Self {
            config,
            noise: Stream::new(seed, Purpose::Robot, u64::from(legs_before)),
            target: None,
            set_point: at.to_array(),
            set_velocity: [0.0; 3],
            tip: at.to_array(),
            velocity: [0.0; 3],
            wander: [0.0; 3],
            powered: false,
            bandwidth: 1.0,
            stalled: false,
        }
    }

    /// Switches the motors on and holds the current position.
    pub fn power_on(&mut self) {
        if !self.powered {
            self.powered = true;
            self.set_point = self.tip;
            self.set_velocity = [0.0; 3];
            self.target = None;
        }
    }

    /// Switches the motors off and the brakes on: the tip stays in place.
    pub fn power_off(&mut self) {
        self.powered = false;
        self.target = None;
        self.set_velocity = [0.0; 3];
        self.velocity = [0.0; 3];
    }

    /// Whether the motors are on.
    #[must_use]
    pub(crate) const fn is_powered(&self) -> bool {
        self.powered
    }

    /// Limits the acceleration of the set point from now on, mm/s².
    pub const fn set_acceleration(&mut self, acceleration_mm_s2: f64) {
        self.config.acceleration_mm_s2 = acceleration_mm_s2;
    }

    /// Moves the set point to `target` along a straight line.
    pub fn move_to(&mut self, target: Point3<Robot>, speed_mm_s: f64) {
        self.target = Some((target.to_array(), speed_mm_s));
    }

    /// Whether the set point is at rest.
    #[must_use]
    pub(crate) fn is_at_rest(&self) -> bool {
        self.set_velocity == [0.0; 3]
    }

    /// Stops the set point.
    pub fn hold(&mut self) {
        self.target = None;
    }

    /// The set point.
    #[must_use]
    pub fn set_point(&self) -> Point3<Robot> {
        point(self.set_point)
    }

    /// True tip position, including wander.
    #[must_use]
    pub fn tip(&self) -> Point3<Robot> {
        point(std::array::from_fn(|i| self.tip[i] + self.wander[i]))
    }

    /// Measured tip position. Draws noise: call once per step.
    pub fn measure(&mut self) -> Point3<Robot> {
        let tip = self.tip().to_array();
        let sigma = self.config.measurement_mm;
        point(tip.map(|c| c + sigma * self.noise.gauss()))
    }

    /// Force that pushes the tip out of the skin at `depth_mm` (positive below the surface) and `rate_mm_s`, without and with measurement noise,
    /// N. Call once per step.
    pub fn force_n(&mut self, depth_mm: f64, rate_mm_s: f64) -> (f64, f64) {
        let c = &self.config;
        let push = if depth_mm > 0.0 {
            (c.skin_n_per_mm * depth_mm + c.skin_n_s_per_mm * rate_mm_s).max(0.0)
        } else {
            0.0
        };
        (push, push + c.force_noise_n * self.noise.gauss())
    }

    /// Simulates one millisecond.
    pub fn step(&mut self) {
        self.step_set_point();
        self.step_tip();
    }

    fn step_set_point(&mut self) {
        let a_dt = self.config.acceleration_mm_s2 * DT_S;
        let target_velocity = match self.target {
            None => [0.0; 3],
            Some((target, speed)) => {
                let way: [f64; 3] = std::array::from_fn(|i| target[i] - self.set_point[i]);
                let left = norm(way);
                if left <= a_dt * DT_S && norm(self.set_velocity) <= 2.0 * a_dt {
                    self.set_point = target;
                    self.set_velocity = [0.0; 3];
                    return;
                }
                // The largest speed from which the set point can still stop in time, in steps of DT_S.
                let stoppable = a_dt * ((0.25 + 2.0 * left / (a_dt * DT_S)).sqrt() - 0.5);
                let v = speed.min(stoppable).min(left / DT_S);
                way.map(|c| c / left * v)
            }
        };
        let change: [f64; 3] = std::array::from_fn(|i| target_velocity[i] - self.set_velocity[i]);
        let size = norm(change);
        let share = if size > a_dt { a_dt / size } else { 1.0 };
        for (i, by) in change.into_iter().enumerate() {
            self.set_velocity[i] += by * share;
            self.set_point[i] += self.set_velocity[i] * DT_S;
        }
    }

    fn step_tip(&mut self) {
        let c = self.config;
        let w = c.lag_rad_s * self.bandwidth;
        let keep = 1.0 - DT_S / c.wander_s;
        let kick = c.wander_mm * (1.0 - keep * keep).sqrt();
        for i in 0..3 {
            let noise = self.noise.gauss();
            if !self.powered || self.stalled {
                continue; // braked; the draw keeps both random streams in step
            }
            let pull = w * w * (self.set_point[i] - self.tip[i]);
            self.velocity[i] += (pull - 2.0 * c.damping * w * self.velocity[i]) * DT_S;
            self.tip[i] += self.velocity[i] * DT_S;
            self.wander[i] = self.wander[i] * keep + kick * noise;
        }
    }
}

const fn point(p: [f64; 3]) -> Point3<Robot> {
    Point3::new(p[0], p[1], p[2])
}

fn norm(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn set_point_goes_straight_with_limited_speed_and_acceleration(
            to in prop::array::uniform3(-40.0f64..40.0), speed in 1.0f64..60.0,
        ) {
            let mut m = Motion::new(MotionConfig::default(), 1, 0, Point3::new(0.0, 0.0, 0.0));
            m.power_on();
            m.move_to(Point3::new(to[0], to[1], to[2]), speed);
            let length = norm(to);
            let (mut last, mut last_v, mut t) = ([0.0; 3], [0.0; 3], 0);
            while m.set_point != to {
                m.step();
                t += 1;
                prop_assert!(t < 60_000, "never arrives");
                let p = m.set_point;
                let v: [f64; 3] = std::array::from_fn(|i| (p[i] - last[i]) / DT_S);
                let dv: [f64; 3] = std::array::from_fn(|i| v[i] - last_v[i]);
                prop_assert!(norm(v) <= speed + 1e-6);
                prop_assert!(norm(dv) <= 2.0 * 0.5 + 1e-6, "acceleration {}", norm(dv) / DT_S);
                let along = (p[0] * to[0] + p[1] * to[1] + p[2] * to[2]) / (length * length);
                let off: [f64; 3] = std::array::from_fn(|i| p[i] - along * to[i]);
                prop_assert!(norm(off) < 1e-6);
                (last, last_v) = (p, v);
            }
            let ideal_s = length / speed + speed / 500.0;
            prop_assert!(f64::from(t) * DT_S <= ideal_s * 1.05 + 0.05, "{t} ms for {ideal_s} s");
        }
    }

    #[test]
    fn tip_lags_then_settles() {
        let mut m = Motion::new(MotionConfig::default(), 1, 0, Point3::new(0.0, 0.0, 0.0));
        m.power_on();
        m.move_to(Point3::new(10.0, 0.0, 0.0), 20.0);
        for _ in 0..200 {
            m.step();
        }
        let lag = m.set_point().x_mm - m.tip().x_mm;
        assert!((lag - 20.0 * 2.0 * 0.9 / 90.0).abs() < 0.05, "{lag}");
        for _ in 0..1000 {
            m.step();
        }
        assert!(m.tip().distance_mm(Point3::new(10.0, 0.0, 0.0)) < 0.03);
    }

    #[test]
    fn brakes_keep_the_tip() {
        let mut m = Motion::new(MotionConfig::default(), 1, 0, Point3::new(1.0, 2.0, 3.0));
        m.move_to(Point3::new(10.0, 0.0, 0.0), 20.0);
        m.target = None;
        for _ in 0..50 {
            m.step();
        }
        assert_eq!(m.tip().to_array(), [1.0, 2.0, 3.0]);
    }
}
