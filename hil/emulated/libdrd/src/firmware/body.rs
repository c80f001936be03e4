//! The moving body: mass, gravity, friction, brake, end stops and sample.

use super::vector::{Vector, ZERO, add, dot, norm, scale, shorten, sub};
use crate::config::{ArmConfig, Contact};

/// Standard gravity, m/s^2.
pub const GRAVITY_M_S2: f64 = 9.81;
/// End stops: N/m and N per (m/s).
const END_STOP: (f64, f64) = (20_000.0, 60.0);

/// Direction of gravity in the robot frame of a base tilted about the inverted y axis.
pub fn gravity(mass_kg: f64, tilt_deg: f64) -> Vector {
    let (sin, cos) = libm::sincos(tilt_deg.to_radians());
    scale([-sin, 0.0, -cos], mass_kg * GRAVITY_M_S2)
}

/// The tip and everything that moves with it, as one mass.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    /// True position of the tip, m.
    pub position: Vector,
    /// m/s.
    pub velocity: Vector,
    /// Force of the sample on the tip, N.
    pub contact_force: Vector,
    /// The sample.
    pub contact: Option<Contact>,
    /// Whether it is blocked.
    pub stalled: bool,
    /// Additional viscous friction, N per (m/s).
    pub extra_friction_n_s_m: f64,
    weight: Vector,
}

impl Body {
    /// At rest at the configured position.
    pub fn new(config: &ArmConfig) -> Self {
        Self {
            position: config.start_m,
            velocity: ZERO,
            contact_force: ZERO,
            contact: config.contact,
            stalled: false,
            extra_friction_n_s_m: 0.0,
            weight: gravity(config.gravity_mass_kg, config.tilt_deg),
        }
    }

    /// Advances by `dt` seconds under a motor force, with or without the electromagnetic brake.
    pub fn step(&mut self, config: &ArmConfig, motor: Vector, braking: bool, dt: f64) {
        self.contact_force = self.push_of_sample();
        if self.stalled {
            self.velocity = ZERO;
            return;
        }
        let force = [
            self.weight,
            self.contact_force,
            self.push_of_end_stop(config),
            motor,
        ]
        .into_iter()
        .fold(ZERO, add);
        // Implicit viscous terms keep a brake of any strength stable. Dry friction follows; it never reverses the speed.
        let viscous = config.viscous_friction_n_s_m
            + self.extra_friction_n_s_m
            + if braking { config.brake_n_s_m } else { 0.0 };
        let pushed = add(self.velocity, scale(force, dt / config.inertia_kg));
        let free = scale(pushed, 1.0 / (1.0 + viscous * dt / config.inertia_kg));
        let dry = shorten(free, config.dry_friction_n * dt / config.inertia_kg);
        self.velocity = sub(free, dry);
        self.position = add(self.position, scale(self.velocity, dt));
    }

    fn push_of_sample(&self) -> Vector {
        let Some(contact) = self.contact else {
            return ZERO;
        };
        let normal = scale(contact.normal, 1.0 / norm(contact.normal));
        let depth = -dot(sub(self.position, contact.point_m), normal);
        if depth <= 0.0 {
            return ZERO;
        }
        let approach = -dot(self.velocity, normal);
        let push = contact.stiffness_n_m * depth + contact.damping_n_s_m * approach;
        scale(normal, push.max(0.0))
    }

    fn push_of_end_stop(&self, config: &ArmConfig) -> Vector {
        let outward = sub(self.position, config.reach_centre_m);
        let distance = norm(outward);
        let beyond = distance - config.reach_radius_m;
        if beyond <= 0.0 {
            return ZERO;
        }
        let outward = scale(outward, 1.0 / distance);
        let push = END_STOP.0 * beyond + END_STOP.1 * dot(self.velocity, outward);
        scale(outward, -push.max(0.0))
    }
}
