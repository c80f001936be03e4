//! Calibration and the sweep of the end stops, during which the library moves the arm.
//!
//! The vendor's paths are not documented. The calibration goes to the centre of the workspace; the
//! sweep goes to the ends of each axis, even through a sample.

use super::regulation::Regulation;
use super::trajectory::Limits;
use super::vector::Vector;
use super::world::World;
use crate::config::Fault;

/// Speed of these motions.
const LIMITS: Limits = Limits {
    amax: 2.0,
    vmax: 0.2,
    jerk: 50.0,
};

/// A calibration or sweep in progress.
#[derive(Debug)]
pub(crate) struct Initialisation {
    /// Remaining positions, last first.
    way: Vec<Vector>,
    /// Waiting time at the end, s.
    wait_s: f64,
}

impl World {
    /// Starts a calibration, optionally followed by a sweep.
    pub(crate) fn begin_initialisation(&mut self, sweep: bool) {
        let mut way = vec![self.config.reach_centre_m];
        if sweep {
            for axis in 0..3 {
                for end in [-1.0, 1.0] {
                    let mut direction = [0.0; 3];
                    direction[axis] = end;
                    way.push(self.inside(direction));
                }
            }
        }
        self.initialisation = Some(Initialisation {
            way,
            wait_s: self.config.auto_init_s,
        });
        self.start_regulation();
    }

    /// Advances by `dt` seconds.
    pub fn initialise(&mut self, dt: f64) {
        let (Some(initialisation), Some(regulation)) =
            (&mut self.initialisation, &mut self.regulation)
        else {
            return;
        };
        if self.faults.any(|f| matches!(f, Fault::AutoInitHangs)) || regulation.moving() {
            return;
        }
        if let Some(next) = initialisation.way.pop() {
            let mut settings = self.settings.clone();
            settings.moves = LIMITS;
            Regulation::move_to(regulation, next, &settings);
            return;
        }
        initialisation.wait_s -= dt;
        if initialisation.wait_s <= 0.0 {
            self.initialisation = None;
            self.initialised = true;
        }
    }
}
