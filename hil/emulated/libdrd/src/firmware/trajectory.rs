//! Set points of a motion: a straight line with limited jerk, and a filter per axis.

use std::collections::VecDeque;

use super::vector::{Vector, add, norm, scale, sub};

/// Limits of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// m/s^2.
    pub amax: f64,
    /// m/s.
    pub vmax: f64,
    /// m/s^3.
    pub jerk: f64,
}

/// The fastest straight line from rest to rest within the limits, with continuous acceleration.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    from: Vector,
    direction: Vector,
    length: f64,
    jerk: f64,
    /// Duration of each phase of constant jerk, s.
    jerk_s: f64,
    /// Duration of the acceleration, s; the deceleration takes as long.
    ramp_s: f64,
    /// Speed between the ramps, m/s.
    speed: f64,
    /// Total duration, s.
    total_s: f64,
}

/// Duration of a constant-jerk phase, and of the whole ramp from rest to `speed`, s.
fn ramp(speed: f64, limits: Limits) -> (f64, f64) {
    if speed * limits.jerk <= limits.amax * limits.amax {
        let jerk_s = (speed / limits.jerk).sqrt();
        (jerk_s, 2.0 * jerk_s)
    } else {
        let jerk_s = limits.amax / limits.jerk;
        (jerk_s, jerk_s + speed / limits.amax)
    }
}

impl Line {
    /// The line from `from` to `to`.
    pub fn new(from: Vector, to: Vector, limits: Limits) -> Self {
        let way = sub(to, from);
        let length = norm(way);
        let direction = if length > 0.0 {
            scale(way, 1.0 / length)
        } else {
            way
        };
        let mut speed = limits.vmax;
        let ramps = |speed: f64| speed * ramp(speed, limits).1;
        if ramps(speed) > length {
            // Too short for full speed: use the peak speed whose two ramps cover the distance.
            let (mut low, mut high) = (0.0, speed);
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                if ramps(middle) > length {
                    high = middle
                } else {
                    low = middle
                }
            }
            speed = low;
        }
        let (jerk_s, ramp_s) = ramp(speed, limits);
        let cruise_s = if speed > 0.0 {
            (length - speed * ramp_s) / speed
        } else {
            0.0
        };
        let total_s = 2.0 * ramp_s + cruise_s.max(0.0);
        Self {
            from,
            direction,
            length,
            jerk: limits.jerk,
            jerk_s,
            ramp_s,
            speed,
            total_s,
        }
    }

    /// Distance travelled `t` seconds into the ramp.
    fn ramp_distance(&self, t: f64) -> f64 {
        let (j, t1) = (self.jerk, self.jerk_s);
        if t < t1 {
            j * t.powi(3) / 6.0
        } else if t < self.ramp_s - t1 {
            let later = t - t1;
            j * t1.powi(3) / 6.0 + j * t1 * t1 / 2.0 * later + j * t1 / 2.0 * later * later
        } else {
            let left = self.ramp_s - t;
            self.speed * self.ramp_s / 2.0 - (self.speed * left - j * left.powi(3) / 6.0)
        }
    }

    /// Set point `t` seconds after the start, and whether it is the end.
    pub fn at(&self, t: f64) -> (Vector, bool) {
        let way = if t >= self.total_s {
            self.length
        } else if t < self.ramp_s {
            self.ramp_distance(t)
        } else if t < self.total_s - self.ramp_s {
            self.ramp_distance(self.ramp_s) + self.speed * (t - self.ramp_s)
        } else {
            self.length - self.ramp_distance(self.total_s - t)
        };
        (
            add(self.from, scale(self.direction, way)),
            t >= self.total_s,
        )
    }
}

/// One axis that follows a changing target without jumps in position, speed or acceleration.
///
/// A set point with limited acceleration, averaged over the time required by the jerk limit. The mean of a signal without overshoot has
/// none either.
#[derive(Debug, Clone)]
pub struct Follower {
    /// Set point, m.
    pub position: f64,
    /// Set point before averaging, m, and its speed, m/s.
    raw: f64,
    raw_speed: f64,
    /// Unfiltered set points of the averaging window, oldest first, m.
    window: VecDeque<f64>,
    /// Sum of the window, m.
    sum: f64,
}

/// Distance to the target that counts as arrived despite rounding, m.
const ARRIVED_M: f64 = 1e-12;

impl Follower {
    /// At rest at a position.
    pub fn at_rest(position: f64) -> Self {
        Self {
            position,
            raw: position,
            raw_speed: 0.0,
            window: VecDeque::new(),
            sum: 0.0,
        }
    }

