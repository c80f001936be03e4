//! The drill of the watchdog on a real driver: a second process holds the arm in free air and is killed.

use skinrig_hil::{Drilled, Trouble};
use skinrig_nightly::{Evidence, EvidenceKind};

use super::bench::RealBench;

/// Closes every device, lets another process hold the arm, and kills it.
///
/// # Errors
/// [`Trouble`] when it could not be done.
pub fn watchdog(_bench: &mut RealBench) -> Result<Drilled, Trouble> {
    let what = "the watchdog drill is not built yet";
    Err(Box::new(Evidence::new(
        EvidenceKind::Software,
        "robot",
        what,
    )))
}
