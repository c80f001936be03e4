//! Law: the skin locates better than a blind guess.

use std::collections::BTreeSet;

use skinrig_model::{LocationId, Point2, PressRole, Verdict};

use super::finding::finding;
use crate::metrics::spread_mm;
use crate::result::{Analysis, Evidence, Fault, Finding, Law, MOST_OF_GUESS, PressResult};

/// Minimum number of locations for a statement.
const MIN_PLACES: usize = 4;

pub(super) fn findings(analysis: &Analysis) -> Option<Finding> {
    let counts = |p: &&PressResult| {
        p.role == PressRole::Score && p.verdict == Verdict::Valid && p.estimate().is_some()
    };
    let scored = || analysis.presses.iter().filter(counts);
    let truths: Vec<Point2> = scored().filter_map(|p| p.truth).collect();
    // One location is never at the same measured position twice.
    let places: BTreeSet<LocationId> = scored().map(|p| p.location).collect();
    let (rmse_mm, ignorance_mm) = (
        analysis.scored.rmse_mm.value?,
        spread_mm(truths.iter().copied()),
    );
    (places.len() >= MIN_PLACES && rmse_mm > MOST_OF_GUESS * ignorance_mm).then(|| {
        let evidence = Evidence::NoBetterThanGuess {
            rmse_mm,
            guess_mm: ignorance_mm,
            presses: truths.len(),
        };
        let mut found = finding(Law::CentroidFollowsPosition, Fault::Unknown, None, evidence);
        found.invalidates = true;
        found
    })
}
