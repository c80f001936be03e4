//! Opens a robot: from a loaded library to a checked, braked robot. The arm moves only if the configuration states that the sample is
//! off.

use skinrig_drd_abi::{
    DEVICE_OMEGA3, DEVICE_OMEGA3_UNLISTED, DeviceId, ErrorCode, ForceOffCause, StatusField,
    StatusVector, WATCHDOG_UNIT_US,
};
use skinrig_model::Setting;

use crate::brake::brake;
use crate::config::{InitialiseRule, OmegaConfig, RedundantEncoders, Timeouts, Watchdog};
use crate::enumerate::{self, FoundDevice};
use crate::error::OmegaError;
use crate::remark::Remark;
use crate::sdk::{CallError, CallResult, Quantity, Sdk};

/// An open robot with its motors off.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenRobot {
    /// Device ID in library calls.
    pub id: DeviceId,
    /// Serial number; 65535, as in the library, if the robot does not report one.
    pub serial: String,
    /// Model name.
    pub model: String,
    /// Firmware version of the controller.
    pub firmware: String,
    /// Mass for gravity compensation, kg; `None` if the library does not report it.
    pub effector_mass_kg: Option<f64>,
    /// Settings that were written or read, for the session record.
    pub settings: Vec<Setting>,
    /// Remarks for the operator.
    pub remarks: Vec<Remark>,
}

/// Opens the robot of `config` and leaves it braked in a known state. Calls `guard` with the serial number before anything may move:
/// it must make sure that another process brakes the arm if this one dies.
///
/// # Errors
/// [`OmegaError`], also from `guard`; the robot is then braked and closed.
pub fn open(
    sdk: &dyn Sdk,
    config: &OmegaConfig,
    guard: impl FnOnce(Option<u16>) -> Result<(), OmegaError>,
) -> Result<OpenRobot, OmegaError> {
    let (id, found) = find(sdk, config)?;
    let serial = found
        .serial
        .unwrap_or(enumerate::SERIAL_UNKNOWN)
        .to_string();
    let procedure = OpenProcedure {
        sdk,
        id,
        serial: &serial,
        config,
    };
    let mut opened = OpenRobot {
        id,
        serial: serial.clone(),
        model: found.model.unwrap_or_else(|| "omega.3".to_owned()),
        firmware: String::new(),
        effector_mass_kg: config.mount.effector_mass_kg,
        settings: Vec::new(),
        remarks: Vec::new(),
    };
    let result = procedure
        .check(&mut opened, found.type_number)
        .and_then(|()| guard(found.serial))
        .and_then(|()| procedure.initialise(&mut opened));
    match result {
        Ok(()) => Ok(opened),
        Err(e) => {
            // Best effort: report the first error.
            let once = Timeouts {
                brake_attempts: 1,
                ..config.timeouts
            };
            let _ = brake(sdk, id, &once, |_| ());
            let _ = sdk.close(id);
            Err(e)
        }
    }
}

/// Opens devices one by one until the one with the configured serial number is found.
fn find(sdk: &dyn Sdk, config: &OmegaConfig) -> Result<(DeviceId, FoundDevice), OmegaError> {
    let expected = config.serial.map_or_else(
        || "one free robot".to_owned(),
        |serial| format!("the robot with serial {serial}"),
    );
    let count = sdk.device_count().map_err(|cause| OmegaError::Call {
        serial: "any".to_owned(),
        step: "count the connected devices",
        cause,
    })?;
    let mut devices: Vec<FoundDevice> = Vec::new();
    let mut candidate: Option<(DeviceId, FoundDevice)> = None;
    for index in 0..count {
        let found = match sdk.open(index) {
            Err(e) => enumerate::unopened(index, e),
            Ok(id) => {
                let found = enumerate::identify(sdk, index, id);
                if config.serial.is_some() && found.serial == config.serial {
                    return Ok((id, found));
                }
                if config.serial.is_none() && candidate.is_none() {
                    devices.push(found.clone());
                    candidate = Some((id, found));
                    continue;
                }
                let _ = sdk.close(id);
                found
            }
        };
        devices.push(found);
    }
    match candidate {
        Some((id, found)) if devices.len() == 1 => return Ok((id, found)),
        Some((id, _)) => {
            let _ = sdk.close(id);
        }
        None => {}
    }
    let next = match devices.as_slice() {
        [] => "connect the robot, switch it on, and check your permissions (`skinrig doctor`)"
            .to_owned(),
        [only] => only.next_step().unwrap_or_else(|| {
            "correct the serial number in the rig file, or connect that robot".to_owned()
        }),
        _ => "add the serial number of this bench's robot to the rig file, and free that robot"
            .to_owned(),
    };
    let list: Vec<String> = devices.iter().map(FoundDevice::to_string).collect();
    Err(OmegaError::NotFound {
        expected,
        found: if list.is_empty() {
            "no device".to_owned()
        } else {
            list.join("; ")
        },
        next,
    })
}

