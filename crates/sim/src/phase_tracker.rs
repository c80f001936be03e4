//! Detects the motion phases of the simulated robot: the meaning of [`MotionPhase`].

use skinrig_model::{Point3, Skin};

use crate::faults::MotionPhase;

/// Minimum length of a sideways motion, mm.
const SIDEWAYS_MM: f64 = 0.5;
/// Largest final height of a descent to the skin, mm.
const NEAR_MM: f64 = 1.5;

/// Times of the motion phases in order, ns of world time.
#[derive(Debug, Default)]
pub(crate) struct PhaseTracker {
    times: [Vec<i64>; 6],
    /// Whether the tip went down and is not yet up again.
    down: bool,
    /// Whether the tip goes up and has not stopped yet.
    rising: bool,
    /// Whether the set point has stopped in the skin since the descent.
    held: bool,
}

impl PhaseTracker {
    /// Time of the n-th occurrence of `phase`, from 0, ns.
    #[must_use]
    pub(crate) fn when(&self, phase: MotionPhase, n: u32) -> Option<i64> {
        self.times[phase as usize].get(n as usize).copied()
    }

    fn push(&mut self, phase: MotionPhase, t_ns: i64) {
        self.times[phase as usize].push(t_ns);
    }

    /// The motors were switched on.
    pub(crate) fn armed(&mut self, t_ns: i64) {
        self.push(MotionPhase::Arming, t_ns);
    }

    /// A motion started.
    pub(crate) fn sent(&mut self, t_ns: i64, from: Point3<Skin>, to: Point3<Skin>) {
        if from.plane().distance_mm(to.plane()) > SIDEWAYS_MM {
            self.push(MotionPhase::Travel, t_ns);
        } else if to.z_mm < from.z_mm && to.z_mm < NEAR_MM {
            if !self.down {
                self.push(MotionPhase::Approach, t_ns);
                (self.down, self.held) = (true, false);
            }
        } else if to.z_mm > from.z_mm && self.down {
            self.push(MotionPhase::Retract, t_ns);
            (self.down, self.rising) = (false, true);
        }
    }

    /// The set point stopped, with or without contact.
    pub(crate) fn at_rest(&mut self, t_ns: i64, touching: bool) {
        if touching && self.down && !self.held {
            self.held = true;
            self.push(MotionPhase::Hold, t_ns);
        } else if !touching && self.rising {
            self.rising = false;
            self.push(MotionPhase::Between, t_ns);
        }
    }
}
