//! Moves whose samples are all observed, not only their end.

use skinrig_device::MotionLimits;
use skinrig_model::{HostDuration, HostTime, Point3, PoseSample, RunFault, Setting, Skin};

use super::Jog;

impl Jog<'_> {
    /// Configures new limits of the robot, as [`start`](Self::start) did. The guard keeps its own.
    ///
    /// # Errors
    /// The error of the robot.
    pub fn limit(&mut self, robot_limits: &MotionLimits) -> Result<Vec<Setting>, RunFault> {
        self.indenter.configure(robot_limits)
    }

    /// Starts a move to `target` and returns the time at which the robot accepted it. The move continues while
    /// [`watch`](Self::watch) is called.
    ///
    /// # Errors
    /// As [`go`](Self::go).
    pub fn send(&mut self, target: Point3<Skin>, speed_mm_s: f64) -> Result<HostTime, RunFault> {
        let from = self.look()?;
        self.check_lift(from, target)?;
        self.command(target, speed_mm_s)
    }

    /// Appends every sample of this duration to `samples`, including those before a fault; stops early when `enough` returns true for
    /// a sample. Monitors force and pose stream.
    ///
    /// # Errors
    /// As [`look`](Self::look).
    pub fn watch(
        &mut self,
        span: HostDuration,
        samples: &mut Vec<PoseSample>,
        mut enough: impl FnMut(&PoseSample) -> bool,
    ) -> Result<(), RunFault> {
        let until = self.clock.now() + span;
        while self.clock.now() < until {
            let looked = self.tick();
            samples.extend_from_slice(&self.fresh);
            looked?;
            if self.fresh.iter().any(&mut enough) {
                break;
            }
        }
        Ok(())
    }

    /// Stops the tip with the motors on. Returns the time of the command.
    ///
    /// # Errors
    /// The error of the robot.
    pub fn hold(&mut self) -> Result<HostTime, RunFault> {
        let t = self.clock.now();
        self.indenter.hold()?;
        Ok(t)
    }

    /// Switches the motors off, wherever the tip is. Returns the time of the command.
    ///
    /// # Errors
    /// The error of the robot.
    pub fn halt(&mut self) -> Result<HostTime, RunFault> {
        let t = self.clock.now();
        self.indenter.disarm()?;
        Ok(t)
    }
}