/// Steps from an open device to a known state.
struct OpenProcedure<'a> {
    sdk: &'a dyn Sdk,
    id: DeviceId,
    serial: &'a str,
    config: &'a OmegaConfig,
}

impl OpenProcedure<'_> {
    /// All steps before the arm may move.
    fn check(&self, opened: &mut OpenRobot, type_number: Option<i32>) -> Result<(), OmegaError> {
        self.identify(opened, type_number)?;
        self.check_status(opened)?;
        self.mount(opened)?;
        self.watchdog(opened)?;
        self.allow_initialisation()
    }

    fn call<T>(&self, step: &'static str, result: CallResult<T>) -> Result<T, OmegaError> {
        result.map_err(|cause| OmegaError::Call {
            serial: self.serial.to_owned(),
            step,
            cause,
        })
    }

    fn unsuitable<T>(
        &self,
        expected: impl Into<String>,
        found: impl Into<String>,
        next: impl Into<String>,
    ) -> Result<T, OmegaError> {
        Err(OmegaError::Unsuitable {
            serial: self.serial.to_owned(),
            expected: expected.into(),
            found: found.into(),
            next: next.into(),
        })
    }

    fn identify(&self, opened: &mut OpenRobot, type_number: Option<i32>) -> Result<(), OmegaError> {
        let number = match type_number {
            Some(number) => number,
            None => self.call("read its type", self.sdk.system_type(self.id))?,
        };
        if number != DEVICE_OMEGA3 {
            if !self.config.also_accept_types.contains(&number) {
                let next = if number == DEVICE_OMEGA3_UNLISTED {
                    "this type is refused although old firmware may report it for an omega.3: ask Force Dimension for firmware that \
                    reports type 33"
                } else {
                    "connect an omega.3: other types are not supported"
                };
                return self.unsuitable(
                    format!("an omega.3 (type {DEVICE_OMEGA3})"),
                    format!("{} (type {number})", opened.model),
                    next,
                );
            }
            opened.remarks.push(Remark::OtherType(number));
        }
        let firmware = self.call("read its firmware version", self.sdk.firmware(self.id))?;
        opened.firmware = enumerate::firmware_text(firmware);
        match self.sdk.check_memory(self.id) {
            Some(result) => self.call("check its controller's memory", result)?,
            None => opened.remarks.push(Remark::MemoryNotChecked),
        }
        let mode = self.call("read its communication mode", self.sdk.com_mode(self.id))?;
        opened.settings.push(observed_setting("com_mode", mode));
        if !self.sdk.is_supported(self.id) {
            return self.unsuitable(
                "a model that the library can control",
                "a model that it cannot control",
                "use another version of the SDK",
            );
        }
        Ok(())
    }

    fn check_status(&self, opened: &mut OpenRobot) -> Result<(), OmegaError> {
        let status = self.call("read its status", self.sdk.status(self.id))?;
        let words = format!("{:?}", status.words());
        opened.settings.push(observed_setting("status", words));
        if status.get(StatusField::Power) == Some(0) {
            return self.unsuitable("power", "none", "switch the robot on");
        }
        if status.is(StatusField::Error) {
            let next =
                "power-cycle the robot; if the fault persists, contact Force Dimension support";
            return self.unsuitable("no fault", "a fault reported by its controller", next);
        }
        self.check_redundancy(opened, &status)?;
        if status.is(StatusField::Force) {
            // Left live by a program that died.
            let wait = std::thread::sleep;
            if let Err(live) = brake(self.sdk, self.id, &self.config.timeouts, wait) {
                let next = "press the force button on its base or switch it off at the mains";
                return self.unsuitable("motors off", live.to_string(), next);
            }
            opened.remarks.push(Remark::MotorsWereLive);
        }
        if let Some(cause) = status
            .force_off_cause()
            .filter(|cause| *cause != ForceOffCause::None)
        {
            opened.remarks.push(Remark::MotorsWentOff(cause));
        }
        Ok(())
    }

    /// A 0 means either encoders that disagree or no redundant encoders: it is an error only if the robot is known to have them.
    fn check_redundancy(
        &self,
        opened: &mut OpenRobot,
        status: &StatusVector,
    ) -> Result<(), OmegaError> {
        let word = status.get(StatusField::Redundancy);
        let found = word.map_or_else(|| "not reported".to_owned(), |word| word.to_string());
        opened
            .settings
            .push(observed_setting("redundant_encoders", &found));
        match (self.config.redundant_encoders, word) {
            (RedundantEncoders::Required, Some(1)) => Ok(()),
            (RedundantEncoders::Required, _) => self.unsuitable(
                "agreeing redundant encoders (status word 13: 1)",
                format!("status word 13: {found}"),
                "contact Force Dimension support; a robot that never reported 1 has no redundant encoders: set `redundant_encoders: reported` in the rig file",
            ),
            (RedundantEncoders::Reported, Some(0)) => {
                opened.remarks.push(Remark::NoRedundantEncoders);
                Ok(())
            }
            (RedundantEncoders::Reported, _) => Ok(()),
        }
    }

    fn mount(&self, opened: &mut OpenRobot) -> Result<(), OmegaError> {
        let mount = &self.config.mount;
        let angle = mount.device_angle_deg;
        opened
            .settings
            .extend(self.set(Quantity::DeviceAngleDeg, angle)?);
        match mount.effector_mass_kg {
            Some(mass) => opened
                .settings
                .extend(self.set(Quantity::EffectorMassKg, mass)?),
            None => {
                if let Some(mass) = self.sdk.get(self.id, Quantity::EffectorMassKg) {
                    let mass = self.call("read its effector mass", mass)?;
                    opened.effector_mass_kg = Some(mass);
                    opened
                        .settings
                        .push(observed_setting(Quantity::EffectorMassKg.name(), mass));
                }
            }
        }
        let result = self.sdk.compensate_gravity(self.id);
        self.call("switch gravity compensation on", result)?;
        let status = self.call("read its status", self.sdk.status(self.id))?;
        if status.get(StatusField::Gravity) == Some(0) {
            return Err(OmegaError::ReadBack {
                serial: self.serial.to_owned(),
                name: "gravity_compensation".to_owned(),
                expected: "on".to_owned(),
                found: "off".to_owned(),
            });
        }
        opened
            .settings
            .push(observed_setting("gravity_compensation", "on"));
        let most = self.config.envelope.max_force_n;
        opened.settings.extend(self.set(Quantity::MaxForceN, most)?);
        Ok(())
    }

    fn set(&self, quantity: Quantity, value: f64) -> Result<Option<Setting>, OmegaError> {
        set_and_read_back(self.sdk, self.id, quantity, value).map_err(|e| e.into_omega(self.serial))
    }

    /// Arms the device's watchdog. A device without one is accepted if a supervisor is configured.
    fn watchdog(&self, opened: &mut OpenRobot) -> Result<(), OmegaError> {
        let result = self.sdk.enable_expert_mode();
        self.call("enable expert mode", result)?;
        let before = self.sdk.watchdog(self.id).ok();
        match arm_watchdog(self.sdk, self.id, self.config) {
            Ok(setting) => {
                let before = before.map(|units| observed_setting("watchdog_found_125us", units));
                opened.settings.extend(before);
                opened.settings.push(setting);
            }
            Err(SettingError::Call(e))
                if has_no_watchdog(&e) && self.config.supervisor.is_some() =>
            {
                opened.remarks.push(Remark::NoWatchdog);
            }
            Err(SettingError::Call(e)) if has_no_watchdog(&e) => {
                return self.unsuitable(
                    "a watchdog in the device",
                    format!("none ({e})"),
                    "configure a supervisor process",
                );
            }
            Err(SettingError::Call(cause)) => return self.call("arm its watchdog", Err(cause)),
            Err(mismatch) => return Err(mismatch.into_omega(self.serial)),
        }
        let threshold = self.sdk.velocity_threshold(self.id);
        let threshold = self.call("read its velocity threshold", threshold)?;
        opened
            .settings
            .push(observed_setting("velocity_threshold", threshold));
        if threshold == 0 {
            opened.remarks.push(Remark::NoVelocityTrip);
        }
        Ok(())
    }

    /// Rejects a robot that is not initialised, unless it may initialise itself.
    fn allow_initialisation(&self) -> Result<(), OmegaError> {
        if self.sdk.is_initialized(self.id) || self.config.initialise == InitialiseRule::SampleIsOff
        {
            return Ok(());
        }
        self.unsuitable(
            "a robot initialised since power-up",
            "a robot that is not (its LED blinks)",
            "remove the sample and tools, keep hands clear, and start once with `auto_init: true` and `sample_is_off: true` in the rig file; \
            or put the calibration pole into the pit by hand",
        )
    }

    /// Lets the robot initialise itself if needed. This moves the arm.
    fn initialise(&self, opened: &mut OpenRobot) -> Result<(), OmegaError> {
        if self.sdk.is_initialized(self.id) {
            return Ok(());
        }
        let result = self.sdk.auto_init(self.id);
        self.call("initialise itself", result)?;
        // Initialisation leaves the regulation running.
        let wait = std::thread::sleep;
        if let Err(live) = brake(self.sdk, self.id, &self.config.timeouts, wait) {
            let next = "press the force button on its base or switch it off at the mains";
            return self.unsuitable("motors off after initialisation", live.to_string(), next);
        }
        if !self.sdk.is_initialized(self.id) {
            let next = "power-cycle the robot and try again";
            return self.unsuitable(
                "an initialised robot",
                "a robot that is still not initialised",
                next,
            );
        }
        opened.remarks.push(Remark::InitialisedItself);
        Ok(())
    }
}

