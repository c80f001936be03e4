//! Reasons for rejecting a command.

use skinrig_controller::{GuardError, RunFault};
use skinrig_device::DeviceError;

use super::command::JogCommandError;

/// Why a command was not executed.
pub(super) enum Refusal {
    /// Invalid or not allowed; the robot did not move.
    Input(InputError),
    /// The robot failed.
    Rig(RunFault),
}

/// Error in a command.
#[derive(Debug, thiserror::Error)]
pub(super) enum InputError {
    /// The line is not a command.
    #[error(transparent)]
    Command(#[from] JogCommandError),
    /// `point` without a touch before it.
    #[error("expected a touch since the last point, found none; `touch` first")]
    NoTouch,
    /// Faster than the limits of the rig.
    #[error("expected at most {most_mm_s} mm/s, the limit of this rig, found {mm_s} mm/s")]
    TooFast {
        /// The speed, mm/s.
        mm_s: f64,
        /// The limit, mm/s.
        most_mm_s: f64,
    },
    /// The motion would go below the floor.
    #[error(
        "{0}\n  next: check where the skin is; if it is lower than in the rig file's frame, start `skinrig jog` \
         with --beyond-frame"
    )]
    Floor(#[source] GuardError),
    /// The motion breaks another limit.
    #[error(transparent)]
    Guard(GuardError),
    /// The robot rejects it.
    #[error(transparent)]
    Device(DeviceError),
}

impl From<RunFault> for Refusal {
    fn from(e: RunFault) -> Self {
        match e {
            // A fault of the robot, not of the command.
            RunFault::Guard(
                GuardError::StalePose { .. } | GuardError::NotArmed | GuardError::Tripped { .. },
            ) => Self::Rig(e),
            RunFault::Guard(e @ GuardError::Floor { .. }) => Self::Input(InputError::Floor(e)),
            RunFault::Guard(e) => Self::Input(InputError::Guard(e)),
            RunFault::Device(e @ DeviceError::Refused { .. }) => Self::Input(InputError::Device(e)),
            e => Self::Rig(e),
        }
    }
}
