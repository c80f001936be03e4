//! From a loaded library to a checked, braked robot. Every step is checked; nothing moves unless the configuration
//! says that the sample is off.

use skinrig_drd_abi::{
    DEVICE_OMEGA3, DEVICE_OMEGA3_UNLISTED, DeviceId, ErrorCode, ForceOffCause, StatusField,
    StatusVector, WATCHDOG_UNIT_US,
};
use skinrig_model::Setting;

use crate::brake::brake;
use crate::config::{Initialise, OmegaConfig, Patience, RedundantEncoders, Watchdog};
use crate::enumerate::{self, Found};
use crate::error::OmegaError;
use crate::remark::Remark;
use crate::sdk::{Answer, CallError, Quantity, Sdk};

/// An open robot. Its motors are off.
#[derive(Debug, Clone, PartialEq)]
pub struct Opened {
    /// Its id in calls.
    pub id: DeviceId,
    /// Its serial number as text; 65535, as the library has it, for one that does not tell it.
    pub serial: String,
    /// Its model.
    pub model: String,
    /// Version of its controller's firmware.
    pub firmware: String,
    /// Mass that gravity compensation carries, kg; `None` when the library does not tell it.
    pub effector_mass_kg: Option<f64>,
    /// What was set or read, for the record of the session.
    pub settings: Vec<Setting>,
    /// What the operator should know.
    pub remarks: Vec<Remark>,
}

/// Opens the robot of `config` and brings it to a known, braked state. `guard` is called with its serial number before
/// anything may move: it sees to it that somebody else brakes the arm if this process dies.
///
/// # Errors
/// [`OmegaError`], also of `guard`; the robot is then braked and closed again.
pub fn open(
    sdk: &dyn Sdk,
    config: &OmegaConfig,
    guard: impl FnOnce(Option<u16>) -> Result<(), OmegaError>,
) -> Result<Opened, OmegaError> {
    let (id, found) = find(sdk, config)?;
    let serial = found
        .serial
        .unwrap_or(enumerate::SERIAL_UNKNOWN)
        .to_string();
    let procedure = Procedure {
        sdk,
        id,
        serial: &serial,
        config,
    };
    let mut opened = Opened {
        id,
        serial: serial.clone(),
        model: found.model.unwrap_or_else(|| "omega.3".to_owned()),
        firmware: String::new(),
        effector_mass_kg: config.mount.effector_mass_kg,
        settings: Vec::new(),
        remarks: Vec::new(),
    };
    let answer = procedure
        .check(&mut opened, found.type_number)
        .and_then(|()| guard(found.serial))
        .and_then(|()| procedure.initialise(&mut opened));
    match answer {
        Ok(()) => Ok(opened),
        Err(e) => {
            // Best effort: the first error is the one to tell.
            let once = Patience {
                brake_attempts: 1,
                ..config.patience
            };
            let _ = brake(sdk, id, &once, |_| ());
            let _ = sdk.close(id);
            Err(e)
        }
    }
}

/// Opens devices one after the other until the one with the wanted serial number is there.
fn find(sdk: &dyn Sdk, config: &OmegaConfig) -> Result<(DeviceId, Found), OmegaError> {
    let expected = config.serial.map_or_else(
        || "one free robot".to_owned(),
        |serial| format!("the robot with serial {serial}"),
    );
    let count = sdk.device_count().map_err(|cause| OmegaError::Call {
        serial: "any".to_owned(),
        step: "count the connected devices",
        cause,
    })?;
    let mut seen: Vec<Found> = Vec::new();
    let mut taken: Option<(DeviceId, Found)> = None;
    for index in 0..count {
        let found = match sdk.open(index) {
            Err(e) => enumerate::unknown(index, e),
            Ok(id) => {
                let found = enumerate::look(sdk, index, id);
                if config.serial.is_some() && found.serial == config.serial {
                    return Ok((id, found));
                }
                if config.serial.is_none() && taken.is_none() {
                    seen.push(found.clone());
                    taken = Some((id, found));
                    continue;
                }
                let _ = sdk.close(id);
                found
            }
        };
        seen.push(found);
    }
    match taken {
        Some((id, found)) if seen.len() == 1 => return Ok((id, found)),
        Some((id, _)) => {
            let _ = sdk.close(id);
        }
        None => {}
    }
    let next =
        match seen.as_slice() {
            [] => "plug the robot in, switch it on, and check your rights (`skinrig doctor`)"
                .to_owned(),
            [only] => only.next_step().unwrap_or_else(|| {
                "correct the serial in the rig file, or connect that robot".to_owned()
            }),
            _ => "name the serial of this bench's robot in the rig file, and free that robot"
                .to_owned(),
        };
    let list: Vec<String> = seen.iter().map(Found::to_string).collect();
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

/// The steps between an open device and a known state.
struct Procedure<'a> {
    sdk: &'a dyn Sdk,
    id: DeviceId,
    serial: &'a str,
    config: &'a OmegaConfig,
}

