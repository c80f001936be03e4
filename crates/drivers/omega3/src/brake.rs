//! The hard stop: motors off, electromagnetic brake on, tried until the robot confirms it.

use std::time::Duration;

use skinrig_drd_abi::{DeviceId, StatusField};

use crate::config::Patience;
use crate::sdk::{CallError, Sdk};

/// The robot did not confirm that its motors are off.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the arm may be live: after {attempts} attempts to brake, {last}; press the force button on its base or switch it off at the mains"
)]
pub struct MayBeLive {
    /// How often it was tried.
    pub attempts: u32,
    /// What the last attempt met.
    pub last: String,
}

/// Brakes the arm: stops the regulation; if that is refused, or the status does not show the motors off after it, takes
/// the force away directly; waits and tries again. Returns the number of attempts.
///
/// What the library does when asked to stop a regulation that this process never started is not documented: a success
/// is never believed without the status.
///
/// # Errors
/// [`MayBeLive`] after all attempts.
pub fn brake(
    sdk: &dyn Sdk,
    id: DeviceId,
    patience: &Patience,
    mut wait: impl FnMut(Duration),
) -> Result<u32, MayBeLive> {
    let mut last = String::new();
    for attempt in 1..=patience.brake_attempts {
        match attempt_to_brake(sdk, id) {
            Ok(()) => return Ok(attempt),
            Err(why) => last = why,
        }
        if attempt < patience.brake_attempts {
            wait(patience.brake_retry);
        }
    }
    Err(MayBeLive {
        attempts: patience.brake_attempts,
        last,
    })
}

fn attempt_to_brake(sdk: &dyn Sdk, id: DeviceId) -> Result<(), String> {
    let stopped = sdk.stop(id);
    if stopped.is_ok() && confirmed_off(sdk, id).is_ok() {
        return Ok(());
    }
    // Both, whatever the first one answers: each alone may do.
    let halted = sdk.emergency_stop(id);
    let off = sdk.force_off(id);
    let direct = halted.and(off);
    if let Err(refused) = stopped {
        direct.map_err(|e: CallError| format!("{refused}, then {e}"))?;
        return confirmed_off(sdk, id);
    }
    confirmed_off(sdk, id).map_err(|why| match direct {
        Ok(()) => why,
        Err(e) => format!("{why}, and {e}"),
    })
}

/// Whether the status says that the motors are off.
fn confirmed_off(sdk: &dyn Sdk, id: DeviceId) -> Result<(), String> {
    match sdk.status(id) {
        Ok(status) if status.is(StatusField::Force) => {
            Err("it confirmed, but its status says that the motors are live".to_owned())
        }
        Ok(_) => Ok(()),
        Err(e) => Err(format!("its status could not be read: {e}")),
    }
}
