//! The hard stop: motors off and electromagnetic brake on, retried until the robot confirms.

use std::time::Duration;

use skinrig_drd_abi::{DeviceId, StatusField};

use crate::config::Timeouts;
use crate::sdk::{CallError, Sdk};

/// The robot did not confirm that its motors are off.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the arm may be live: not braked after {attempts} attempts ({last}); press the force button on its base or switch it off at the mains"
)]
pub struct BrakeUnconfirmed {
    /// Number of attempts.
    pub attempts: u32,
    /// Error of the last attempt.
    pub last: BrakeError,
}

/// Why one attempt to brake failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BrakeError {
    /// The regulation could not be stopped, nor the force switched off directly.
    #[error("{stop}, then {direct}")]
    Rejected {
        /// Error of stopping the regulation.
        stop: CallError,
        /// Error of switching the force off directly.
        direct: CallError,
    },
    /// The status still shows live motors.
    #[error("the library reported success, but the status shows that the motors are live{}", also(.direct.as_ref()))]
    StillLive {
        /// Error of switching the force off directly, if that failed.
        direct: Option<CallError>,
    },
    /// The status could not be read.
    #[error("the status could not be read: {cause}{}", also(.direct.as_ref()))]
    StatusUnknown {
        /// The failed call.
        cause: CallError,
        /// Error of switching the force off directly, if that failed.
        direct: Option<CallError>,
    },
    /// No attempt was allowed.
    #[error("no attempt was made")]
    NoAttempt,
}

fn also(direct: Option<&CallError>) -> String {
    direct.map_or_else(String::new, |e| format!(", and {e}"))
}

/// Brakes the arm: stops the regulation; if that fails, or the status still shows live motors, switches the force off directly; then
/// waits and retries. Returns the number of attempts.
///
/// The documentation does not specify what the library does when asked to stop a regulation that this process did not start, so a success
/// counts only if the status confirms it.
///
/// # Errors
/// [`BrakeUnconfirmed`] after all attempts.
pub fn brake(
    sdk: &dyn Sdk,
    id: DeviceId,
    timeouts: &Timeouts,
    mut wait: impl FnMut(Duration),
) -> Result<u32, BrakeUnconfirmed> {
    let mut last = BrakeError::NoAttempt;
    for attempt in 1..=timeouts.brake_attempts {
        match brake_once(sdk, id) {
            Ok(()) => return Ok(attempt),
            Err(error) => last = error,
        }
        if attempt < timeouts.brake_attempts {
            wait(timeouts.brake_retry);
        }
    }
    Err(BrakeUnconfirmed {
        attempts: timeouts.brake_attempts,
        last,
    })
}

fn brake_once(sdk: &dyn Sdk, id: DeviceId) -> Result<(), BrakeError> {
    let stopped = sdk.stop(id);
    if stopped.is_ok() && confirm_off(sdk, id, None).is_ok() {
        return Ok(());
    }
    // Call both whatever the first one returns: either may be enough.
    let halted = sdk.emergency_stop(id);
    let off = sdk.force_off(id);
    match (stopped, halted.and(off)) {
        (Err(stop), Err(direct)) => Err(BrakeError::Rejected { stop, direct }),
        (_, direct) => confirm_off(sdk, id, direct.err()),
    }
}

/// Checks in the status that the motors are off.
fn confirm_off(sdk: &dyn Sdk, id: DeviceId, direct: Option<CallError>) -> Result<(), BrakeError> {
    match sdk.status(id) {
        Ok(status) if status.is(StatusField::Force) => Err(BrakeError::StillLive { direct }),
        Ok(_) => Ok(()),
        Err(cause) => Err(BrakeError::StatusUnknown { cause, direct }),
    }
}
