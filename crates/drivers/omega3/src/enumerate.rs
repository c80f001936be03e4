//! Enumerates connected devices without moving anything.

use std::fmt;

pub use skinrig_drd_abi::SERIAL_UNKNOWN;
use skinrig_drd_abi::{DEVICE_OMEGA3, DeviceId, ErrorCode};

use crate::error::next_step;
use crate::sdk::{CallError, CallResult, Sdk};

/// USB vendor ID of Force Dimension. Product IDs of the omega.3 vary (0402, 0301), so rules and lists use the vendor ID alone (udev
/// rules of chai3d and yarp-omega3).
pub const USB_VENDOR: u16 = 0x1451;

/// A connected Force Dimension device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundDevice {
    /// Index in the library's enumeration.
    pub index: i8,
    /// Model, if readable.
    pub model: Option<String>,
    /// Type number, if readable.
    pub type_number: Option<i32>,
    /// Serial number, if readable and set.
    pub serial: Option<u16>,
    /// Firmware version of the controller, if readable.
    pub firmware: Option<String>,
    /// Whether it can be used.
    pub availability: Availability,
}

/// Whether a device can be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Availability {
    /// Usable.
    Free,
    /// In use by another program.
    Busy,
    /// The operating system denies access.
    NotPermitted,
    /// It does not report the type number of an omega.3.
    OtherModel,
    /// Another error.
    Failed(CallError),
}

impl From<CallError> for Availability {
    fn from(error: CallError) -> Self {
        match error.code {
            ErrorCode::DEVICE_IN_USE => Self::Busy,
            ErrorCode::NO_DRIVER_FOUND => Self::NotPermitted,
            _ => Self::Failed(error),
        }
    }
}

impl FoundDevice {
    /// Next step before it can be used; `None` if it is free.
    #[must_use]
    pub fn next_step(&self) -> Option<String> {
        Some(match &self.availability {
            Availability::Free => return None,
            Availability::Busy => next_step(ErrorCode::DEVICE_IN_USE).to_owned(),
            Availability::NotPermitted => next_step(ErrorCode::NO_DRIVER_FOUND).to_owned(),
            Availability::OtherModel => "connect an omega.3".to_owned(),
            Availability::Failed(e) => next_step(e.code).to_owned(),
        })
    }
}

impl fmt::Display for FoundDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let model = self.model.as_deref().unwrap_or("Force Dimension device");
        match self.serial {
            Some(serial) => write!(f, "{model}, serial {serial}")?,
            None => write!(f, "{model} without a known serial, index {}", self.index)?,
        }
        match &self.availability {
            Availability::Free => write!(f, ": free"),
            Availability::Busy => write!(f, ": busy, in use by another program"),
            Availability::NotPermitted => write!(f, ": found, but access is not permitted"),
            Availability::OtherModel => write!(f, ": not an omega.3"),
            Availability::Failed(e) => write!(f, ": {e}"),
        }
    }
}

/// Lists the connected devices. Opens and closes each; does not touch the motors.
///
/// # Errors
/// When the devices cannot be counted.
pub fn list(sdk: &dyn Sdk) -> CallResult<Vec<FoundDevice>> {
    let count = sdk.device_count()?;
    Ok((0..count)
        .map(|index| match sdk.open(index) {
            Err(e) => unopened(index, e),
            Ok(id) => {
                let mut found = identify(sdk, index, id);
                if let Err(e) = sdk.close(id) {
                    found.availability = Availability::Failed(e);
                }
                found
            }
        })
        .collect())
}

/// Entry of a device that could not be opened.
pub(crate) fn unopened(index: i8, error: CallError) -> FoundDevice {
    FoundDevice {
        index,
        model: None,
        type_number: None,
        serial: None,
        firmware: None,
        availability: error.into(),
    }
}

/// Shortest exact form: 3.0 rather than 3.00, and 3.123 in full.
pub(crate) fn firmware_text(version: f64) -> String {
    format!("{version:?}")
}

/// Reads the identity of an open device.
pub(crate) fn identify(sdk: &dyn Sdk, index: i8, id: DeviceId) -> FoundDevice {
    let type_number = sdk.system_type(id);
    let availability = match &type_number {
        Ok(DEVICE_OMEGA3) => Availability::Free,
        Ok(_) => Availability::OtherModel,
        Err(e) => Availability::Failed(e.clone()),
    };
    FoundDevice {
        index,
        model: sdk.system_name(id),
        type_number: type_number.ok(),
        serial: sdk.serial(id).ok().filter(|s| *s != SERIAL_UNKNOWN),
        firmware: sdk.firmware(id).ok().map(firmware_text),
        availability,
    }
}
