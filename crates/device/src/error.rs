//! What can go wrong with a device.

use skinrig_model::{DeviceRole, HostDuration};

/// A device failed, or was asked for something that it cannot do.
///
/// Messages say what was expected, what was found, and on which device.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DeviceError {
    /// The device is gone or answers no longer.
    #[error("{role} {serial}: lost: {detail}")]
    Lost {
        /// Which device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// What was seen.
        detail: String,
    },
    /// The device did not answer a call in time, which may still be under way. What it was asked may or may not be carried out.
    #[error(
        "{role} {serial}: not answering: expected an answer to `{doing}` within {within}, found none"
    )]
    Silent {
        /// Which device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// The call.
        doing: &'static str,
        /// How long it was given.
        within: HostDuration,
    },
    /// Asked, and not answered yet: no fault. Whoever asked makes the same call again at the next look.
    #[error("{role} {serial}: expected an answer to `{doing}`, found it under way; ask again")]
    Pending {
        /// Which device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// The call.
        doing: &'static str,
    },
    /// A setting did not read back as written.
    #[error("{role} {serial}: {name}: expected {expected} after writing, found {found}")]
    ReadBack {
        /// Which device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// Which setting.
        name: String,
        /// What was written.
        expected: String,
        /// What was read.
        found: String,
    },
    /// A request outside what the device can or may do. Nothing was done.
    #[error("{role} {serial}: refused: expected {expected}, found {found}")]
    Refused {
        /// Which device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// What would have been accepted.
        expected: String,
        /// What was asked for.
        found: String,
    },
    /// The device is in a state in which it cannot do this (not armed, not started, busy).
    #[error("{role} {serial}: expected to be {expected}, is {found}")]
    State {
        /// Which device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// The state that the request needs.
        expected: String,
        /// The state it is in.
        found: String,
    },
    /// A replayed device was asked for something else than what its recording holds.
    #[error("{role}: replay diverged at {at}: recorded {expected}, requested {found}")]
    Diverged {
        /// Which device.
        role: DeviceRole,
        /// Where in the recording.
        at: String,
        /// What the recording holds.
        expected: String,
        /// What was requested.
        found: String,
    },
}
