//! The hidden command `supervise-arm`: brakes the robot's arm when the program that started it dies.

use crate::exit::{Exit, Failure, Outcome};

/// Waits on standard input until the driver exits, normally or not.
///
/// # Errors
/// [`Failure::rig`] when the arm could not be braked: it may be live.
pub(crate) fn supervise() -> Outcome {
    let ended = skinrig_omega3::supervisor::supervise(
        std::io::stdin(),
        std::io::stdout(),
        std::io::stderr(),
    );
    match ended {
        Ok(_) => Ok(Exit::Ok),
        Err(e) => Err(Failure::rig(e)),
    }
}
