//! The replayed robot.

use skinrig_device::{DeviceError, Indenter, IndenterCapabilities, MotionLimits, RobotSample};
use skinrig_model::{
    DeviceIdentity, DeviceRole, MotionCommand, Point3, PoseSample, RigidTransform, Robot, Setting,
    Skin,
};

use super::shared_recording::SharedRecording;
use skinrig_device::limits;

/// A robot that checks commands against the recorded ones and returns the recorded poses.
pub(crate) struct ReplayedIndenter {
    recording: SharedRecording,
    robot_from_skin: RigidTransform<Robot, Skin>,
    limits: Option<MotionLimits>,
    armed: bool,
    poses: Vec<PoseSample>,
}

impl ReplayedIndenter {
    /// The robot of `recording`.
    #[must_use]
    pub(crate) const fn new(
        recording: SharedRecording,
        robot_from_skin: RigidTransform<Robot, Skin>,
    ) -> Self {
        Self {
            recording,
            robot_from_skin,
            limits: None,
            armed: false,
            poses: Vec::new(),
        }
    }

    fn serial(&self) -> String {
        self.identity().serial
    }
}

impl Indenter for ReplayedIndenter {
    fn identity(&self) -> DeviceIdentity {
        self.recording.lock().identity(DeviceRole::Indenter)
    }

    /// Wide limits: the recorded commands decide what is allowed.
    fn capabilities(&self) -> IndenterCapabilities {
        IndenterCapabilities {
            workspace_min_mm: [-1_000.0; 3],
            workspace_max_mm: [1_000.0; 3],
            max_speed_mm_s: 1_000.0,
            max_acceleration_mm_s2: 1e9,
            max_force_n: 1_000.0,
            pose_rate_hz: 1_000.0,
            reports_force: true,
        }
    }

    /// Returns the recorded settings, if any.
    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        limits::check_limits(&self.serial(), &self.capabilities(), limits)?;
        self.limits = Some(*limits);
        let recorded = self.recording.lock().settings(DeviceRole::Indenter);
        if recorded.is_empty() {
            return Ok(limits::settings(limits));
        }
        Ok(recorded)
    }

    fn arm(&mut self) -> Result<(), DeviceError> {
        self.recording.lock().check(DeviceRole::Indenter)?;
        if self.limits.is_none() {
            let serial = self.serial();
            return Err(limits::wrong_state(&serial, "configured", "without limits"));
        }
        self.armed = true;
        Ok(())
    }

    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        let Some(limits) = self.limits.filter(|_| self.armed) else {
            return Err(limits::wrong_state(&self.serial(), "armed", "disarmed"));
        };
        limits::check_command(&self.serial(), &limits, target, speed_mm_s)?;
        let command = MotionCommand {
            target: self.recording.skin_from_robot().apply(target),
            speed_mm_s,
        };
        self.recording.lock().take_command(command)
    }

    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        self.poses.clear();
        let answer = self.recording.lock().take_poses(&mut self.poses);
        samples.extend(self.poses.iter().map(|p| RobotSample {
            t: p.t,
            commanded: self.robot_from_skin.apply(p.commanded),
            measured: self.robot_from_skin.apply(p.measured),
            force_n: p.force_n,
        }));
        answer
    }

    fn hold(&mut self) -> Result<(), DeviceError> {
        self.recording.lock().check(DeviceRole::Indenter)
    }

    fn disarm(&mut self) -> Result<(), DeviceError> {
        self.armed = false;
        Ok(())
    }
}
