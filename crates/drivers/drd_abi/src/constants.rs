//! Constants of the interface.

pub use crate::table::NEVER_USED;

/// Device ID in calls: its index in the enumeration, as `drdOpenID` takes and returns it.
pub type DeviceId = i8;

/// The default device: the one opened most recently.
pub const DEFAULT_DEVICE: DeviceId = -1;

/// Type number of the omega.3.
pub const DEVICE_OMEGA3: i32 = 33;
/// Unlisted type number that one public library also accepts as an omega.3.
pub const DEVICE_OMEGA3_UNLISTED: i32 = 110;

/// Success with a cached reading: the function was called again too soon.
pub const TIMEGUARD: i32 = 1;
/// Success with a saturated motor: the force keeps its direction but is weaker.
pub const MOTOR_SATURATED: i32 = 2;

/// Communication modes: asynchronous USB, the default.
pub const COM_MODE_ASYNC: i32 = 1;

/// Unit of the controller's watchdog, µs.
pub const WATCHDOG_UNIT_US: u32 = 125;
/// Serial number of a device that does not report one.
pub const SERIAL_UNKNOWN: u16 = 65535;

/// Whether a result means success: any number that is not negative.
#[must_use]
pub const fn succeeded(result: i32) -> bool {
    result >= 0
}

/// Converts a returned C++ `bool`: true for every byte except 0.
#[must_use]
pub const fn is_true(byte: u8) -> bool {
    byte != 0
}
