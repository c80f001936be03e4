//! Checks: drills: what must stop the arm stops it.

use skinrig_protocol::suite::Check;

use crate::bench::Bench;
use crate::findings::Findings;

/// Makes the check.
pub fn watchdog(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}

/// Makes the check.
pub fn stop(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}