/// Whether the error means that the device has no watchdog.
pub(crate) const fn has_no_watchdog(error: &CallError) -> bool {
    matches!(
        error.code,
        ErrorCode::NOT_AVAILABLE | ErrorCode::NOT_IMPLEMENTED
    )
}

/// Sets the device's watchdog and reads it back. Needs expert mode.
pub(crate) fn arm_watchdog(
    sdk: &dyn Sdk,
    id: DeviceId,
    config: &OmegaConfig,
) -> Result<Setting, SettingError> {
    let units = match config.watchdog {
        // 1 to 255, because the configuration was checked.
        Watchdog::ArmMilliseconds(ms) => (ms * 1e3 / f64::from(WATCHDOG_UNIT_US)).round() as u8,
        Watchdog::Off => 0,
    };
    sdk.set_watchdog(id, units).map_err(SettingError::Call)?;
    let found = sdk.watchdog(id).map_err(SettingError::Call)?;
    let (name, expected, found) = ("watchdog_125us", units.to_string(), found.to_string());
    if found != expected {
        return Err(SettingError::Mismatch {
            name,
            expected,
            found,
        });
    }
    Ok(Setting {
        name: name.to_owned(),
        requested: expected,
        read_back: found,
    })
}

/// A setting that was only read.
pub(crate) fn observed_setting(name: &str, value: impl ToString) -> Setting {
    Setting {
        name: name.to_owned(),
        requested: Setting::AS_FOUND.to_owned(),
        read_back: value.to_string(),
    }
}

