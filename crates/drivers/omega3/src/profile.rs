//! Motion along one line with limited speed, acceleration and jerk, computed step by step.
//!
//! At every step the hardest jerk toward the wanted speed is taken that still leaves room to stop; otherwise the
//! profile brakes. The stopping distance is the closed form of the time-optimal jerk-limited stop (as in any text on
//! S-curve profiles, for example Biagiotti and Melchiorri, "Trajectory planning for automatic machines", ch. 3).

/// Limits of a profile, all above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pacing {
    /// mm/s.
    pub speed: f64,
    /// mm/s².
    pub acceleration: f64,
    /// mm/s³.
    pub jerk: f64,
}

/// Closer than this, at this small a speed, the end is reached, mm.
const ARRIVED_MM: f64 = 1e-4;

/// Longest time over which the jerk is constant, s.
const LONGEST_STEP_S: f64 = 0.000_25;

/// A point on its way along a line. Never goes back, never passes the end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    pacing: Pacing,
    length: f64,
    s: f64,
    v: f64,
    a: f64,
}

impl Profile {
    /// At rest at the beginning of `length` mm.
    #[must_use]
    pub const fn at_rest(length: f64, pacing: Pacing) -> Self {
        Self {
            pacing,
            length,
            s: 0.0,
            v: 0.0,
            a: 0.0,
        }
    }

    /// How far along, mm.
    #[must_use]
    pub const fn travelled(&self) -> f64 {
        self.s
    }

    /// Largest speed from here on, mm/s; above 0.
    #[must_use]
    pub(crate) fn top_speed(&self) -> f64 {
        self.pacing.speed.max(self.coming_speed()).max(self.v)
    }

    /// True when the end is reached and nothing moves.
    #[must_use]
    pub(crate) fn is_done(&self) -> bool {
        self.s >= self.length
    }

    /// Whether a stop at `length` mm is still possible.
    #[must_use]
    pub(crate) fn can_stop_at(&self, length: f64) -> bool {
        self.s + self.stopping(self.v, self.a) <= length
    }

    /// Goes on from here, at the present speed, along another line of `length` mm. The caller knows that it can
    /// still stop there.
    #[must_use]
    pub const fn onto(self, length: f64, pacing: Pacing) -> Self {
        Self {
            pacing,
            length,
            s: 0.0,
            ..self
        }
    }

    /// Ends as soon as it can stop.
    pub(crate) fn cut_short(&mut self) {
        self.length = self.length.min(self.s + self.stopping(self.v, self.a));
    }

    /// Forgets its speed: the next step starts from rest.
    pub const fn halt(&mut self) {
        self.v = 0.0;
        self.a = 0.0;
    }

