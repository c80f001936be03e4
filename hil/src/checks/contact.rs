//! Checks: the robot against the skin.

use skinrig_protocol::suite::Check;

use crate::bench::Bench;
use crate::findings::Findings;

/// Makes the check.
pub fn depth(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}

/// Makes the check.
pub fn force_ceiling(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}
