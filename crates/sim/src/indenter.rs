//! The simulated robot.

use skinrig_device::{DeviceError, Indenter, IndenterCapabilities, MotionLimits, RobotSample};
use skinrig_model::{DeviceIdentity, DeviceRole, Point3, RigFault, Robot, Setting};

use crate::config::SimConfig;
use crate::faults::{self, FaultTrigger};
use crate::world::{Shared, World};
use skinrig_device::limits;

/// A simulated robot like an omega.3, but with real force sensing.
pub(crate) struct SimIndenter {
    shared: Shared,
    serial: String,
    workspace_mm: ([f64; 3], [f64; 3]),
    max_acceleration_mm_s2: f64,
    limits: Option<MotionLimits>,
    lost: Option<FaultTrigger>,
    stale: Option<FaultTrigger>,
    setting_ignored: Option<FaultTrigger>,
}

impl SimIndenter {
    /// The robot of a rig.
    #[must_use]
    pub(crate) fn new(config: &SimConfig, shared: Shared) -> Self {
        let when = |kind| faults::times(&config.faults, kind).next();
        Self {
            shared,
            serial: format!("sim-{:08x}-r", config.seed as u32),
            workspace_mm: config.workspace_mm,
            max_acceleration_mm_s2: config.motion.acceleration_mm_s2,
            limits: None,
            lost: when(RigFault::RobotLost),
            stale: when(RigFault::RobotStale),
            setting_ignored: when(RigFault::RobotSettingIgnored),
        }
    }

    fn check_lost(&self, world: &World) -> Result<(), DeviceError> {
        match self.lost.filter(|&when| world.has_occurred(when)) {
            None => Ok(()),
            Some(_) => Err(DeviceError::Lost {
                role: DeviceRole::Indenter,
                serial: self.serial.clone(),
                detail: "expected an answer, found none; the brakes are on".to_owned(),
            }),
        }
    }
}

impl Indenter for SimIndenter {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            model: "simulated omega.3".to_owned(),
            serial: self.serial.clone(),
            firmware: concat!("skinrig-sim ", env!("CARGO_PKG_VERSION")).to_owned(),
        }
    }

    fn capabilities(&self) -> IndenterCapabilities {
        IndenterCapabilities {
            workspace_min_mm: self.workspace_mm.0,
            workspace_max_mm: self.workspace_mm.1,
            // omega3.md: 12 N; public servers move at 0.1 to 1 m/s.
            max_speed_mm_s: 200.0,
            max_acceleration_mm_s2: self.max_acceleration_mm_s2,
            max_force_n: 12.0,
            pose_rate_hz: 1000.0,
            reports_force: true,
        }
    }

    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        limits::check_limits(&self.serial, &self.capabilities(), limits)?;
        let mut world = self.shared.world();
        self.check_lost(&world)?;
        if self
            .setting_ignored
            .is_some_and(|when| world.has_occurred(when))
        {
            return Err(DeviceError::ReadBack {
                role: DeviceRole::Indenter,
                serial: self.serial.clone(),
                name: "max_speed_mm_s".to_owned(),
                expected: limits.max_speed_mm_s.to_string(),
                found: (limits.max_speed_mm_s * 2.0).to_string(),
            });
        }
        world.set_force_limit(limits.max_force_n);
        world.motion.set_acceleration(limits.max_acceleration_mm_s2);
        self.limits = Some(*limits);
        Ok(limits::settings(limits))
    }

    fn arm(&mut self) -> Result<(), DeviceError> {
        let mut world = self.shared.world();
        self.check_lost(&world)?;
        if self.limits.is_none() {
            return Err(limits::wrong_state(
                &self.serial,
                "configured",
                "without limits",
            ));
        }
        world.power_on();
        Ok(())
    }

    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        let mut world = self.shared.world();
        self.check_lost(&world)?;
        let Some(limits) = self.limits.filter(|_| world.motion.is_powered()) else {
            return Err(limits::wrong_state(&self.serial, "armed", "disarmed"));
        };
        limits::check_command(&self.serial, &limits, target, speed_mm_s)?;
        let rises = target.z_mm > world.motion.tip().z_mm;
        if !rises && world.must_rise() {
            return Err(limits::refused(
                &self.serial,
                format!(
                    "a target above the tip after more than {} N",
                    limits.max_force_n
                ),
                format!("z = {} mm", target.z_mm),
            ));
        }
        world.move_to(target, speed_mm_s, rises);
        Ok(())
    }

    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        let mut world = self.shared.world();
        let from = samples.len();
        world.take_samples(samples);
        for at in [self.lost, self.stale]
            .into_iter()
            .flatten()
            .filter_map(|when| world.occurred_at(when))
        {
            let new = samples.split_off(from);
            samples.extend(new.into_iter().filter(|s| s.t.0 < at));
        }
        self.check_lost(&world)
    }

    fn hold(&mut self) -> Result<(), DeviceError> {
        let mut world = self.shared.world();
        self.check_lost(&world)?;
        world.hold();
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), DeviceError> {
        let mut world = self.shared.world();
        world.motion.power_off();
        self.check_lost(&world)
    }
}
