//! Errors while opening the robot, each with the next step.

use std::time::Duration;

use skinrig_device::DeviceError;
use skinrig_drd_abi::ErrorCode;
use skinrig_model::DeviceRole;

use crate::config::BadValue;
use crate::load::LoadError;
use crate::sdk::CallError;

/// The robot cannot be opened or configured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OmegaError {
    /// Invalid configuration.
    #[error(transparent)]
    Config(#[from] BadValue),
    /// No usable library.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The configured robot is not connected or not free.
    #[error("omega.3: expected {expected}, found {found}; {next}")]
    NotFound {
        /// The robot that was searched for.
        expected: String,
        /// Connected devices.
        found: String,
        /// Next step.
        next: String,
    },
    /// A library call failed.
    #[error("omega.3 {serial}: {step}: {cause}; {}", next_step(cause.code))]
    Call {
        /// Serial number of the robot.
        serial: String,
        /// Step of the procedure.
        step: &'static str,
        /// The failed call.
        cause: CallError,
    },
    /// The robot is not in a usable state.
    #[error("omega.3 {serial}: expected {expected}, found {found}; {next}")]
    Unsuitable {
        /// Serial number of the robot.
        serial: String,
        /// Required state.
        expected: String,
        /// Actual state.
        found: String,
        /// Next step.
        next: String,
    },
    /// A setting read back with another value than was written.
    #[error("omega.3 {serial}: {name}: expected {expected} after writing, found {found}")]
    ReadBack {
        /// Serial number of the robot.
        serial: String,
        /// Name of the setting.
        name: String,
        /// Written value.
        expected: String,
        /// Value read back.
        found: String,
    },
    /// A library call did not return in time.
    #[error(
        "omega.3: {what} did not finish within {waited:?}; the driver tried to brake the arm: check it, and press the force button on its base"
    )]
    TimedOut {
        /// The unfinished operation.
        what: &'static str,
        /// The time limit.
        waited: Duration,
    },
    /// The operating system could not start a thread.
    #[error("omega.3: cannot start a thread: {0}")]
    Thread(String),
    /// The supervisor process is not running.
    #[error(
        "omega.3: supervisor process: {0}; without it nothing brakes the arm if this program dies"
    )]
    Supervisor(String),
}

impl OmegaError {
    /// Converts to an error of the device trait.
    #[must_use]
    pub fn into_device(self, serial: &str) -> DeviceError {
        let role = DeviceRole::Indenter;
        let serial = serial.to_owned();
        match self {
            Self::Call { step, cause, .. } if is_loss(cause.code) => DeviceError::Lost {
                role,
                serial,
                detail: format!("{step}: {cause}; {}", next_step(cause.code)),
            },
            Self::Call { step, cause, .. } => DeviceError::State {
                role,
                serial,
                expected: format!("able to {step}"),
                found: format!("failed: {cause}; {}", next_step(cause.code)),
            },
            Self::Unsuitable {
                expected,
                found,
                next,
                ..
            } => DeviceError::State {
                role,
                serial,
                expected,
                found: format!("{found}; {next}"),
            },
            Self::ReadBack {
                name,
                expected,
                found,
                ..
            } => DeviceError::ReadBack {
                role,
                serial,
                name,
                expected,
                found,
            },
            other => DeviceError::Lost {
                role,
                serial,
                detail: other.to_string(),
            },
        }
    }
}

/// Whether the code means that the device is disconnected.
#[must_use]
pub(crate) const fn is_loss(code: ErrorCode) -> bool {
    matches!(code, ErrorCode::COM | ErrorCode::NO_DEVICE_FOUND)
}

/// Next step of the operator after an error code.
#[must_use]
pub const fn next_step(code: ErrorCode) -> &'static str {
    match code {
        ErrorCode::COM => "check power and USB cable, then start again",
        ErrorCode::NO_DRIVER_FOUND => {
            "give yourself access: install hil/udev/70-skinrig.rules (hil/README.md), then reconnect the robot"
        }
        ErrorCode::NO_DEVICE_FOUND => "connect the robot and switch it on",
        ErrorCode::DEVICE_IN_USE => "end the other program that uses the robot",
        ErrorCode::DEVICE_NOT_READY => "remove the sample and initialise the robot",
        ErrorCode::CONFIGURATION | ErrorCode::REDUNDANT_FAIL => {
            "self-test failed (encoders or memory): contact Force Dimension support"
        }
        ErrorCode::DHC_BUSY | ErrorCode::TIMEOUT => {
            "try again; if it persists, power-cycle the robot"
        }
        ErrorCode::NO_REGULATION => "disarm and arm again",
        _ => "see docs/how-to/bench.md",
    }
}
