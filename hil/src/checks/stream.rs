//! Checks: data rate and loss, at rest and under the test pattern.

use skinrig_protocol::suite::Check;

use crate::bench::Bench;
use crate::findings::Findings;

/// Makes the check.
pub fn idle(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}

/// Makes the check.
pub fn test_pattern(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}
