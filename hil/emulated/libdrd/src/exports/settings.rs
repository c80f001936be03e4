//! Parameters with a setter and a getter each.

use super::outcome::{fill, run, run_bool, values};
use crate::config::Setting;
use crate::host;
use crate::wire::Call;

fn set(name: &str, setting: Setting, numbers: &[f64], id: i8) -> i32 {
    run(name, numbers, -1, || {
        // Non-finite numbers cannot be sent to the firmware.
        if numbers.iter().any(|n| !n.is_finite()) {
            return Err(skinrig_drd_abi::ErrorCode::INVALID);
        }
        host::call(id, Call::Set(setting, numbers.to_vec())).map(|_| 0)
    })
}

fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}

/// Reads a parameter into output pointers.
///
/// # Safety
/// Each pointer is NULL or valid for one number.
unsafe fn get<const N: usize>(name: &str, setting: Setting, places: [*mut f64; N], id: i8) -> i32 {
    run(name, &[], -1, || {
        let numbers = values(host::call(id, Call::Get(setting))?)?;
        // SAFETY: this function's contract.
        unsafe { fill(places, numbers) }?;
        Ok(0)
    })
}

/// Reads a parameter as the return value.
fn returned(name: &str, setting: Setting, id: i8) -> f64 {
    run(name, &[], -1.0, || {
        let [number] = values(host::call(id, Call::Get(setting))?)?;
        Ok(number)
    })
}

/// Declares setters of one number.
macro_rules! setters {
    ($($name:ident($ty:ty) $setting:ident;)*) => { $(
        #[unsafe(no_mangle)]
        pub extern "system" fn $name(value: $ty, id: i8) -> i32 {
            set(stringify!($name), Setting::$setting, &[f64::from(value)], id)
        }
    )* };
}

/// Declares setters of a C++ `bool`.
macro_rules! switches {
    ($($name:ident $setting:ident;)*) => { $(
        #[unsafe(no_mangle)]
        pub extern "system" fn $name(on: bool, id: i8) -> i32 {
            set(stringify!($name), Setting::$setting, &[flag(on)], id)
        }
    )* };
}

/// Declares getters that write one number.
macro_rules! getters {
    ($($name:ident $setting:ident;)*) => { $(
        #[unsafe(no_mangle)]
        pub unsafe extern "system" fn $name(value: *mut f64, id: i8) -> i32 {
            // SAFETY: the caller passes NULL or a place for one number.
            unsafe { get(stringify!($name), Setting::$setting, [value], id) }
        }
    )* };
}

/// Declares getters that return a number.
macro_rules! returning {
    ($($name:ident $setting:ident;)*) => { $(
        #[unsafe(no_mangle)]
        pub extern "system" fn $name(id: i8) -> f64 {
            returned(stringify!($name), Setting::$setting, id)
        }
    )* };
}

/// Declares getter and setter of a motion's limits.
macro_rules! limits {
    ($($get:ident $set:ident $setting:ident;)*) => { $(
        #[unsafe(no_mangle)]
        pub unsafe extern "system" fn $get(amax: *mut f64, vmax: *mut f64, jerk: *mut f64, id: i8) -> i32 {
            // SAFETY: the caller passes NULL or places for one number each.
            unsafe { get(stringify!($get), Setting::$setting, [amax, vmax, jerk], id) }
        }

        #[unsafe(no_mangle)]
        pub extern "system" fn $set(amax: f64, vmax: f64, jerk: f64, id: i8) -> i32 {
            set(stringify!($set), Setting::$setting, &[amax, vmax, jerk], id)
        }
    )* };
}

setters! {
    dhdSetDeviceAngleDeg(f64) DeviceAngle;
    dhdSetBaseAngleXDeg(f64) BaseAngleX;
    dhdSetBaseAngleZDeg(f64) BaseAngleZ;
    dhdSetEffectorMass(f64) EffectorMass;
    dhdSetGravityCompensation(i32) Gravity;
    dhdSetMaxForce(f64) MaxForce;
    drdSetMotRatioMax(f64) MotorRatio;
    drdSetEncPGain(f64) GainP;
    drdSetEncIGain(f64) GainI;
    drdSetEncDGain(f64) GainD;
}

switches! {
    drdEnableFilter Filter;
    drdRegulatePos RegulatePos;
    drdRegulateRot RegulateRot;
    drdRegulateGrip RegulateGrip;
}

getters! {
    dhdGetDeviceAngleDeg DeviceAngle;
    dhdGetBaseAngleXDeg BaseAngleX;
    dhdGetBaseAngleZDeg BaseAngleZ;
    dhdGetEffectorMass EffectorMass;
}

returning! {
    dhdGetMaxForce MaxForce;
    drdGetMotRatioMax MotorRatio;
    drdGetEncPGain GainP;
    drdGetEncIGain GainI;
    drdGetEncDGain GainD;
}

limits! {
    drdGetPosMoveParam drdSetPosMoveParam MoveParam;
    drdGetPosTrackParam drdSetPosTrackParam TrackParam;
}

#[unsafe(no_mangle)]
pub extern "system" fn drdIsFiltering(id: i8) -> u8 {
    run_bool("drdIsFiltering", || {
        let [on] = values(host::call(id, Call::Get(Setting::Filter))?)?;
        Ok(on != 0.0)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn drdGetPriorities(
    calling: *mut i32,
    regulation: *mut i32,
    id: i8,
) -> i32 {
    run("drdGetPriorities", &[], -1, || {
        let numbers: [f64; 2] = values(host::call(id, Call::Get(Setting::Priorities))?)?;
        // SAFETY: the caller passes NULL or places for one number each.
        unsafe { fill([calling, regulation], numbers.map(host::integer)) }?;
        Ok(0)
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn drdSetPriorities(calling: i32, regulation: i32, id: i8) -> i32 {
    set(
        "drdSetPriorities",
        Setting::Priorities,
        &[calling, regulation].map(f64::from),
        id,
    )
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdSetWatchdog(units: u8, id: i8) -> i32 {
    run("dhdSetWatchdog", &[f64::from(units)], -1, || {
        host::expert()?;
        host::call(id, Call::Set(Setting::Watchdog, vec![f64::from(units)])).map(|_| 0)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetWatchdog(units: *mut u8, id: i8) -> i32 {
    run("dhdGetWatchdog", &[], -1, || {
        host::expert()?;
        let [number] = values(host::call(id, Call::Get(Setting::Watchdog))?)?;
        let number = u8::try_from(host::integer(number)).unwrap_or(u8::MAX);
        // SAFETY: the caller passes NULL or a place for one number.
        unsafe { fill([units], [number]) }?;
        Ok(0)
    })
}

/// The vendor's units are not documented, so this number is arbitrary.
const VELOCITY_THRESHOLD: u32 = 400;

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetVelocityThreshold(threshold: *mut u32, id: i8) -> i32 {
    run("dhdGetVelocityThreshold", &[], -1, || {
        host::expert()?;
        host::state(id)?;
        // SAFETY: the caller passes NULL or a place for one number.
        unsafe { fill([threshold], [VELOCITY_THRESHOLD]) }?;
        Ok(0)
    })
}
