//! Owns the reasons for which an order is not obeyed.

use skinrig_controller::{ControllerError, GuardError};
use skinrig_device::DeviceError;

use super::order::OrderError;

/// Why an order was not obeyed.
pub(super) enum Refusal {
    /// It may not be; the robot is as it was.
    Input(InputError),
    /// The robot failed.
    Rig(ControllerError),
}

/// What is wrong with an order.
#[derive(Debug, thiserror::Error)]
pub(super) enum InputError {
    /// The line is no order.
    #[error(transparent)]
    Order(#[from] OrderError),
    /// `point` without a touch before it.
    #[error("expected a touch since the last point, found none; `touch` first")]
    NoTouch,
    /// The motion would go below the floor.
    #[error(
        "{0}\n  next: check where the skin is; if it lies lower than the rig file's frame says, start `skinrig jog` \
         with --beyond-frame"
    )]
    Floor(#[source] GuardError),
    /// The motion breaks another limit.
    #[error(transparent)]
    Guard(GuardError),
    /// The robot refuses it.
    #[error(transparent)]
    Device(DeviceError),
}

impl From<ControllerError> for Refusal {
    fn from(e: ControllerError) -> Self {
        match e {
            // The robot is silent: no matter of what was typed.
            ControllerError::Guard(
                GuardError::StalePose { .. } | GuardError::NotArmed | GuardError::Tripped { .. },
            ) => Self::Rig(e),
            ControllerError::Guard(e @ GuardError::Floor { .. }) => {
                Self::Input(InputError::Floor(e))
            }
            ControllerError::Guard(e) => Self::Input(InputError::Guard(e)),
            ControllerError::Device(e @ DeviceError::Refused { .. }) => {
                Self::Input(InputError::Device(e))
            }
            e => Self::Rig(e),
        }
    }
}
