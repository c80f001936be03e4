//! The moments of a run as the simulated robot sees them: what [`Moment`] means.

use skinrig_model::{Point3, Skin};

use crate::faults::Moment;

/// A motion sideways is longer than this, mm.
const SIDEWAYS_MM: f64 = 0.5;
/// A motion down to the skin ends below this height, mm.
const NEAR_MM: f64 = 1.5;

/// When each moment came, ns of world time, in order.
#[derive(Debug, Default)]
pub struct Moments {
    came: [Vec<i64>; 6],
    /// The tip was sent down and not yet up again.
    down: bool,
    /// The tip was sent up and has not yet come to rest.
    rising: bool,
    /// The set point has come to rest in the skin since the tip was sent down.
    held: bool,
}

impl Moments {
    /// When `moment` came for the n-th time, from 0, ns.
    #[must_use]
    pub fn when(&self, moment: Moment, n: u32) -> Option<i64> {
        self.came[moment as usize].get(n as usize).copied()
    }

    fn push(&mut self, moment: Moment, t_ns: i64) {
        self.came[moment as usize].push(t_ns);
    }

    /// The motors were switched on.
    pub fn armed(&mut self, t_ns: i64) {
        self.push(Moment::Arming, t_ns);
    }

    /// The tip is sent from one place to another.
    pub fn sent(&mut self, t_ns: i64, from: Point3<Skin>, to: Point3<Skin>) {
        if from.plane().distance_mm(to.plane()) > SIDEWAYS_MM {
            self.push(Moment::Travel, t_ns);
        } else if to.z_mm < from.z_mm && to.z_mm < NEAR_MM {
            if !self.down {
                self.push(Moment::Approach, t_ns);
                (self.down, self.held) = (true, false);
            }
        } else if to.z_mm > from.z_mm && self.down {
            self.push(Moment::Retract, t_ns);
            (self.down, self.rising) = (false, true);
        }
    }

    /// The set point is at rest, the tip touching the skin or not.
    pub fn at_rest(&mut self, t_ns: i64, touching: bool) {
        if touching && self.down && !self.held {
            self.held = true;
            self.push(Moment::Hold, t_ns);
        } else if !touching && self.rising {
            self.rising = false;
            self.push(Moment::Between, t_ns);
        }
    }
}
