//! Motion profile along a line with limited speed, acceleration and jerk, computed step by step.
//!
//! Each step uses the largest jerk toward the requested speed that still allows a stop at the end; otherwise it brakes. The stopping
//! distance is the closed form of the time-optimal jerk-limited stop (as in any text on S-curve profiles, for example Biagiotti and
//! Melchiorri, "Trajectory planning for automatic machines", ch. 3).

/// Limits of a profile, all positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileLimits {
    /// mm/s.
    pub speed: f64,
    /// mm/s².
    pub acceleration: f64,
    /// mm/s³.
    pub jerk: f64,
}

/// Distance to the end that counts as arrived, at a correspondingly small speed, mm.
const ARRIVED_MM: f64 = 1e-4;

/// Longest time step with constant jerk, s.
const LONGEST_STEP_S: f64 = 0.000_25;

/// State of a motion along a line. It never reverses and never passes the end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    limits: ProfileLimits,
    length: f64,
    s: f64,
    v: f64,
    a: f64,
}

impl Profile {
    /// At rest at the start of a line of `length` mm.
    #[must_use]
    pub const fn at_rest(length: f64, limits: ProfileLimits) -> Self {
        Self {
            limits,
            length,
            s: 0.0,
            v: 0.0,
            a: 0.0,
        }
    }

    /// Distance travelled, mm.
    #[must_use]
    pub const fn travelled(&self) -> f64 {
        self.s
    }

    /// Largest speed from here on, mm/s; positive.
    #[must_use]
    pub(crate) fn top_speed(&self) -> f64 {
        self.limits.speed.max(self.final_speed()).max(self.v)
    }

    /// Whether the end is reached and the motion has stopped.
    #[must_use]
    pub(crate) fn is_done(&self) -> bool {
        self.s >= self.length
    }

    /// Whether a stop at `length` mm is still possible.
    #[must_use]
    pub(crate) fn can_stop_at(&self, length: f64) -> bool {
        self.s + self.stopping_distance(self.v, self.a) <= length
    }

    /// Continues at the current speed along another line of `length` mm. The caller has checked that it can still stop there.
    #[must_use]
    pub(crate) const fn continue_on(self, length: f64, limits: ProfileLimits) -> Self {
        Self {
            limits,
            length,
            s: 0.0,
            ..self
        }
    }

    /// Ends the motion at the earliest possible stop.
    pub(crate) fn stop_early(&mut self) {
        self.length = self
            .length
            .min(self.s + self.stopping_distance(self.v, self.a));
    }

    /// Sets the speed to zero: the next step starts from rest.
    pub const fn halt(&mut self) {
        self.v = 0.0;
        self.a = 0.0;
    }

    /// Advances by `dt` seconds.
    pub fn step(&mut self, dt: f64) {
        let parts = (dt / LONGEST_STEP_S).ceil().max(1.0);
        for _ in 0..parts as u32 {
            self.small_step(dt / parts);
        }
    }

    fn small_step(&mut self, dt: f64) {
        if self.is_done() || dt <= 0.0 {
            return;
        }
        let jerk = self.limits.jerk;
        let crawl = (jerk * dt * dt).max(ARRIVED_MM / dt);
        if self.length - self.s <= ARRIVED_MM && self.v <= crawl {
            self.s = self.length;
            self.halt();
            return;
        }
        // The largest jerk that neither exceeds the speed nor passes the end.
        *self = [jerk, 0.5 * jerk, 0.0, -0.5 * jerk]
            .into_iter()
            .map(|jerk| self.after(jerk, dt))
            .find(|next| next.final_speed() <= self.limits.speed && next.can_stop())
            .unwrap_or_else(|| self.after(-jerk, dt));
    }

    /// Speed after reducing the acceleration to zero from now on.
    fn final_speed(&self) -> f64 {
        self.v + self.a * self.a.abs() / (2.0 * self.limits.jerk)
    }

    fn can_stop(&self) -> bool {
        self.can_stop_at(self.length + 1e-9)
    }

    /// State after `dt` with constant `jerk` and limited acceleration.
    fn after(&self, jerk: f64, dt: f64) -> Self {
        let limit = self.limits.acceleration;
        let a = (self.a + jerk * dt).clamp(-limit, limit);
        let v = self.v + 0.5 * (self.a + a) * dt;
        let (v, a) = if v <= 0.0 { (0.0, a.max(0.0)) } else { (v, a) };
        let s = (self.s + 0.5 * (self.v + v) * dt).min(self.length);
        Self { s, v, a, ..*self }
    }

