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

/// Brakes the arm: stops the regulation; if that is refused or the motors stay live, takes the force away directly;
/// waits and tries again. Returns the number of attempts.
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
    if let Err(refused) = sdk.stop(id) {
        // Both, whatever the first one answers: each alone may do.
        let stopped = sdk.emergency_stop(id);
        let off = sdk.force_off(id);
        stopped
            .and(off)
            .map_err(|e: CallError| format!("{refused}, then {e}"))?;
    }
    match sdk.status(id) {
        Ok(status) if status.is(StatusField::Force) => {
            Err("it confirmed, but its status says that the motors are live".to_owned())
        }
        Ok(_) => Ok(()),
        Err(e) => Err(format!("its status could not be read: {e}")),
    }
}
