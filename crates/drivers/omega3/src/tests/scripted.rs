//! A scripted `Sdk`: an arm that is always at its target, and calls that fail on demand.

use std::collections::BTreeMap;
use std::sync::Mutex;

use skinrig_drd_abi::{DeviceId, ErrorCode, SdkVersion, StatusField, StatusVector};

use crate::sdk::{CallError, CallResult, Generator, GeneratorLimits, Quantity, Reading, Sdk};

/// A scripted device with its library.
#[derive(Debug)]
pub(crate) struct Scripted {
    pub script: Mutex<Script>,
}

/// State of the device. Tests may change it at any time.
#[derive(Debug, Clone)]
pub struct Script {
    pub log: Vec<String>,
    /// Failing calls: name to error code and count (`u32::MAX`: always).
    pub fail: BTreeMap<&'static str, (i32, u32)>,
    /// Quantities and parameters that ignore writes, by call.
    pub ignore: Vec<&'static str>,
    pub devices: i8,
    pub type_number: i32,
    pub serial: u16,
    pub supported: bool,
    pub initialised: bool,
    pub filtering: bool,
    pub running: bool,
    pub live: bool,
    pub cause: i32,
    pub position_m: [f64; 3],
    pub target_m: [f64; 3],
    pub follows: bool,
    pub cached: bool,
    pub force_n: [f64; 3],
    pub khz: f64,
    pub watchdog: u8,
    pub values: BTreeMap<&'static str, f64>,
    pub generator_limits: [GeneratorLimits; 2],
    pub status: BTreeMap<usize, i32>,
    /// `drdStop` returns 0 without effect unless a regulation runs.
    pub stop_needs_regulation: bool,
    /// Calls that require a running regulation.
    pub needs_regulation: Vec<&'static str>,
    /// Indices of devices without a readable serial number.
    pub without_serial: Vec<i8>,
    /// A call that never returns.
    pub hanging_call: Option<&'static str>,
}

impl Default for Scripted {
    fn default() -> Self {
        let fast = GeneratorLimits {
            acceleration_m_s2: 1.0,
            speed_m_s: 1.0,
            jerk_m_s3: 1.0,
        };
        let script = Script {
            log: Vec::new(),
            fail: BTreeMap::new(),
            ignore: Vec::new(),
            devices: 1,
            type_number: 33,
            serial: 77,
            supported: true,
            initialised: true,
            filtering: false,
            running: false,
            live: false,
            cause: 0,
            position_m: [0.02, 0.0, 0.01],
            target_m: [0.02, 0.0, 0.01],
            follows: true,
            cached: false,
            force_n: [0.0, 0.0, 0.2],
            khz: 4.0,
            watchdog: 3,
            values: BTreeMap::new(),
            generator_limits: [fast; 2],
            status: BTreeMap::new(),
            stop_needs_regulation: false,
            needs_regulation: Vec::new(),
            without_serial: Vec::new(),
            hanging_call: None,
        };
        Self {
            script: Mutex::new(script),
        }
    }
}

impl Scripted {
    /// Changes the script.
    pub fn with<T>(&self, change: impl FnOnce(&mut Script) -> T) -> T {
        change(&mut self.script.lock().unwrap())
    }

    /// All calls so far, except reads.
    pub fn log(&self) -> Vec<String> {
        self.with(|s| s.log.clone())
    }

    /// Makes a call fail permanently.
    pub fn fail(&self, call: &'static str, code: ErrorCode) {
        self.with(|s| s.fail.insert(call, (code.0, u32::MAX)));
    }

    fn act<T>(&self, call: &'static str, effect: impl FnOnce(&mut Script) -> T) -> CallResult<T> {
        self.with(|s| s.log.push(call.to_owned()));
        self.read(call, effect)
    }

