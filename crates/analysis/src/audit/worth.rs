//! Law: the skin locates better than an answer that knows nothing.

use std::collections::BTreeSet;

use skinrig_model::{Point2, PressRole, PressVerdict};

use super::finding::finding;
use crate::metrics::spread_mm;
use crate::result::{Analysis, Fault, Finding, Law, PressResult};

/// Above this share of the error of the positions' mean, an RMSE says nothing of the skin: cameras, positions or times are
/// others than they are taken for, or the skin is dead.
const MOST_SHARE: f64 = 0.7;
/// A statement needs this many places.
const LEAST_PLACES: usize = 4;

pub fn findings(analysis: &Analysis) -> Option<Finding> {
    let counts = |p: &&PressResult| {
        p.role == PressRole::Score
            && p.verdict == PressVerdict::Valid.name()
            && p.estimate().is_some()
    };
    let scored = analysis.presses.iter().filter(counts);
    let truths: Vec<Point2> = scored.filter_map(|p| p.truth).collect();
    let places: BTreeSet<(u64, u64)> = truths
        .iter()
        .map(|p| (p.x_mm.to_bits(), p.y_mm.to_bits()))
        .collect();
    let (rmse_mm, ignorance_mm) = (
        analysis.scored.rmse_mm.value?,
        spread_mm(truths.iter().copied()),
    );
    (places.len() >= LEAST_PLACES && rmse_mm > MOST_SHARE * ignorance_mm).then(|| {
        let evidence = format!(
            "expected presses located nearer than their mean position is, found RMSE {rmse_mm:.1} mm where the mean gives \
             {ignorance_mm:.1} mm (n {})",
            truths.len()
        );
        let mut found = finding(Law::CentroidFollowsPosition, Fault::Unknown, None, evidence);
        found.invalidates = true;
        found
    })
}
