//! The golden campaign: a protocol through controller, recorder and analysis, in the night's folder.

use std::path::Path;

use skinrig_hil::{GoldenRun, Trouble};
use skinrig_nightly::{Evidence, EvidenceKind};

use super::bench::RealBench;

/// Closes every device and runs the golden campaign.
///
/// # Errors
/// [`Trouble`] when there is no session to speak of.
pub fn golden(_bench: &mut RealBench, _protocol: &Path) -> Result<GoldenRun, Trouble> {
    let what = "the golden campaign is not built yet";
    Err(Box::new(Evidence::new(
        EvidenceKind::Software,
        "skin",
        what,
    )))
}
