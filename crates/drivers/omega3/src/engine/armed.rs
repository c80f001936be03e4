//! State of an armed robot: set point, monitoring and tare.

use skinrig_drd_abi::ForceOffCause;
use skinrig_model::{HostTime, Point3, Robot};

use crate::config::Trips;
use crate::correction::Correction;
use crate::monitor::{Freshness, Monitor, Trip};
use crate::span::span;
use crate::tare::TareAverage;
use crate::trajectory::{Trajectory, norm};

pub(super) struct ArmedState {
    pub(super) trajectory: Trajectory,
    pub(super) monitor: Monitor,
    pub(super) correction: Correction,
    pub(super) freshness: Freshness,
    pub(super) tare: TareState,
    pub(super) last: HostTime,
    pub(super) last_reading: HostTime,
    pub(super) last_activity: HostTime,
    /// Force-off cause that the device reported when arming; it may be old.
    pub(super) old_cause: Option<ForceOffCause>,
    pub(super) tip: Point3<Robot>,
    pub(super) status_due: HostTime,
    pub(super) control_due: HostTime,
    pub(super) busy_readings: u32,
    /// The current motion leads up, so the soft force limit does not stop it.
    pub(super) rising: bool,
    /// Stopped by the soft force limit: only a rise is allowed.
    pub(super) must_rise: bool,
    /// The force exceeds the soft limit.
    pub(super) overloaded: bool,
}

pub(super) enum TareState {
    Averaging(TareAverage),
    Known([f64; 3]),
}

/// Sideways distance that a vertical rise may have, mm; negligible for a tip of millimetres.
const MAX_SIDEWAYS_MM: f64 = 0.05;

/// Whether the path from the set point to `target` leads up at least as far as sideways. It starts at the set point and not at the
/// tip: a loaded tip lags behind, so that a level path would appear to rise or fall.
pub(super) fn rises(set_point: Point3<Robot>, target: Point3<Robot>) -> bool {
    let [dx, dy, up] = std::array::from_fn(|i| target.to_array()[i] - set_point.to_array()[i]);
    let aside = libm::hypot(dx, dy);
    up > 0.0 && (up >= aside || aside <= MAX_SIDEWAYS_MM)
}

impl ArmedState {
    /// Checks that a new reading arrived in time.
    pub(super) fn check_silence(&self, now: HostTime, trips: &Trips) -> Result<(), Trip> {
        let limit = trips.max_silence;
        if now - self.last_reading > span(limit) {
            return Err(Trip::Silent { limit });
        }
        Ok(())
    }

    /// Advances the set point and returns the target for the regulation.
    pub(super) fn advance(&mut self, dt_s: f64) -> Point3<Robot> {
        let tip = self.tip.to_array();
        let [x, y, z] = self.correction.uncorrected_tip(tip);
        self.trajectory.step(dt_s, Point3::new(x, y, z));
        // No correction above the force limit.
        let resting = match self.trajectory.is_still() {
            true if self.overloaded || self.must_rise => None,
            still => Some(still),
        };
        let set_point = self.trajectory.set_point().to_array();
        let [x, y, z] = self.correction.target(set_point, tip, resting, dt_s);
        Point3::new(x, y, z)
    }

    /// Checks the motors' force on the tip (robot frame, N). Returns the force of the environment on the tip along z: opposite, without
    /// the tare; NaN until the tare is known.
    pub(super) fn check_force(
        &mut self,
        now: HostTime,
        pushed: [f64; 3],
        new: bool,
        trips: &Trips,
    ) -> Result<f64, Trip> {
        match &mut self.tare {
            TareState::Averaging(average) => {
                self.monitor.force(pushed)?;
                if new && let Some(mean) = average.add(now, pushed, trips) {
                    if norm(mean) > trips.max_tare_n {
                        return Err(Trip::Tare {
                            limit_n: trips.max_tare_n,
                            found_n: norm(mean),
                        });
                    }
                    self.tare = TareState::Known(mean);
                }
                Ok(f64::NAN)
            }
            TareState::Known(tare) => {
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
