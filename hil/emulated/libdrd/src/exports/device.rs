//! Finding, opening, closing, identity, power.

use std::ffi::c_char;

use skinrig_drd_abi::{COM_MODE_ASYNC, DEVICE_OMEGA3, ErrorCode};

use super::outcome::{Outcome, fill, run, run_bool, run_call, values};
use crate::host;
use crate::wire::Call;

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetDeviceCount() -> i32 {
    run("dhdGetDeviceCount", &[], -1, || {
        host::count().map(|[all, _]| all)
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetAvailableCount() -> i32 {
    run("dhdGetAvailableCount", &[], -1, || {
        host::count().map(|[_, free]| free)
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn drdOpen() -> i32 {
    run("drdOpen", &[], -1, || host::open(0).map(i32::from))
}

#[unsafe(no_mangle)]
pub extern "system" fn drdOpenID(id: i8) -> i32 {
    run("drdOpenID", &[f64::from(id)], -1, || {
        host::open(id).map(i32::from)
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn drdClose(id: i8) -> i32 {
    run("drdClose", &[], -1, || host::close(id).map(|()| 0))
}

/// Identity reported by a device.
struct Identity {
    device_type: i32,
    serial: Option<u16>,
    firmware: f64,
    memory_fine: bool,
    supported: bool,
}

fn identity(id: i8) -> Outcome<Identity> {
    let [device_type, serial, firmware, memory, supported] =
        values(host::call(id, Call::Identity)?)?;
    Ok(Identity {
        device_type: host::integer(device_type),
        serial: u16::try_from(host::integer(serial)).ok(),
        firmware,
        memory_fine: memory != 0.0,
        supported: supported != 0.0,
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetSystemType(id: i8) -> i32 {
    run(
        "dhdGetSystemType",
        &[],
        -1,
        || Ok(identity(id)?.device_type),
    )
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetSystemName(id: i8) -> *const c_char {
    let mut name = std::ptr::null();
    run("dhdGetSystemName", &[], -1, || {
        name = match identity(id)?.device_type {
            DEVICE_OMEGA3 => c"omega.3".as_ptr(),
            _ => c"another device".as_ptr(),
        };
        Ok(0)
    });
    name
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetSerialNumber(serial: *mut u16, id: i8) -> i32 {
    run("dhdGetSerialNumber", &[], -1, || {
        let number = identity(id)?.serial.ok_or(ErrorCode::NOT_AVAILABLE)?;
        // SAFETY: the caller passes NULL or a place for one number.
        unsafe { fill([serial], [number]) }?;
        Ok(0)
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetSystemRev(id: i8) -> i32 {
    run("dhdGetSystemRev", &[], -1, || identity(id).map(|_| 0))
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetVersion(version: *mut f64, id: i8) -> i32 {
    run("dhdGetVersion", &[], -1, || {
        let number = identity(id)?.firmware;
        // SAFETY: the caller passes NULL or a place for one number.
        unsafe { fill([version], [number]) }?;
        Ok(0)
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetVersionStr(buffer: *mut c_char, size: usize, id: i8) -> i32 {
    run("dhdGetVersionStr", &[], -1, || {
        let text = identity(id)?.firmware.to_string();
        if buffer.is_null() || size == 0 {
            return Err(ErrorCode::NULL_ARGUMENT);
        }
        let fits = text.len().min(size - 1);
        // SAFETY: the caller's buffer takes `size` bytes: the text as far as it fits, and its end.
        unsafe {
            std::ptr::copy_nonoverlapping(text.as_ptr(), buffer.cast(), fits);
            buffer.add(fits).write(0);
        }
        Ok(0)
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetComMode(id: i8) -> i32 {
    run("dhdGetComMode", &[], -1, || {
        identity(id).map(|_| COM_MODE_ASYNC)
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdCheckControllerMemory(id: i8) -> i32 {
    run("dhdCheckControllerMemory", &[], -1, || {
        Ok(if identity(id)?.memory_fine {
            0
        } else {
            ErrorCode::CONFIGURATION.0
        })
    })
}

#[unsafe(no_mangle)]
pub extern "system" fn drdIsSupported(id: i8) -> u8 {
    run_bool("drdIsSupported", || Ok(identity(id)?.supported))
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdStop(id: i8) -> i32 {
    run_call("dhdStop", &[], id, Call::Brake)
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdEnableForce(on: u8, id: i8) -> i32 {
    run_call("dhdEnableForce", &[f64::from(on)], id, Call::Force(on != 0))
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdSetBrakes(on: i32, id: i8) -> i32 {
    run_call("dhdSetBrakes", &[f64::from(on)], id, Call::Brakes(on != 0))
}