impl Procedure<'_> {
    /// Everything before the arm may move.
    fn check(&self, opened: &mut Opened, type_number: Option<i32>) -> Result<(), OmegaError> {
        self.identify(opened, type_number)?;
        self.check_status(opened)?;
        self.mount(opened)?;
        self.watchdog(opened)?;
        self.allow_initialisation()
    }

    fn call<T>(&self, step: &'static str, answer: Answer<T>) -> Result<T, OmegaError> {
        answer.map_err(|cause| OmegaError::Call {
            serial: self.serial.to_owned(),
            step,
            cause,
        })
    }

    fn unfit<T>(
        &self,
        expected: impl Into<String>,
        found: impl Into<String>,
        next: impl Into<String>,
    ) -> Result<T, OmegaError> {
        Err(OmegaError::Unfit {
            serial: self.serial.to_owned(),
            expected: expected.into(),
            found: found.into(),
            next: next.into(),
        })
    }

    fn identify(&self, opened: &mut Opened, type_number: Option<i32>) -> Result<(), OmegaError> {
        let number = match type_number {
            Some(number) => number,
            None => self.call("ask for its type", self.sdk.system_type(self.id))?,
        };
        if number != DEVICE_OMEGA3 {
            if !self.config.also_accept_types.contains(&number) {
                let next = if number == DEVICE_OMEGA3_UNLISTED {
                    "this type is refused, although old firmware is said to report it for an omega.3: ask Force \
                     Dimension for a firmware that reports type 33"
                } else {
                    "connect an omega.3: other types are refused"
                };
                return self.unfit(
                    format!("an omega.3 (type {DEVICE_OMEGA3})"),
                    format!("{} (type {number})", opened.model),
                    next,
                );
            }
            opened.remarks.push(Remark::OtherType(number));
        }
        let firmware = self.call("ask for its firmware", self.sdk.firmware(self.id))?;
        opened.firmware = enumerate::firmware_text(firmware);
        match self.sdk.check_memory(self.id) {
            Some(answer) => self.call("check its controller's memory", answer)?,
            None => opened.remarks.push(Remark::MemoryNotChecked),
        }
        let mode = self.call("ask how it is connected", self.sdk.com_mode(self.id))?;
        opened.settings.push(seen("com_mode", mode));
        if !self.sdk.is_supported(self.id) {
            return self.unfit(
                "a model that the library can regulate",
                "one that it cannot",
                "use another SDK version",
            );
        }
        Ok(())
    }

    fn check_status(&self, opened: &mut Opened) -> Result<(), OmegaError> {
        let status = self.call("read its status", self.sdk.status(self.id))?;
        let words = format!("{:?}", status.words());
        opened.settings.push(seen("status", words));
        if status.get(StatusField::Power) == Some(0) {
            return self.unfit("power", "none", "switch the robot on");
        }
        if status.is(StatusField::Error) {
            let next = "power-cycle the robot; if it stays, have it serviced";
            return self.unfit("no fault", "its controller reports one", next);
        }
        self.check_redundancy(opened, &status)?;
        if status.is(StatusField::Force) {
            // Left behind by a program that died.
            let wait = std::thread::sleep;
            if let Err(live) = brake(self.sdk, self.id, &self.config.patience, wait) {
                let next = "press the force button on its base or switch it off at the mains";
                return self.unfit("motors off", live.to_string(), next);
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

    /// 0 does not tell encoders that disagree from a robot without redundant ones: only a robot that is known to have them
    /// is refused for it.
    fn check_redundancy(
        &self,
        opened: &mut Opened,
        status: &StatusVector,
    ) -> Result<(), OmegaError> {
        let word = status.get(StatusField::Redundancy);
        let found = word.map_or_else(|| "not reported".to_owned(), |word| word.to_string());
        opened.settings.push(seen("redundant_encoders", &found));
        match (self.config.redundant_encoders, word) {
            (RedundantEncoders::Required, Some(1)) => Ok(()),
            (RedundantEncoders::Required, _) => self.unfit(
                "redundant encoders that agree (status word 13: 1)",
                format!("status word 13: {found}"),
                "have the robot serviced; a robot that never reported 1 has none: write `redundant_encoders: reported` in the rig file",
            ),
            (RedundantEncoders::Reported, Some(0)) => {
                opened.remarks.push(Remark::NoRedundantEncoders);
                Ok(())
            }
            (RedundantEncoders::Reported, _) => Ok(()),
        }
    }

    fn mount(&self, opened: &mut Opened) -> Result<(), OmegaError> {
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
                    let mass = self.call("read its effector's mass", mass)?;
                    opened.effector_mass_kg = Some(mass);
                    opened
                        .settings
                        .push(seen(Quantity::EffectorMassKg.name(), mass));
                }
            }
        }
        let answer = self.sdk.compensate_gravity(self.id);
        self.call("compensate gravity", answer)?;
        let status = self.call("read its status", self.sdk.status(self.id))?;
        if status.get(StatusField::Gravity) == Some(0) {
            return Err(OmegaError::ReadBack {
                serial: self.serial.to_owned(),
                name: "gravity_compensation".to_owned(),
                expected: "on".to_owned(),
                found: "off".to_owned(),
            });
        }
        opened.settings.push(seen("gravity_compensation", "on"));
        let most = self.config.envelope.max_force_n;
        opened.settings.extend(self.set(Quantity::MaxForceN, most)?);
        Ok(())
    }

    fn set(&self, quantity: Quantity, value: f64) -> Result<Option<Setting>, OmegaError> {
        set_and_read_back(self.sdk, self.id, quantity, value).map_err(|e| e.into_omega(self.serial))
    }

    /// Arms the device's own watchdog. A device without one is accepted when a supervisor stands in.
    fn watchdog(&self, opened: &mut Opened) -> Result<(), OmegaError> {
        let answer = self.sdk.enable_expert_mode();
        self.call("enable expert mode", answer)?;
        let before = self.sdk.watchdog(self.id).ok();
        match arm_watchdog(self.sdk, self.id, self.config) {
            Ok(setting) => {
                let before = before.map(|units| seen("watchdog_found_125us", units));
                opened.settings.extend(before);
                opened.settings.push(setting);
            }
            Err(NotSet::Call(e)) if has_no_watchdog(&e) && self.config.supervisor.is_some() => {
                opened.remarks.push(Remark::NoWatchdog);
            }
            Err(NotSet::Call(e)) if has_no_watchdog(&e) => {
                return self.unfit(
                    "a watchdog in the device",
                    format!("none ({e})"),
                    "configure a supervisor process",
                );
            }
            Err(NotSet::Call(cause)) => return self.call("arm its watchdog", Err(cause)),
            Err(differs) => return Err(differs.into_omega(self.serial)),
        }
        let threshold = self.sdk.velocity_threshold(self.id);
        let threshold = self.call("read its velocity threshold", threshold)?;
        opened.settings.push(seen("velocity_threshold", threshold));
        if threshold == 0 {
            opened.remarks.push(Remark::NoVelocityTrip);
        }
        Ok(())
    }

    /// Refuses a robot that is not initialised and may not initialise itself.
    fn allow_initialisation(&self) -> Result<(), OmegaError> {
        if self.sdk.is_initialized(self.id) || self.config.initialise == Initialise::SampleIsOff {
            return Ok(());
        }
        self.unfit(
            "a robot initialised since power-up",
            "one that is not (its LED blinks)",
            "take the sample and tools off, keep hands clear, and start once with `auto_init: true` and \
             `sample_is_off: true` in the rig file; or put the calibration pole into the pit by hand",
        )
    }

    /// Lets the robot initialise itself, which moves the arm, when it has not yet.
    fn initialise(&self, opened: &mut Opened) -> Result<(), OmegaError> {
        if self.sdk.is_initialized(self.id) {
            return Ok(());
        }
        let answer = self.sdk.auto_init(self.id);
        self.call("initialise itself", answer)?;
        // It leaves the regulation running.
        let wait = std::thread::sleep;
        if let Err(live) = brake(self.sdk, self.id, &self.config.patience, wait) {
            let next = "press the force button on its base or switch it off at the mains";
            return self.unfit("motors off after initialisation", live.to_string(), next);
        }
        if !self.sdk.is_initialized(self.id) {
            let next = "power-cycle the robot and try again";
            return self.unfit("an initialised robot", "one that is still not", next);
        }
        opened.remarks.push(Remark::InitialisedItself);
        Ok(())
    }
}

