//! Moves that are looked at while they go on: every sample of them, not their end alone.

use skinrig_device::MotionLimits;
use skinrig_model::{HostDuration, HostTime, Point3, PoseSample, Setting, Skin};

use super::Jog;
use crate::error::ControllerError;

impl Jog<'_> {
    /// Hands other limits to the robot, as [`start`](Self::start) did. The guard keeps its own.
    ///
    /// # Errors
    /// What the robot answers.
    pub fn limit(&mut self, robot_limits: &MotionLimits) -> Result<Vec<Setting>, ControllerError> {
        self.indenter.configure(robot_limits)
    }

    /// Starts a move to `target` and returns as soon as the robot has taken it, with the time of that. It goes on while
    /// somebody [watches](Self::watch).
    ///
    /// # Errors
    /// As [`go`](Self::go).
    pub fn send(
        &mut self,
        target: Point3<Skin>,
        speed_mm_s: f64,
    ) -> Result<HostTime, ControllerError> {
        let from = self.look()?;
        self.check_lift(from, target)?;
        self.command(target, speed_mm_s)
    }

    /// Appends every sample of so long a time to `seen`, those before a fault included; of less when `enough` says so of
    /// one. Force and stream are watched as ever.
    ///
    /// # Errors
    /// As [`look`](Self::look).
    pub fn watch(
        &mut self,
        span: HostDuration,
        seen: &mut Vec<PoseSample>,
        mut enough: impl FnMut(&PoseSample) -> bool,
    ) -> Result<(), ControllerError> {
        let until = self.clock.now() + span;
        while self.clock.now() < until {
            let looked = self.tick();
            seen.extend_from_slice(&self.fresh);
            looked?;
            if self.fresh.iter().any(&mut enough) {
                break;
            }
        }
        Ok(())
    }

    /// Brings the tip to rest where it is, with live motors. Gives when that was ordered.
    ///
    /// # Errors
    /// What the robot answers.
    pub fn hold(&mut self) -> Result<HostTime, ControllerError> {
        let t = self.clock.now();
        self.indenter.hold()?;
        Ok(t)
    }

    /// Motors off now, wherever the tip is; nothing moves any more. Gives when that was ordered.
    ///
    /// # Errors
    /// What the robot answers.
    pub fn halt(&mut self) -> Result<HostTime, ControllerError> {
        let t = self.clock.now();
        self.indenter.disarm()?;
        Ok(t)
    }
}
