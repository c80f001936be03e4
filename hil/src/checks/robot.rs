//! Checks: the robot in free air.

use skinrig_protocol::suite::Check;

use crate::bench::Bench;
use crate::findings::Findings;

/// Makes the check.
pub fn robot_state(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}

/// Makes the check.
pub fn repeatability(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}

/// Makes the check.
pub fn step_response(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}