    /// Advances by `dt` seconds; returns whether the target is reached and held.
    pub fn follow(&mut self, target: f64, limits: Limits, dt: f64) -> bool {
        let left = target - self.raw;
        // The largest speed that still allows a stop at the target and does not pass it in this step.
        let able = (2.0 * limits.amax * left.abs())
            .sqrt()
            .min(limits.vmax)
            .min(left.abs() / dt);
        let change = limits.amax * dt;
        self.raw_speed = able
            .copysign(left)
            .clamp(self.raw_speed - change, self.raw_speed + change);
        self.raw += self.raw_speed * dt;
        self.average(limits, dt);
        let there =
            (target - self.position).abs() < ARRIVED_M && (target - self.raw).abs() < ARRIVED_M;
        if there {
            *self = Self::at_rest(target);
        }
        there
    }

    /// Acceleration changes by at most twice its limit, so averaging over twice amax / jerk is enough.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a number of steps, kept within bounds"
    )]
    fn average(&mut self, limits: Limits, dt: f64) {
        let steps = (2.0 * limits.amax / limits.jerk / dt)
            .ceil()
            .clamp(1.0, MAX_STEPS) as usize;
        while self.window.len() + 1 < steps {
            self.window.push_front(self.position);
            self.sum += self.position;
        }
        self.window.push_back(self.raw);
        self.sum += self.raw;
        while self.window.len() > steps {
            self.sum -= self.window.pop_front().unwrap_or_default();
        }
        self.position = self.sum / self.window.len() as f64;
    }
}

/// Longest averaging window, steps of the loop: four seconds at 4 kHz.
const MAX_STEPS: f64 = 16_000.0;

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        amax: 0.1,
        vmax: 0.02,
        jerk: 1.0,
    };

    /// Largest speed, acceleration and jerk of sampled positions.
    fn extremes(ways: &[f64], dt: f64) -> [f64; 3] {
        let slope = |v: &[f64]| v.windows(2).map(|w| (w[1] - w[0]) / dt).collect::<Vec<_>>();
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let velocity = slope(ways);
        let acceleration = slope(&velocity);
        [
            largest(&velocity),
            largest(&acceleration),
            largest(&slope(&acceleration)),
        ]
    }

    #[test]
    fn a_line_arrives_within_its_limits_whether_it_is_long_or_short() {
        for length in [1e-4, 1e-3, 5e-3, 0.05] {
            let line = Line::new([0.01, 0.0, 0.02], [0.01, 0.0, 0.02 - length], LIMITS);
            let dt = line.total_s / 2000.0;
            let ways: Vec<f64> = (0..=2001)
                .map(|i| 0.02 - line.at(f64::from(i) * dt).0[2])
                .collect();
            assert!(ways.windows(2).all(|w| w[1] >= w[0] - 1e-12));
            assert!((ways.last().unwrap() - length).abs() < 1e-12);
            let [velocity, acceleration, jerk] = extremes(&ways, dt);
            assert!(velocity <= LIMITS.vmax * 1.001, "{length}: {velocity} m/s");
            assert!(
                acceleration <= LIMITS.amax * 1.01,
                "{length}: {acceleration} m/s^2"
            );
            assert!(jerk <= LIMITS.jerk * 1.05, "{length}: {jerk} m/s^3");
        }
    }

    #[test]
    fn a_follower_settles_on_the_last_target_within_its_limits() {
        let dt = 2.5e-4;
        let mut axis = Follower::at_rest(0.0);
        let mut ways = Vec::new();
        let mut there = false;
        for step in 0..40_000 {
            // The target changes twice on the way.
            let target = match step {
                0..1000 => 0.01,
                1000..2000 => -0.005,
                _ => 0.002,
            };
            there = axis.follow(target, LIMITS, dt);
            ways.push(axis.position);
        }
        assert!(there && (axis.position - 0.002).abs() < 1e-9, "{axis:?}");
        // The last part approaches from above.
        assert!(ways[2000] > 0.003);
        let overshoot = ways[2000..].iter().fold(0.0_f64, |m, x| m.max(0.002 - x));
        assert!(overshoot < 1e-6, "{overshoot} m");
        let [velocity, acceleration, jerk] = extremes(&ways, dt);
        assert!(
            velocity <= LIMITS.vmax * 1.001 && acceleration <= LIMITS.amax * 1.05,
            "{velocity} {acceleration}"
        );
        assert!(
            jerk <= LIMITS.jerk * 1.1 + 2.0 * ARRIVED_M / dt.powi(3),
            "{jerk} m/s^3"
        );
    }
}
