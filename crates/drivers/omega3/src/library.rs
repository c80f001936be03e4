//! libdrd behind the `Sdk` trait. All calls into foreign code are in this file.
#![expect(unsafe_code, reason = "calls functions of a foreign library")]

use std::ffi::{CStr, c_char};

use skinrig_drd_abi::{
    DeviceId, ErrorCode, Functions, SdkVersion, StatusVector, is_true, succeeded,
};

use crate::sdk::{CallError, CallResult, Generator, GeneratorLimits, Quantity, Reading, Sdk};

/// A loaded library. It stays loaded until the process ends, because its threads may run code in it.
#[derive(Debug, Clone, Copy)]
pub struct Library {
    functions: Functions,
    version: SdkVersion,
}

impl Library {
    /// Wraps resolved functions.
    pub(crate) const fn new(functions: Functions, version: SdkVersion) -> Self {
        Self { functions, version }
    }

    /// A failed `call` with the calling thread's error code.
    fn failure(&self, call: &'static str) -> CallError {
        // SAFETY: no arguments; the code belongs to this thread.
        let code = unsafe { (self.functions.dhdErrorGetLast)() };
        // SAFETY: any code is valid.
        let text = unsafe { (self.functions.dhdErrorGetStr)(code) };
        CallError {
            call,
            code: ErrorCode(code),
            text: text_at(text).unwrap_or_default(),
        }
    }

    fn check(&self, call: &'static str, result: i32) -> CallResult<i32> {
        if succeeded(result) {
            Ok(result)
        } else {
            Err(self.failure(call))
        }
    }

    fn level(&self, call: &'static str, value: f64) -> CallResult<f64> {
        if value >= 0.0 {
            Ok(value)
        } else {
            Err(self.failure(call))
        }
    }
}

/// Copies a static string of the library.
fn text_at(text: *const c_char) -> Option<String> {
    if text.is_null() {
        return None;
    }
    // SAFETY: not NULL, and the library's strings are static and NUL-terminated.
    let text = unsafe { CStr::from_ptr(text) };
    Some(text.to_string_lossy().into_owned())
}

/// Calls a function of the table with plain arguments.
macro_rules! call {
    ($self:ident.$name:ident($($argument:expr),*)) => {{
        // SAFETY: resolved under this name and signature by the loader, and never unloaded; the arguments are plain values or pointers
        // to locals of the right type that outlive the call.
        let result = unsafe { ($self.functions.$name)($($argument),*) };
        $self.check(stringify!($name), result)
    }};
}

/// Like `call!`, for functions that return a quantity, negative on failure.
macro_rules! level {
    ($self:ident.$name:ident($($argument:expr),*)) => {{
        // SAFETY: as in `call!`.
        let result = unsafe { ($self.functions.$name)($($argument),*) };
        $self.level(stringify!($name), result)
    }};
}

/// Like `call!`, for functions that return a boolean.
macro_rules! ask {
    ($self:ident.$name:ident($($argument:expr),*)) => {{
        // SAFETY: as in `call!`.
        is_true(unsafe { ($self.functions.$name)($($argument),*) })
    }};
}

impl Sdk for Library {
    fn version(&self) -> SdkVersion {
        self.version
    }

    fn device_count(&self) -> CallResult<i8> {
        let count = call!(self.dhdGetDeviceCount())?;
        Ok(i8::try_from(count).unwrap_or(i8::MAX))
    }

    fn open(&self, index: i8) -> CallResult<DeviceId> {
        let id = call!(self.drdOpenID(index))?;
        i8::try_from(id).map_err(|_| CallError {
            call: "drdOpenID",
            code: ErrorCode::INVALID_INDEX,
            text: format!("returned device {id}"),
        })
    }

    fn close(&self, id: DeviceId) -> CallResult<()> {
        call!(self.drdClose(id)).map(drop)
    }

    fn system_type(&self, id: DeviceId) -> CallResult<i32> {
        call!(self.dhdGetSystemType(id))
    }

    fn system_name(&self, id: DeviceId) -> Option<String> {
        // SAFETY: as in `call!`; the string is copied before any other call.
        text_at(unsafe { (self.functions.dhdGetSystemName)(id) })
    }

