//! Errors of devices.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::device_role::DeviceRole;
use crate::time::HostDuration;

/// A device failed or rejected a request.
///
/// Messages state the device, and what was expected and found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum DeviceError {
    /// The device is disconnected or stopped responding.
    #[error("{role} {serial}: lost: {detail}")]
    Lost {
        /// The device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// Details.
        detail: String,
    },
    /// The device did not respond to a call in time. The call may still be executing, so its effect is unknown.
    #[error(
        "{role} {serial}: not answering: expected an answer to `{doing}` within {within}, found none"
    )]
    Silent {
        /// The device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// The call.
        doing: Cow<'static, str>,
        /// Time limit.
        within: HostDuration,
    },
    /// The call is still in progress. Not a fault: make the same call again later.
    #[error("{role} {serial}: expected an answer to `{doing}`, found it under way; ask again")]
    Pending {
        /// The device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// The call.
        doing: Cow<'static, str>,
    },
    /// A setting read back with another value than was written.
    #[error("{role} {serial}: {name}: expected {expected} after writing, found {found}")]
    ReadBack {
        /// The device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// Name of the setting.
        name: String,
        /// Written value.
        expected: String,
        /// Value read back.
        found: String,
    },
    /// A request beyond the device's capabilities or limits. It had no effect.
    #[error("{role} {serial}: refused: expected {expected}, found {found}")]
    Refused {
        /// The device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// Acceptable requests.
        expected: String,
        /// The request.
        found: String,
    },
    /// The device is in the wrong state (not armed, not started, busy).
    #[error("{role} {serial}: expected to be {expected}, is {found}")]
    State {
        /// The device.
        role: DeviceRole,
        /// Its serial number.
        serial: String,
        /// Required state.
        expected: String,
        /// Actual state.
        found: String,
    },
    /// A replayed device received a request that differs from its recording.
    #[error("{role}: replay diverged at {at}: recorded {expected}, requested {found}")]
    Diverged {
        /// The device.
        role: DeviceRole,
        /// Position in the recording.
        at: String,
        /// Recorded request.
        expected: String,
        /// Actual request.
        found: String,
    },
}
