//! The regulation loop: set points of a motion, and the force from set point and pose.

use super::body::gravity;
use super::settings::Settings;
use super::trajectory::{Follower, Line};
use super::vector::{Vector, ZERO, add, norm, scale, shorten, sub};
use crate::config::ArmConfig;

/// Meaning of one unit of each gain: N/m, N/(m s), N/(m/s). The vendor's units are not documented.
const UNIT_GAINS: [f64; 3] = [1000.0, 5000.0, 50.0];
/// Limit of the integral term, N.
const INTEGRAL_LIMIT_N: f64 = 12.0;

/// Speed below which the arm is at rest, m/s.
const SETTLED_M_S: f64 = 1e-3;

/// Source of the set points.
#[derive(Debug, Clone)]
enum Motion {
    Hold,
    Line { line: Line, elapsed_s: f64 },
    Track { target: Vector, axes: [Follower; 3] },
}

/// State of the loop.
#[derive(Debug, Clone)]
pub struct Regulation {
    /// Set point, m.
    pub reference: Vector,
    motion: Motion,
    /// The last motion's set points are complete, but the arm is not at rest yet.
    settling: bool,
    integral: Vector,
    /// Whether the motors are saturated.
    pub saturated: bool,
}

impl Regulation {
    /// Holds the current position.
    pub fn new(position: Vector) -> Self {
        Self {
            reference: position,
            motion: Motion::Hold,
            settling: false,
            integral: ZERO,
            saturated: false,
        }
    }

    /// Whether a motion is in progress.
    pub fn moving(&self) -> bool {
        self.settling || !matches!(self.motion, Motion::Hold)
    }

    /// Stops any motion.
    pub fn hold(&mut self, position: Vector) {
        self.reference = position;
        self.motion = Motion::Hold;
    }

    /// Starts a straight line from the current set point, from rest even if that moves.
    pub fn move_to(&mut self, target: Vector, settings: &Settings) {
        let line = Line::new(self.reference, target, settings.moves);
        self.motion = Motion::Line {
            line,
            elapsed_s: 0.0,
        };
        self.settling = true;
    }

    /// Follows a target from now on; unfiltered without the filter.
    pub fn track(&mut self, target: Vector, settings: &Settings) {
        if !settings.filter {
            self.hold(target);
            return;
        }
        let axes = match std::mem::replace(&mut self.motion, Motion::Hold) {
            Motion::Track { axes, .. } => axes,
            _ => self.reference.map(Follower::at_rest),
        };
        self.motion = Motion::Track { target, axes };
        self.settling = true;
    }

    /// One iteration of `dt` seconds: returns the commanded motor force including gravity compensation.
    pub(crate) fn iterate(
        &mut self,
        config: &ArmConfig,
        settings: &Settings,
        position: Vector,
        velocity: Vector,
        dt: f64,
    ) -> Vector {
        self.advance(settings, dt);
        if matches!(self.motion, Motion::Hold) && norm(velocity) < SETTLED_M_S {
            self.settling = false;
        }
        let [p, i, d]: [f64; 3] = std::array::from_fn(|n| settings.gains[n] * UNIT_GAINS[n]);
        let error = sub(self.reference, position);
        let servo = if settings.regulate[0] {
            self.integral = shorten(add(self.integral, scale(error, i * dt)), INTEGRAL_LIMIT_N);
            if i == 0.0 {
                self.integral = ZERO;
            }
            sub(add(scale(error, p), self.integral), scale(velocity, d))
        } else {
            self.integral = ZERO;
            ZERO
        };
        // The cap applies to the sum: a low ratio leaves too little for gravity compensation, and the arm sinks.
        let expected = add(servo, gravity_compensation(settings));
        let limit = settings.motor_ratio * config.max_force_n;
        self.saturated = norm(expected) > limit;
        shorten(expected, limit)
    }

    fn advance(&mut self, settings: &Settings, dt: f64) {
        match &mut self.motion {
            Motion::Hold => {}
            Motion::Line { line, elapsed_s } => {
                *elapsed_s += dt;
                let (reference, done) = line.at(*elapsed_s);
                self.reference = reference;
                if done {
                    self.motion = Motion::Hold;
                }
            }
            Motion::Track { target, axes } => {
                let mut there = true;
                for (axis, target) in axes.iter_mut().zip(*target) {
                    there &= axis.follow(target, settings.tracking, dt);
                }
                self.reference = axes.each_ref().map(|a| a.position);
                if there {
                    self.motion = Motion::Hold;
                }
            }
        }
    }
}

/// Contribution of gravity compensation.
pub fn gravity_compensation(settings: &Settings) -> Vector {
    if settings.gravity {
        scale(gravity(settings.effector_mass, settings.device_angle), -1.0)
    } else {
        ZERO
    }
}