    fn serial(&self, id: DeviceId) -> CallResult<u16> {
        let mut serial = 0;
        call!(self.dhdGetSerialNumber(&raw mut serial, id))?;
        Ok(serial)
    }

    fn firmware(&self, id: DeviceId) -> CallResult<f64> {
        let mut version = 0.0;
        call!(self.dhdGetVersion(&raw mut version, id))?;
        Ok(version)
    }

    fn com_mode(&self, id: DeviceId) -> CallResult<i32> {
        call!(self.dhdGetComMode(id))
    }

    fn check_memory(&self, id: DeviceId) -> Option<CallResult<()>> {
        const NAME: &str = "dhdCheckControllerMemory";
        let check = self.functions.dhdCheckControllerMemory?;
        // SAFETY: as in `call!`.
        let result = unsafe { check(id) };
        Some(match result {
            0 => Ok(()),
            // The only function with a positive failure: the error code itself.
            code if code > 0 => Err(CallError {
                call: NAME,
                code: ErrorCode(code),
                text: String::new(),
            }),
            _ => Err(self.failure(NAME)),
        })
    }

    fn status(&self, id: DeviceId) -> CallResult<StatusVector> {
        let mut status = StatusVector::new();
        call!(self.dhdGetStatus(status.as_mut_ptr(), id))?;
        Ok(status)
    }

    fn is_supported(&self, id: DeviceId) -> bool {
        ask!(self.drdIsSupported(id))
    }

    fn is_initialized(&self, id: DeviceId) -> bool {
        ask!(self.drdIsInitialized(id))
    }

    fn auto_init(&self, id: DeviceId) -> CallResult<()> {
        call!(self.drdAutoInit(id)).map(drop)
    }

    fn set(&self, id: DeviceId, quantity: Quantity, value: f64) -> Option<CallResult<()>> {
        let result = match quantity {
            Quantity::DeviceAngleDeg => call!(self.dhdSetDeviceAngleDeg(value, id)),
            Quantity::EffectorMassKg => call!(self.dhdSetEffectorMass(value, id)),
            Quantity::MaxForceN => {
                // SAFETY: as in `call!`.
                let result = unsafe { self.functions.dhdSetMaxForce?(value, id) };
                self.check("dhdSetMaxForce", result)
            }
            Quantity::GainP => call!(self.drdSetEncPGain(value, id)),
            Quantity::GainI => call!(self.drdSetEncIGain(value, id)),
            Quantity::GainD => call!(self.drdSetEncDGain(value, id)),
            Quantity::MotorRatio => call!(self.drdSetMotRatioMax(value, id)),
        };
        Some(result.map(drop))
    }

    fn get(&self, id: DeviceId, quantity: Quantity) -> Option<CallResult<f64>> {
        let mut value = 0.0;
        let into = &raw mut value;
        Some(match quantity {
            Quantity::DeviceAngleDeg => call!(self.dhdGetDeviceAngleDeg(into, id)).map(|_| value),
            Quantity::EffectorMassKg => call!(self.dhdGetEffectorMass(into, id)).map(|_| value),
            Quantity::MaxForceN => {
                // SAFETY: as in `call!`.
                let result = unsafe { self.functions.dhdGetMaxForce?(id) };
                self.level("dhdGetMaxForce", result)
            }
            Quantity::GainP => level!(self.drdGetEncPGain(id)),
            Quantity::GainI => level!(self.drdGetEncIGain(id)),
            Quantity::GainD => level!(self.drdGetEncDGain(id)),
            Quantity::MotorRatio => level!(self.drdGetMotRatioMax(id)),
        })
    }

    fn compensate_gravity(&self, id: DeviceId) -> CallResult<()> {
        call!(self.dhdSetGravityCompensation(1, id)).map(drop)
    }

    fn enable_expert_mode(&self) -> CallResult<()> {
        call!(self.dhdEnableExpertMode()).map(drop)
    }

    fn watchdog(&self, id: DeviceId) -> CallResult<u8> {
        let mut units = 0;
        call!(self.dhdGetWatchdog(&raw mut units, id))?;
        Ok(units)
    }

