//! Checks: the disk that sessions go to.

use skinrig_protocol::suite::Check;

use crate::bench::Bench;
use crate::findings::Findings;

/// Makes the check.
pub fn disk(check: &Check, _bench: &mut dyn Bench, found: &mut Findings) {
    found.not_here = Some(format!("{} is not built yet", check.name));
}
