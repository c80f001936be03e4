//! What can go wrong with the robot before it serves as an indenter, each with the next step.

use std::time::Duration;

use skinrig_device::DeviceError;
use skinrig_drd_abi::ErrorCode;
use skinrig_model::DeviceRole;

use crate::config::BadValue;
use crate::load::LoadError;
use crate::sdk::CallError;

/// The robot cannot be opened, or not be used as asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OmegaError {
    /// A value of the configuration makes no sense.
    #[error(transparent)]
    Config(#[from] BadValue),
    /// No usable library.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The robot of the configuration is not among the connected ones, or not free.
    #[error("omega.3: expected {expected}, found {found}; {next}")]
    NotFound {
        /// Which robot was looked for.
        expected: String,
        /// What is connected.
        found: String,
        /// What to do.
        next: String,
    },
    /// A call failed.
    #[error("omega.3 {serial}: {step}: {cause}; {}", next_step(cause.code))]
    Call {
        /// Which robot.
        serial: String,
        /// Part of the procedure.
        step: &'static str,
        /// The call and its error.
        cause: CallError,
    },
    /// The robot is not as it has to be.
    #[error("omega.3 {serial}: expected {expected}, found {found}; {next}")]
    Unfit {
        /// Which robot.
        serial: String,
        /// What it has to be.
        expected: String,
        /// What it is.
        found: String,
        /// What to do.
        next: String,
    },
    /// A setting did not read back as written.
    #[error("omega.3 {serial}: {name}: expected {expected} after writing, found {found}")]
    ReadBack {
        /// Which robot.
        serial: String,
        /// Which setting.
        name: String,
        /// What was written.
        expected: String,
        /// What was read.
        found: String,
    },
    /// The library did not return.
    #[error(
        "omega.3: {what}: expected an end within {waited:?}, found none; the arm was told to brake: look at it, and press the force button on its base"
    )]
    Late {
        /// What was under way.
        what: &'static str,
        /// How long was waited.
        waited: Duration,
    },
    /// The operating system gave no thread.
    #[error("omega.3: cannot start a thread: {0}")]
    Thread(String),
    /// The process that brakes the arm when this one dies does not run.
    #[error(
        "omega.3: supervisor process: {0}; without it nothing brakes the arm when this program dies"
    )]
    Supervisor(String),
}

impl OmegaError {
    /// As an error of the trait.
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
                found: format!("not: {cause}; {}", next_step(cause.code)),
            },
            Self::Unfit {
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

/// Whether the code means that the device is gone.
#[must_use]
pub(crate) const fn is_loss(code: ErrorCode) -> bool {
    matches!(code, ErrorCode::COM | ErrorCode::NO_DEVICE_FOUND)
}

/// What the operator does about an error code.
#[must_use]
pub const fn next_step(code: ErrorCode) -> &'static str {
    match code {
        ErrorCode::COM => "check power and USB cable, then start again",
        ErrorCode::NO_DRIVER_FOUND => {
            "give yourself access: install hil/udev/70-skinrig.rules (hil/README.md), then plug the robot in again"
        }
        ErrorCode::NO_DEVICE_FOUND => "plug the robot in and switch it on",
        ErrorCode::DEVICE_IN_USE => "end the other program that holds the robot",
        ErrorCode::DEVICE_NOT_READY => "initialise the robot with the sample taken off",
        ErrorCode::CONFIGURATION | ErrorCode::REDUNDANT_FAIL => {
            "have the robot serviced: its memory or its encoders are damaged"
        }
        ErrorCode::DHC_BUSY | ErrorCode::TIMEOUT => "try again; if it stays, power-cycle the robot",
        ErrorCode::NO_REGULATION => "disarm and arm again",
        _ => "see the bench guide",
    }
}