    /// Goes on for `dt` seconds.
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
        let jerk = self.pacing.jerk;
        let crawl = (jerk * dt * dt).max(ARRIVED_MM / dt);
        if self.length - self.s <= ARRIVED_MM && self.v <= crawl {
            self.s = self.length;
            self.halt();
            return;
        }
        // The hardest jerk that neither leads to too high a speed nor past the end.
        *self = [jerk, 0.5 * jerk, 0.0, -0.5 * jerk]
            .into_iter()
            .map(|jerk| self.after(jerk, dt))
            .find(|next| next.coming_speed() <= self.pacing.speed && next.can_stop())
            .unwrap_or_else(|| self.after(-jerk, dt));
    }

    /// The speed that would remain if the acceleration were taken back now.
    fn coming_speed(&self) -> f64 {
        self.v + self.a * self.a.abs() / (2.0 * self.pacing.jerk)
    }

    fn can_stop(&self) -> bool {
        self.can_stop_at(self.length + 1e-9)
    }

    /// Where constant `jerk` leads within `dt`, the acceleration kept within its limit.
    fn after(&self, jerk: f64, dt: f64) -> Self {
        let limit = self.pacing.acceleration;
        let a = (self.a + jerk * dt).clamp(-limit, limit);
        let v = self.v + 0.5 * (self.a + a) * dt;
        let (v, a) = if v <= 0.0 { (0.0, a.max(0.0)) } else { (v, a) };
        let s = (self.s + 0.5 * (self.v + v) * dt).min(self.length);
        Self { s, v, a, ..*self }
    }

    /// Distance of the quickest stop from speed `v` and acceleration `a`, mm.
    fn stopping(&self, v: f64, a: f64) -> f64 {
        let j = self.pacing.jerk;
        let t = a.abs() / j;
        if a >= 0.0 {
            // First take the acceleration back, then stop from the top speed.
            v * t + a * t * t / 3.0 + self.stopping_from_top(v + 0.5 * a * t)
        } else {
            // Already braking: a later part of a stop that began at a higher speed.
            let top = v - 0.5 * a * t;
            if top < a * a / j {
                // Braking harder than the rest needs: it comes to rest while still letting go.
                let t = (-a - (a * a - 2.0 * j * v).max(0.0).sqrt()) / j;
                return v * t + a * t * t / 2.0 + j * t * t * t / 6.0;
            }
            (self.stopping_from_top(top) - (top * t - j * t * t * t / 6.0)).max(0.0)
        }
    }

    /// Distance of the quickest stop from speed `v` without acceleration, mm.
    fn stopping_from_top(&self, v: f64) -> f64 {
        let (limit, j) = (self.pacing.acceleration, self.pacing.jerk);
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
        fn limits_hold_and_the_end_is_reached_in_near_ideal_time(
            length in 0.001f64..80.0, speed in 0.5f64..50.0, acceleration in 20.0f64..1000.0,
            jerk in 500.0f64..50_000.0, seed in 0u64..1000,
        ) {
            let pacing = Pacing { speed, acceleration, jerk };
            let mut p = Profile::at_rest(length, pacing);
            let mut t = 0.0;
            let mut noise = seed;
            while !p.is_done() {
                // A cycle that comes early or late, up to four times its half millisecond.
                noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let dt = 0.000_5 * (0.5 + 3.5 * ((noise >> 40) as f64 / (1u64 << 24) as f64));
                let before = p;
                p.step(dt);
                t += dt;
                prop_assert!(t < 300.0, "never arrives: {p:?}");
                prop_assert!(p.s >= before.s && p.s <= length, "{before:?} {p:?}");
                prop_assert!(p.v <= speed + 1e-3, "{p:?}");
                prop_assert!(p.a.abs() <= acceleration + 1e-9);
                // At the end, and within rounding of rest, the acceleration ends at once.
                let rests = before.v <= before.a * before.a / (2.0 * jerk) + 1e-3;
                prop_assert!(rests || p.is_done() || (p.a - before.a).abs() <= jerk * dt + 1e-9, "{before:?} {p:?}");
            }
            let top = Profile::at_rest(0.0, pacing);
            let ramp = 2.0 * top.stopping_from_top(speed);
            let ideal = if length >= ramp {
                (length - ramp) / speed + 2.0 * ramp / speed
            } else {
                // Too short for full speed: at most twice the time of an endless-acceleration bang-bang in jerk.
                4.0 * (length / (2.0 * jerk)).cbrt() + 2.0 * (length / acceleration).sqrt()
            };
            prop_assert!(t <= 1.1 * ideal + 0.1, "{t} s for {ideal} s");
        }

        #[test]
        fn a_cut_profile_stops_at_once_within_its_limits(
            length in 1.0f64..80.0, speed in 1.0f64..50.0, share in 0.0f64..1.0,
        ) {
            let pacing = Pacing { speed, acceleration: 200.0, jerk: 4000.0 };
            let mut p = Profile::at_rest(length, pacing);
            let steps = (share * 2000.0 * length / speed) as usize;
            for _ in 0..steps {
                p.step(0.0005);
            }
            let (from, v) = (p.s, p.v);
            p.cut_short();
            let mut n = 0;
            while !p.is_done() {
                p.step(0.0005);
                n += 1;
                prop_assert!(n < 4000, "{p:?}");
            }
            // Taking the acceleration back adds at most 200² / (2 * 4000) mm/s.
            let allowance = (v + 5.0) * ((v + 5.0) / 200.0 + 0.1);
            prop_assert!(p.s - from <= allowance && p.s <= length, "{} mm from {v} mm/s", p.s - from);
        }
    }
}