/// True when the device has no watchdog at all.
pub(crate) const fn has_no_watchdog(error: &CallError) -> bool {
    matches!(
        error.code,
        ErrorCode::NOT_AVAILABLE | ErrorCode::NOT_IMPLEMENTED
    )
}

/// Sets the device's own watchdog and reads it back. Needs expert mode.
pub(crate) fn arm_watchdog(
    sdk: &dyn Sdk,
    id: DeviceId,
    config: &OmegaConfig,
) -> Result<Setting, NotSet> {
    let units = match config.watchdog {
        // Within 1..=255: the configuration was checked.
        Watchdog::ArmMilliseconds(ms) => (ms * 1e3 / f64::from(WATCHDOG_UNIT_US)).round() as u8,
        Watchdog::Off => 0,
    };
    sdk.set_watchdog(id, units).map_err(NotSet::Call)?;
    let found = sdk.watchdog(id).map_err(NotSet::Call)?;
    let (name, expected, found) = ("watchdog_125us", units.to_string(), found.to_string());
    if found != expected {
        return Err(NotSet::Differs {
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

/// A value that was only read.
pub(crate) fn seen(name: &str, value: impl ToString) -> Setting {
    Setting {
        name: name.to_owned(),
        requested: Setting::AS_FOUND.to_owned(),
        read_back: value.to_string(),
    }
}

/// A quantity did not take.
pub(crate) enum NotSet {
    /// A call failed.
    Call(CallError),
    /// Another value came back.
    Differs {
        name: &'static str,
        expected: String,
        found: String,
    },
}

impl NotSet {
    pub(crate) fn into_omega(self, serial: &str) -> OmegaError {
        let serial = serial.to_owned();
        match self {
            Self::Call(cause) => OmegaError::Call {
                serial,
                step: "take a setting",
                cause,
            },
            Self::Differs {
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

/// Largest relative difference between written and read: a device may keep single precision.
const READ_BACK: f64 = 1e-4;

/// True when `found` is `wanted` as far as a device can keep it.
pub(crate) fn agrees(wanted: f64, found: f64) -> bool {
    (wanted - found).abs() <= READ_BACK * wanted.abs().max(1e-3)
}

/// Sets a quantity and compares what comes back. `None`: this version of the library lacks it.
pub(crate) fn set_and_read_back(
    sdk: &dyn Sdk,
    id: DeviceId,
    quantity: Quantity,
    value: f64,
) -> Result<Option<Setting>, NotSet> {
    let Some(answer) = sdk.set(id, quantity, value) else {
        return Ok(None);
    };
    answer.map_err(NotSet::Call)?;
    let Some(answer) = sdk.get(id, quantity) else {
        return Ok(None);
    };
    let found = answer.map_err(NotSet::Call)?;
    if !agrees(value, found) {
        return Err(NotSet::Differs {
            name: quantity.name(),
            expected: value.to_string(),
            found: found.to_string(),
        });
    }
    Ok(Some(Setting {
        name: quantity.name().to_owned(),
        requested: value.to_string(),
        read_back: told(value, found),
    }))
}

/// What is told of a number that was read back: the written text when both are the same number in single precision,
/// which a device may keep; else what was read.
pub(crate) fn told(wanted: f64, found: f64) -> String {
    if wanted as f32 == found as f32 {
        return wanted.to_string();
    }
    found.to_string()
}

/// Why motors went off, for people.
pub(crate) fn cause_words(cause: ForceOffCause) -> String {
    match cause {
        ForceOffCause::None => "no cause told".to_owned(),
        ForceOffCause::Button => "the force button on the base".to_owned(),
        ForceOffCause::Velocity => "the velocity trip: an axis was too fast".to_owned(),
        ForceOffCause::Watchdog => "the watchdog: no command arrived in time".to_owned(),
        ForceOffCause::Software => "a program".to_owned(),
        ForceOffCause::UsbDisconnect => "USB: unplugged".to_owned(),
        ForceOffCause::Deadman => "the dead-man's switch".to_owned(),
        ForceOffCause::Unknown(code) => format!("a cause with the unknown number {code}"),
    }
}
