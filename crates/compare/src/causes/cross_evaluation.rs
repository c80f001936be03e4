//! Owns cross-evaluation: evaluates the presses of each skin with the calibration or the settings of the other.

use serde::Serialize;
use skinrig_analysis::locator::{CameraFeatures, FittedLocator};

use super::factor::Reanalysis;
use crate::locations::Locations;
use crate::subject::Subject;

/// RMSE of one skin's presses under a given calibration and given settings, over the shared locations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CrossEvaluation {
    /// Letter of the skin that was pressed.
    pub presses: char,
    /// Letter of the skin whose calibration was used.
    pub calibration: char,
    /// Letter of the skin whose settings were used.
    pub settings: char,
    /// In mm; `None` when no press was located.
    pub rmse_mm: Option<f64>,
    /// Presses located, out of those that count under the skin's own calibration.
    pub located: [u32; 2],
}

/// Evaluates each skin as recorded, with the other's calibration, and with the other's settings if these differ.
#[must_use]
pub(crate) fn cross_evaluate(
    a: &Subject,
    b: &Subject,
    reanalysis: Option<Reanalysis<'_>>,
    locations: &Locations,
    shared: &[u32],
) -> Vec<CrossEvaluation> {
    // Stored analyses whose locator cannot be used are analysed again when they are read, so all subjects have theirs.
    let locator = |s: &Subject| FittedLocator::of(&s.sessions.first()?.analysis).ok();
    let (Some(of_a), Some(of_b)) = (locator(a), locator(b)) else {
        return Vec::new();
    };
    let row =
        |presses: &Subject, calibration: &Subject, settings: char, with: Option<&FittedLocator>| {
            let (rmse_mm, located) = rmse(presses, locations, shared, with);
            CrossEvaluation {
                presses: presses.letter,
                calibration: calibration.letter,
                settings,
                rmse_mm,
                located,
            }
        };
    let mut rows = vec![
        row(a, a, a.letter, None),
        row(a, b, a.letter, Some(&of_b)),
        row(b, b, b.letter, None),
        row(b, a, b.letter, Some(&of_a)),
    ];
    if let Some(reanalysis) = reanalysis {
        rows.insert(2, row(reanalysis.first, reanalysis.first, b.letter, None));
        rows.push(row(reanalysis.second, reanalysis.second, a.letter, None));
    }
    rows
}

fn rmse(
    subject: &Subject,
    locations: &Locations,
    shared: &[u32],
    with: Option<&FittedLocator>,
) -> (Option<f64>, [u32; 2]) {
    let (mut sum, mut located, mut all) = (0.0, 0u32, 0u32);
    for attempt in locations
        .attempts(subject)
        .filter(|p| shared.contains(&p.location))
    {
        let Some((x, y)) = attempt.error() else {
            continue;
        };
        all += 1;
        let error = match (with, attempt.press.truth) {
            (None, _) => Some((x, y)),
            (Some(locator), Some(truth)) => {
                let outline = &attempt.session.analysis.rig.outline;
                let (found, _) = locator.outcome(outline, CameraFeatures::of_press(attempt.press));
                found
                    .estimate()
                    .map(|at| (at.x_mm - truth.x_mm, at.y_mm - truth.y_mm))
            }
            (Some(_), None) => None,
        };
        if let Some((x, y)) = error {
            located += 1;
            sum += x * x + y * y;
        }
    }
    let mean = (located > 0).then(|| (sum / f64::from(located)).sqrt());
    (mean, [located, all])
}