    fn set_watchdog(&self, id: DeviceId, units: u8) -> CallResult<()> {
        call!(self.dhdSetWatchdog(units, id)).map(drop)
    }

    fn velocity_threshold(&self, id: DeviceId) -> CallResult<u32> {
        let mut threshold = 0;
        call!(self.dhdGetVelocityThreshold(&raw mut threshold, id))?;
        Ok(threshold)
    }

    fn start(&self, id: DeviceId) -> CallResult<()> {
        call!(self.drdStart(id)).map(drop)
    }

    fn stop(&self, id: DeviceId) -> CallResult<()> {
        call!(self.drdStop(false, id)).map(drop)
    }

    fn is_running(&self, id: DeviceId) -> bool {
        ask!(self.drdIsRunning(id))
    }

    fn control_khz(&self, id: DeviceId) -> CallResult<f64> {
        level!(self.drdGetCtrlFreq(id))
    }

    fn regulate_position(&self, id: DeviceId) -> CallResult<()> {
        call!(self.drdRegulatePos(true, id)).map(drop)
    }

    fn enable_filter(&self, id: DeviceId) -> CallResult<()> {
        call!(self.drdEnableFilter(true, id)).map(drop)
    }

    fn is_filtering(&self, id: DeviceId) -> bool {
        ask!(self.drdIsFiltering(id))
    }

    fn set_generator_limits(
        &self,
        id: DeviceId,
        generator: Generator,
        limits: GeneratorLimits,
    ) -> CallResult<()> {
        let (a, v, j) = (limits.acceleration_m_s2, limits.speed_m_s, limits.jerk_m_s3);
        match generator {
            Generator::Move => call!(self.drdSetPosMoveParam(a, v, j, id)),
            Generator::Track => call!(self.drdSetPosTrackParam(a, v, j, id)),
        }
        .map(drop)
    }

    fn generator_limits(&self, id: DeviceId, generator: Generator) -> CallResult<GeneratorLimits> {
        let mut values = [0.0; 3];
        let [a, v, j] = &mut values;
        let (a, v, j) = (&raw mut *a, &raw mut *v, &raw mut *j);
        match generator {
            Generator::Move => call!(self.drdGetPosMoveParam(a, v, j, id)),
            Generator::Track => call!(self.drdGetPosTrackParam(a, v, j, id)),
        }?;
        let [acceleration_m_s2, speed_m_s, jerk_m_s3] = values;
        Ok(GeneratorLimits {
            acceleration_m_s2,
            speed_m_s,
            jerk_m_s3,
        })
    }

    fn track(&self, id: DeviceId, [x, y, z]: [f64; 3]) -> CallResult<()> {
        call!(self.drdTrackPos(x, y, z, id)).map(drop)
    }

    fn regulated_position(&self, id: DeviceId) -> CallResult<Reading> {
        let mut pose = [0.0; 7];
        let mut matrix = [0.0; 9];
        let [x, y, z, oa, ob, og, gap] = &mut pose;
        let result = call!(self.drdGetPositionAndOrientation(
            x,
            y,
            z,
            oa,
            ob,
            og,
            gap,
            &raw mut matrix,
            id
        ))?;
        let [x, y, z, ..] = pose;
        Ok(Reading {
            position_m: [x, y, z],
            cached: result == skinrig_drd_abi::TIMEGUARD,
        })
    }

    fn position(&self, id: DeviceId) -> CallResult<Reading> {
        let mut position_m = [0.0; 3];
        let [x, y, z] = &mut position_m;
        let result = call!(self.dhdGetPosition(x, y, z, id))?;
        Ok(Reading {
            position_m,
            cached: result == skinrig_drd_abi::TIMEGUARD,
        })
    }

    fn force(&self, id: DeviceId) -> CallResult<[f64; 3]> {
        let mut force_n = [0.0; 3];
        let [x, y, z] = &mut force_n;
        call!(self.dhdGetForce(x, y, z, id))?;
        Ok(force_n)
    }

    fn emergency_stop(&self, id: DeviceId) -> CallResult<()> {
        call!(self.dhdStop(id)).map(drop)
    }

    fn force_off(&self, id: DeviceId) -> CallResult<()> {
        call!(self.dhdEnableForce(0, id)).map(drop)
    }
}