    /// Shortest stopping distance from speed `v` and acceleration `a`, mm.
    fn stopping_distance(&self, v: f64, a: f64) -> f64 {
        let j = self.limits.jerk;
        let t = a.abs() / j;
        if a >= 0.0 {
            // First reduce the acceleration to zero, then stop from the top speed.
            v * t + a * t * t / 3.0 + self.stopping_distance_from(v + 0.5 * a * t)
        } else {
            // Already braking: the remaining part of a stop that started at a higher speed.
            let top = v - 0.5 * a * t;
            if top < a * a / j {
                // Braking harder than necessary: it stops while the deceleration is reduced.
                let t = (-a - (a * a - 2.0 * j * v).max(0.0).sqrt()) / j;
                return v * t + a * t * t / 2.0 + j * t * t * t / 6.0;
            }
            (self.stopping_distance_from(top) - (top * t - j * t * t * t / 6.0)).max(0.0)
        }
    }

    /// Shortest stopping distance from speed `v` without acceleration, mm.
    fn stopping_distance_from(&self, v: f64) -> f64 {
        let (limit, j) = (self.limits.acceleration, self.limits.jerk);
        let time = if v >= limit * limit / j {
            v / limit + limit / j
        } else {
            2.0 * (v / j).sqrt()
        };
        0.5 * v * time
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn limits_hold_and_the_end_is_reached_in_nearly_ideal_time(
            length in 0.001f64..80.0, speed in 0.5f64..50.0, acceleration in 20.0f64..1000.0,
            jerk in 500.0f64..50_000.0, seed in 0u64..1000,
        ) {
            let limits = ProfileLimits { speed, acceleration, jerk };
            let mut p = Profile::at_rest(length, limits);
            let mut t = 0.0;
            let mut noise = seed;
            while !p.is_done() {
                // Cycles of a nominal half millisecond, from half to four times as long.
                noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let dt = 0.000_5 * (0.5 + 3.5 * ((noise >> 40) as f64 / (1u64 << 24) as f64));
                let before = p;
                p.step(dt);
                t += dt;
                prop_assert!(t < 300.0, "never arrives: {p:?}");
                prop_assert!(p.s >= before.s && p.s <= length, "{before:?} {p:?}");
                prop_assert!(p.v <= speed + 1e-3, "{p:?}");
                prop_assert!(p.a.abs() <= acceleration + 1e-9);
                // At the end, and within rounding of rest, the acceleration may drop to zero at once.
                let rests = before.v <= before.a * before.a / (2.0 * jerk) + 1e-3;
                prop_assert!(rests || p.is_done() || (p.a - before.a).abs() <= jerk * dt + 1e-9, "{before:?} {p:?}");
            }
            let top = Profile::at_rest(0.0, limits);
            let ramp = 2.0 * top.stopping_distance_from(speed);
            let ideal = if length >= ramp {
                (length - ramp) / speed + 2.0 * ramp / speed
            } else {
                // Too short for full speed: at most twice the time of a bang-bang jerk profile without acceleration limit.
                4.0 * libm::cbrt(length / (2.0 * jerk)) + 2.0 * (length / acceleration).sqrt()
            };
            prop_assert!(t <= 1.1 * ideal + 0.1, "{t} s for {ideal} s");
        }

        #[test]
        fn a_cut_profile_stops_at_once_within_its_limits(
            length in 1.0f64..80.0, speed in 1.0f64..50.0, share in 0.0f64..1.0,
        ) {
            let limits = ProfileLimits { speed, acceleration: 200.0, jerk: 4000.0 };
            let mut p = Profile::at_rest(length, limits);
            let steps = (share * 2000.0 * length / speed) as usize;
            for _ in 0..steps {
                p.step(0.0005);
            }
            let (from, v) = (p.s, p.v);
            p.stop_early();
            let mut n = 0;
            while !p.is_done() {
                p.step(0.0005);
                n += 1;
                prop_assert!(n < 4000, "{p:?}");
            }
            // Reducing the acceleration to zero adds at most 200² / (2 * 4000) mm/s.
            let allowance = (v + 5.0) * ((v + 5.0) / 200.0 + 0.1);
            prop_assert!(p.s - from <= allowance && p.s <= length, "{} mm from {v} mm/s", p.s - from);
        }
    }
}