/// A setting could not be written.
pub(crate) enum SettingError {
    /// A call failed.
    Call(CallError),
    /// It read back with another value.
    Mismatch {
        name: &'static str,
        expected: String,
        found: String,
    },
}

impl SettingError {
    pub(crate) fn into_omega(self, serial: &str) -> OmegaError {
        let serial = serial.to_owned();
        match self {
            Self::Call(cause) => OmegaError::Call {
                serial,
                step: "take a setting",
                cause,
            },
            Self::Mismatch {
                name,
                expected,
                found,
            } => OmegaError::ReadBack {
                serial,
                name: name.to_owned(),
                expected,
                found,
            },
        }
    }
}

/// Largest relative difference between written and read value: a device may use single precision.
const READ_BACK_TOLERANCE: f64 = 1e-4;

/// Whether `found` equals `requested` within the precision of a device.
pub(crate) fn agrees(requested: f64, found: f64) -> bool {
    (requested - found).abs() <= READ_BACK_TOLERANCE * requested.abs().max(1e-3)
}

/// Writes a quantity and compares the value read back. `None`: not supported by this version of the library.
pub(crate) fn set_and_read_back(
    sdk: &dyn Sdk,
    id: DeviceId,
    quantity: Quantity,
    value: f64,
) -> Result<Option<Setting>, SettingError> {
    let Some(result) = sdk.set(id, quantity, value) else {
        return Ok(None);
    };
    result.map_err(SettingError::Call)?;
    let Some(result) = sdk.get(id, quantity) else {
        return Ok(None);
    };
    let found = result.map_err(SettingError::Call)?;
    if !agrees(value, found) {
        return Err(SettingError::Mismatch {
            name: quantity.name(),
            expected: value.to_string(),
            found: found.to_string(),
        });
    }
    Ok(Some(Setting {
        name: quantity.name().to_owned(),
        requested: value.to_string(),
        read_back: format_read_back(value, found),
    }))
}

/// Formats a number that was read back: as `requested` if both are equal in single precision, otherwise as `found`.
pub(crate) fn format_read_back(requested: f64, found: f64) -> String {
    if requested as f32 == found as f32 {
        return requested.to_string();
    }
    found.to_string()
}
