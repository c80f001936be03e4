//! What is connected, without moving anything: for lists, and to find the robot of a bench.

use std::fmt;

pub use skinrig_drd_abi::SERIAL_UNKNOWN;
use skinrig_drd_abi::{DEVICE_OMEGA3, DeviceId, ErrorCode};

use crate::error::next_step;
use crate::sdk::{Answer, CallError, Sdk};

/// USB vendor of Force Dimension. Product numbers differ among omega.3 (0402, 0301), so rules and lists name the vendor alone
/// (udev rules of chai3d and yarp-omega3).
pub const USB_VENDOR: u16 = 0x1451;

/// A connected device of Force Dimension.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Its place in the library's enumeration.
    pub index: i8,
    /// Its model, when it could be asked.
    pub model: Option<String>,
    /// Its type number, when it could be asked.
    pub type_number: Option<i32>,
    /// Its serial number, when it could be asked and has one.
    pub serial: Option<u16>,
    /// Version of its controller's firmware, when it could be asked.
    pub firmware: Option<String>,
    /// Whether it can be used.
    pub availability: Availability,
}

/// Whether a device can be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Availability {
    /// Yes.
    Free,
    /// Another program holds it.
    Busy,
    /// The operating system does not let us.
    NotPermitted,
    /// It does not report the type number of an omega.3.
    OtherModel,
    /// Something else is wrong.
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

impl Found {
    /// What to do before it can be used; `None` when nothing.
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

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let model = self.model.as_deref().unwrap_or("Force Dimension device");
        match self.serial {
            Some(serial) => write!(f, "{model}, serial {serial}")?,
            None => write!(f, "{model} without a known serial, place {}", self.index)?,
        }
        match &self.availability {
            Availability::Free => write!(f, ": free"),
            Availability::Busy => write!(f, ": busy, another program holds it"),
            Availability::NotPermitted => write!(f, ": found, but access is not permitted"),
            Availability::OtherModel => write!(f, ": not an omega.3"),
            Availability::Failed(e) => write!(f, ": {e}"),
        }
    }
}

/// Lists the connected devices. Opens each for a moment and closes it again; no motor is touched.
///
/// # Errors
/// When the library cannot even count them.
pub fn list(sdk: &dyn Sdk) -> Answer<Vec<Found>> {
    let count = sdk.device_count()?;
    Ok((0..count)
        .map(|index| match sdk.open(index) {
            Err(e) => unknown(index, e),
            Ok(id) => {
                let mut found = look(sdk, index, id);
                if let Err(e) = sdk.close(id) {
                    found.availability = Availability::Failed(e);
                }
                found
            }
        })
        .collect())
}

/// A device that could not be opened.
pub(crate) fn unknown(index: i8, error: CallError) -> Found {
    Found {
        index,
        model: None,
        type_number: None,
        serial: None,
        firmware: None,
        availability: error.into(),
    }
}

/// As short as the number can be told: 3.0, not 3.00, and 3.123 in full.
pub(crate) fn firmware_text(version: f64) -> String {
    format!("{version:?}")
}

/// Looks at an open device.
pub(crate) fn look(sdk: &dyn Sdk, index: i8, id: DeviceId) -> Found {
    let type_number = sdk.system_type(id);
    let availability = match &type_number {
        Ok(DEVICE_OMEGA3) => Availability::Free,
        Ok(_) => Availability::OtherModel,
        Err(e) => Availability::Failed(e.clone()),
    };
    Found {
        index,
        model: sdk.system_name(id),
        type_number: type_number.ok(),
        serial: sdk.serial(id).ok().filter(|s| *s != SERIAL_UNKNOWN),
        firmware: sdk.firmware(id).ok().map(firmware_text),
        availability,
    }
}
