//! The omega.3 as an `Indenter`.

use std::sync::Arc;

use skinrig_device::{
    DeviceError, Indenter, IndenterCapabilities, MotionLimits, RealClock, RobotSample, limits,
};
use skinrig_model::{DeviceIdentity, DeviceRole, Point3, Robot, Setting};

use crate::config::OmegaConfig;
use crate::error::OmegaError;
use crate::load;
use crate::open::observed_setting;
use crate::owner::Owner;
use crate::remark::Remark;
use crate::sdk::Sdk;
use crate::stream::{CAPACITY, Stream};

/// An open omega.3. Dropping it brakes the arm and closes the device.
pub struct Omega {
    owner: Owner,
    stream: Arc<Stream>,
    identity: DeviceIdentity,
    capabilities: IndenterCapabilities,
    config: Arc<OmegaConfig>,
    remarks: Vec<Remark>,
}

impl Omega {
    /// Loads the library, opens and checks the robot, and leaves it braked. The arm moves only if the robot needs initialisation and the
    /// configuration allows it. Samples have the time of `clock`.
    ///
    /// # Errors
    /// [`OmegaError`], with the next step.
    pub fn open(config: OmegaConfig, clock: RealClock) -> Result<Self, OmegaError> {
        config.check()?;
        let loaded = load::load(config.library.as_deref())?;
        let description = loaded.to_string();
        let advice = loaded.advice.clone();
        let mut omega = Self::with_sdk(
            Arc::new(loaded.library),
            config,
            loaded.requested,
            &description,
            clock,
        )?;
        omega.remarks.extend(advice.map(Remark::Library));
        Ok(omega)
    }

    /// Opens a robot through any `Sdk`. `library` is the path that the supervisor loads, `description` appears in the identity.
    pub(crate) fn with_sdk(
        sdk: Arc<dyn Sdk>,
        config: OmegaConfig,
        library: std::path::PathBuf,
        description: &str,
        clock: RealClock,
    ) -> Result<Self, OmegaError> {
        let config = Arc::new(config);
        let stream = Arc::new(Stream::default());
        let (owner, opened) = Owner::start(
            sdk,
            Arc::clone(&config),
            library,
            clock,
            Arc::clone(&stream),
        )?;
        Ok(Self {
            owner,
            stream,
            identity: DeviceIdentity {
                model: format!("Force Dimension {}", opened.model),
                serial: opened.serial,
                firmware: format!("{}, {description}", opened.firmware),
            },
            capabilities: capabilities(&config),
            config,
            remarks: opened.remarks,
        })
    }

    /// Remarks about this robot and its library.
    #[must_use]
    pub fn remarks(&self) -> &[Remark] {
        &self.remarks
    }
}

/// Capabilities of a robot with this configuration.
pub(crate) fn capabilities(config: &OmegaConfig) -> IndenterCapabilities {
    let e = &config.envelope;
    IndenterCapabilities {
        workspace_min_mm: e.min_mm,
        workspace_max_mm: e.max_mm,
        max_speed_mm_s: e.max_speed_mm_s,
        max_acceleration_mm_s2: config.motion.acceleration_mm_s2,
        max_force_n: e.max_force_n,
        pose_rate_hz: config.motion.cycle_hz / 2.0,
        reports_force: true,
    }
}

/// Checks the limits of a run.
pub(crate) fn check_limits_of_run(
    serial: &str,
    config: &OmegaConfig,
    requested: &MotionLimits,
) -> Result<(), DeviceError> {
    limits::check_limits(serial, &capabilities(config), requested)?;
    let e = &config.envelope;
    if e.ratio_of(requested.max_force_n) < e.least_ratio {
        let least_n = (e.least_ratio - e.gravity_ratio) * e.n_per_ratio;
        let expected = format!(
            "max_force_n of at least {least_n:.2}: with less, the motors may not carry the arm"
        );
        return Err(limits::refused(
            serial,
            expected,
            requested.max_force_n.to_string(),
        ));
    }
    Ok(())
}

impl Indenter for Omega {
    fn identity(&self) -> DeviceIdentity {
        self.identity.clone()
    }

    fn capabilities(&self) -> IndenterCapabilities {
        self.capabilities.clone()
    }

    fn configure(&mut self, requested: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        check_limits_of_run(&self.identity.serial, &self.config, requested)?;
        let mut settings = self.owner.configure(*requested)?;
        // Remarks belong to the session record.
        settings.extend(
            self.remarks
                .iter()
                .map(|remark| observed_setting("remark", remark)),
        );
        Ok(settings)
    }

    fn arm(&mut self) -> Result<(), DeviceError> {
        self.owner.arm()
    }

    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.owner.go(target, speed_mm_s)
    }

    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        let dropped = self.stream.take(samples);
        if let Some(failure) = self.stream.failure() {
            return Err(failure);
        }
        if dropped > 0 {
            return Err(DeviceError::Lost {
                role: DeviceRole::Indenter,
                serial: self.identity.serial.clone(),
                detail: format!(
                    "pose stream: expected a poll before {CAPACITY} samples were queued; {dropped} samples were dropped"
                ),
            });
        }
        Ok(())
    }

    fn hold(&mut self) -> Result<(), DeviceError> {
        self.owner.hold()
    }

    fn disarm(&mut self) -> Result<(), DeviceError> {
        self.owner.disarm()
    }

    fn take_notes(&mut self, notes: &mut Vec<String>) {
        self.stream.take_notes(notes);
    }
}
