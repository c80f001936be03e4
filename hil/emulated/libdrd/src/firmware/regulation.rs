//! The regulation loop: set points from a motion, and a force from set point and pose.

use super::body::gravity;
use super::settings::Settings;
use super::trajectory::{Follower, Line};
use super::vector::{Vector, ZERO, add, norm, scale, shorten, sub};
use crate::config::ArmConfig;

/// What one unit of each gain means here: N/m, N/(m s), N/(m/s). The vendor's units are not documented.
const UNIT_GAINS: [f64; 3] = [1000.0, 5000.0, 50.0];
/// The integral term alone never wants more, N.
const INTEGRAL_LIMIT_N: f64 = 12.0;

/// Slower than this the arm is at rest, m/s.
const SETTLED_M_S: f64 = 1e-3;

/// Where the set points come from.
#[derive(Debug, Clone)]
enum Motion {
    Hold,
    Line { line: Line, elapsed_s: f64 },
    Track { target: Vector, axes: [Follower; 3] },
}

/// The state of the loop.
#[derive(Debug, Clone)]
pub struct Regulation {
    /// Set point, m.
    pub reference: Vector,
    motion: Motion,
    /// The last motion's set points are done, the arm is not at rest yet.
    settling: bool,
    integral: Vector,
    /// The motors cannot give what the loop wants.
    pub saturated: bool,
}

impl Regulation {
    /// Holds where the arm is.
    pub fn new(position: Vector) -> Self {
        Self {
            reference: position,
            motion: Motion::Hold,
            settling: false,
            integral: ZERO,
            saturated: false,
        }
    }

    /// Whether a motion is under way.
    pub fn moving(&self) -> bool {
        self.settling || !matches!(self.motion, Motion::Hold)
    }

    /// Drops any motion.
    pub fn hold(&mut self, position: Vector) {
        self.reference = position;
        self.motion = Motion::Hold;
    }

    /// A straight line from the present set point, from rest even if that moves.
    pub fn move_to(&mut self, target: Vector, settings: &Settings) {
        let line = Line::new(self.reference, target, settings.moves);
        self.motion = Motion::Line {
            line,
            elapsed_s: 0.0,
        };
        self.settling = true;
    }

    /// Follows a target from now on; raw without the filter.
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

    /// One iteration of `dt` seconds: the force that the motors are told, gravity compensation included.
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
        // The cap holds for the sum: with too low a ratio gravity compensation eats it up and the arm sinks.
        let wanted = add(servo, gravity_compensation(settings));
        let limit = settings.motor_ratio * config.max_force_n;
        self.saturated = norm(wanted) > limit;
        shorten(wanted, limit)
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

/// What gravity compensation adds.
pub fn gravity_compensation(settings: &Settings) -> Vector {
    if settings.gravity {
        scale(gravity(settings.effector_mass, settings.device_angle), -1.0)
    } else {
        ZERO
    }
}
