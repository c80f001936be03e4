//! An armed robot: its set point, what is watched, the force that is taken as zero.

use skinrig_drd_abi::ForceOffCause;
use skinrig_model::{HostTime, Point3, Robot};

use crate::config::Trips;
use crate::correction::Correction;
use crate::monitor::{Freshness, Monitor, Trip};
use crate::span::span;
use crate::trajectory::{Trajectory, norm};
use crate::weighing::Weighing;

pub(super) struct Armed {
    pub(super) trajectory: Trajectory,
    pub(super) monitor: Monitor,
    pub(super) correction: Correction,
    pub(super) freshness: Freshness,
    pub(super) tare: Tare,
    pub(super) last: HostTime,
    pub(super) heard: HostTime,
    pub(super) watched: HostTime,
    /// The cause that the device told when it was armed, of some earlier time.
    pub(super) old_cause: Option<ForceOffCause>,
    pub(super) tip: Point3<Robot>,
    pub(super) status_due: HostTime,
    pub(super) control_due: HostTime,
    pub(super) hiccups: u32,
    /// The present motion leads up; no soft force limit stops it.
    pub(super) rising: bool,
    /// Stopped by the soft force limit: only a rise is allowed.
    pub(super) must_rise: bool,
    /// The force is above the soft limit now.
    pub(super) overloaded: bool,
}

pub(super) enum Tare {
    Taking(Weighing),
    Known([f64; 3]),
}

/// Distance aside that a vertical rise may have, mm: far below what a tip of millimetres feels.
const ASIDE_MM: f64 = 0.05;

/// Whether the way from the set point to `target` leads up: at least as far up as aside. The set point, not the tip, is
/// where the way begins: under load the tip lags behind, and a level way would seem to rise or to fall.
pub(super) fn rises(set_point: Point3<Robot>, target: Point3<Robot>) -> bool {
    let [dx, dy, up] = std::array::from_fn(|i| target.to_array()[i] - set_point.to_array()[i]);
    let aside = f64::hypot(dx, dy);
    up > 0.0 && (up >= aside || aside <= ASIDE_MM)
}

impl Armed {
    /// Checks that a reading was heard within the time.
    pub(super) fn not_silent(&self, now: HostTime, trips: &Trips) -> Result<(), Trip> {
        let limit = trips.max_silence;
        if now - self.heard > span(limit) {
            return Err(Trip::Silent { limit });
        }
        Ok(())
    }

    /// Moves the set point on; gives what the regulation is told.
    pub(super) fn advance(&mut self, dt_s: f64) -> Point3<Robot> {
        let tip = self.tip.to_array();
        let [x, y, z] = self.correction.without(tip);
        self.trajectory.step(dt_s, Point3::new(x, y, z));
        // Above the force limit nothing is added.
        let resting = match self.trajectory.is_still() {
            true if self.overloaded || self.must_rise => None,
            still => Some(still),
        };
        let set_point = self.trajectory.set_point().to_array();
        let [x, y, z] = self.correction.target(set_point, tip, resting, dt_s);
        Point3::new(x, y, z)
    }

    /// Checks the force with which the motors push the tip (robot frame, N). Gives the force with which the world
    /// pushes the tip up: opposite, and without what the arm needs to hang still; NaN while that is not known.
    pub(super) fn weigh(
        &mut self,
        now: HostTime,
        pushed: [f64; 3],
        new: bool,
        trips: &Trips,
    ) -> Result<f64, Trip> {
        match &mut self.tare {
            Tare::Taking(weighing) => {
                self.monitor.force(pushed)?;
                if new && let Some(mean) = weighing.add(now, pushed, trips) {
                    if norm(mean) > trips.max_tare_n {
                        return Err(Trip::Tare {
                            limit_n: trips.max_tare_n,
                            found_n: norm(mean),
                        });
                    }
                    self.tare = Tare::Known(mean);
                }
                Ok(f64::NAN)
            }
            Tare::Known(tare) => {
                let free: [f64; 3] = std::array::from_fn(|i| pushed[i] - tare[i]);
                self.overloaded = self.monitor.force(free)?;
                if self.overloaded && !self.rising {
                    self.must_rise = true;
                    self.trajectory.halt();
                }
                Ok(-free[2])
            }
        }
    }
}