    fn read<T>(&self, call: &'static str, look: impl FnOnce(&mut Script) -> T) -> CallResult<T> {
        while self.with(|s| s.hanging_call == Some(call)) {
            std::thread::park_timeout(std::time::Duration::from_millis(10));
        }
        self.with(|s| {
            if let Some((code, left)) = s.fail.get_mut(call)
                && *left > 0
            {
                *left -= u32::from(*left < u32::MAX);
                return Err(CallError {
                    call,
                    code: ErrorCode(*code),
                    text: String::new(),
                });
            }
            if !s.running && s.needs_regulation.contains(&call) {
                return Err(CallError {
                    call,
                    code: ErrorCode::NO_REGULATION,
                    text: String::new(),
                });
            }
            Ok(look(s))
        })
    }
}

const fn power_off(s: &mut Script) {
    s.running = false;
    s.live = false;
}

impl Sdk for Scripted {
    fn version(&self) -> SdkVersion {
        SdkVersion::ADVISED
    }
    fn device_count(&self) -> CallResult<i8> {
        self.read("dhdGetDeviceCount", |s| s.devices)
    }
    fn open(&self, index: i8) -> CallResult<DeviceId> {
        self.act("drdOpenID", |_| index)
    }
    fn close(&self, _: DeviceId) -> CallResult<()> {
        self.act("drdClose", |_| ())
    }
    fn system_type(&self, _: DeviceId) -> CallResult<i32> {
        self.read("dhdGetSystemType", |s| s.type_number)
    }
    fn system_name(&self, _: DeviceId) -> Option<String> {
        Some("scripted".to_owned())
    }
    fn serial(&self, id: DeviceId) -> CallResult<u16> {
        // Further devices have consecutive serial numbers.
        if self.with(|s| s.without_serial.contains(&id)) {
            self.fail("dhdGetSerialNumber", ErrorCode::NOT_AVAILABLE);
        }
        let answer = self.read("dhdGetSerialNumber", |s| s.serial + id as u16);
        self.with(|s| s.fail.remove("dhdGetSerialNumber"));
        answer
    }
    fn firmware(&self, _: DeviceId) -> CallResult<f64> {
        self.read("dhdGetVersion", |_| 3.0)
    }
    fn com_mode(&self, _: DeviceId) -> CallResult<i32> {
        self.read("dhdGetComMode", |_| 1)
    }
    fn check_memory(&self, _: DeviceId) -> Option<CallResult<()>> {
        Some(self.read("dhdCheckControllerMemory", |_| ()))
    }
    fn status(&self, _: DeviceId) -> CallResult<StatusVector> {
        self.read("dhdGetStatus", |s| {
            let mut words = [0_i32; 17];
            words[StatusField::Power as usize] = 1;
            words[StatusField::Reset as usize] = i32::from(!s.initialised);
            words[StatusField::Force as usize] = i32::from(s.live);
            words[StatusField::Gravity as usize] = 1;
            words[StatusField::Redundancy as usize] = -1;
            words[StatusField::ForceOffCause as usize] = s.cause;
            for (place, word) in &s.status {
                words[*place] = *word;
            }
            StatusVector::from_words(&words)
        })
    }
    fn is_supported(&self, _: DeviceId) -> bool {
        self.with(|s| s.supported)
    }
    fn is_initialized(&self, _: DeviceId) -> bool {
        self.with(|s| s.initialised)
    }
    fn auto_init(&self, _: DeviceId) -> CallResult<()> {
        self.act("drdAutoInit", |s| s.initialised = true)
    }
    fn set(&self, _: DeviceId, quantity: Quantity, value: f64) -> Option<CallResult<()>> {
        let name = quantity.name();
        Some(self.act(name, |s| {
            if !s.ignore.contains(&name) {
                s.values.insert(name, value);
            }
        }))
    }
    fn get(&self, _: DeviceId, quantity: Quantity) -> Option<CallResult<f64>> {
        Some(self.read("get", |s| *s.values.get(quantity.name()).unwrap_or(&0.5)))
    }
    fn compensate_gravity(&self, _: DeviceId) -> CallResult<()> {
        self.act("dhdSetGravityCompensation", |_| ())
    }
    fn enable_expert_mode(&self) -> CallResult<()> {
        self.act("dhdEnableExpertMode", |_| ())
    }
    fn watchdog(&self, _: DeviceId) -> CallResult<u8> {
        self.read("dhdGetWatchdog", |s| s.watchdog)
    }
    fn set_watchdog(&self, _: DeviceId, units: u8) -> CallResult<()> {
        self.act("dhdSetWatchdog", |s| {
            if !s.ignore.contains(&"watchdog") {
                s.watchdog = units;
            }
        })
    }
    fn velocity_threshold(&self, _: DeviceId) -> CallResult<u32> {
        self.read("dhdGetVelocityThreshold", |_| 40)
    }
    fn start(&self, _: DeviceId) -> CallResult<()> {
        self.act("drdStart", |s| {
            s.running = true;
            s.live = true;
            s.target_m = s.position_m;
            // Worst case: starting resets all settings.
            s.values.clear();
            s.watchdog = 3;
        })
    }
    fn stop(&self, _: DeviceId) -> CallResult<()> {
        self.act("drdStop", |s| {
            if s.running || !s.stop_needs_regulation {
                power_off(s);
            }
        })
    }
    fn is_running(&self, _: DeviceId) -> bool {
        self.with(|s| s.running)
    }
    fn control_khz(&self, _: DeviceId) -> CallResult<f64> {
        self.read("drdGetCtrlFreq", |s| s.khz)
    }
    fn regulate_position(&self, _: DeviceId) -> CallResult<()> {
        self.act("drdRegulatePos", |_| ())
    }
    fn enable_filter(&self, _: DeviceId) -> CallResult<()> {
        self.act("drdEnableFilter", |s| {
            s.filtering = !s.ignore.contains(&"filter");
        })
    }
    fn is_filtering(&self, _: DeviceId) -> bool {
        self.with(|s| s.filtering)
    }
    fn set_generator_limits(
        &self,
        _: DeviceId,
        generator: Generator,
        limits: GeneratorLimits,
    ) -> CallResult<()> {
        self.act(generator.name(), |s| {
            if !s.ignore.contains(&generator.name()) {
                s.generator_limits[generator as usize] = limits;
            }
        })
    }
    fn generator_limits(&self, _: DeviceId, generator: Generator) -> CallResult<GeneratorLimits> {
        self.read("pace", |s| s.generator_limits[generator as usize])
    }
    fn track(&self, _: DeviceId, target_m: [f64; 3]) -> CallResult<()> {
        if !self.with(|s| s.running) {
            self.fail("drdTrackPos", ErrorCode::NO_REGULATION);
        }
        self.read("drdTrackPos", |s| {
            if s.log.last().is_none_or(|call| call != "drdTrackPos") {
                s.log.push("drdTrackPos".to_owned());
            }
            s.target_m = target_m;
            if s.follows && s.live {
                s.position_m = target_m;
            }
        })
    }
    fn regulated_position(&self, _: DeviceId) -> CallResult<Reading> {
        self.read("drdGetPositionAndOrientation", |s| Reading {
            position_m: s.position_m,
            cached: s.cached,
        })
    }
    fn position(&self, _: DeviceId) -> CallResult<Reading> {
        self.read("dhdGetPosition", |s| Reading {
            position_m: s.position_m,
            cached: s.cached,
        })
    }
    fn force(&self, _: DeviceId) -> CallResult<[f64; 3]> {
        self.read("dhdGetForce", |s| s.force_n)
    }
    fn emergency_stop(&self, _: DeviceId) -> CallResult<()> {
        self.act("dhdStop", power_off)
    }
    fn force_off(&self, _: DeviceId) -> CallResult<()> {
        self.act("dhdEnableForce", power_off)
    }
}
