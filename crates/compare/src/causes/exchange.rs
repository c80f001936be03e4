//! Owns the exchange: the presses of each skin with the calibration, and with the settings, of the other.

use serde::Serialize;
use skinrig_analysis::triangulate::locate;
use skinrig_model::StereoGeometry;

use super::factor::Again;
use crate::places::Places;
use crate::subject::Subject;

/// The RMSE of a skin's presses under someone's calibration and settings, over the places that both skins have.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Exchange {
    /// Whose presses.
    pub presses: char,
    /// Whose calibration.
    pub calibration: char,
    /// Whose settings.
    pub settings: char,
    /// mm; `None` when no press is located.
    pub rmse_mm: Option<f64>,
    /// Presses located, of those that count with the skin's own.
    pub located: [u32; 2],
}

/// Each skin as it is, with the other's calibration, and with the other's settings where these differ.
#[must_use]
pub(crate) fn exchange(
    a: &Subject,
    b: &Subject,
    again: Option<Again<'_>>,
    places: &Places,
    shared: &[u32],
) -> Vec<Exchange> {
    let geometry = |s: &Subject| s.sessions.first().map(|s| s.analysis.geometry);
    let (Some(of_a), Some(of_b)) = (geometry(a), geometry(b)) else {
        return Vec::new();
    };
    let row =
        |presses: &Subject, calibration: &Subject, settings: char, with: Option<StereoGeometry>| {
            let (rmse_mm, located) = rmse(presses, places, shared, with);
            Exchange {
                presses: presses.letter,
                calibration: calibration.letter,
                settings,
                rmse_mm,
                located,
            }
        };
    let mut rows = vec![
        row(a, a, a.letter, None),
        row(a, b, a.letter, Some(of_b)),
        row(b, b, b.letter, None),
        row(b, a, b.letter, Some(of_a)),
    ];
    if let Some(again) = again {
        rows.insert(2, row(again.first, again.first, b.letter, None));
        rows.push(row(again.second, again.second, a.letter, None));
    }
    rows
}

fn rmse(
    subject: &Subject,
    places: &Places,
    shared: &[u32],
    with: Option<StereoGeometry>,
) -> (Option<f64>, [u32; 2]) {
    let (mut sum, mut located, mut all) = (0.0, 0u32, 0u32);
    for attempt in places
        .attempts(subject)
        .filter(|p| shared.contains(&p.place))
    {
        let Some((x, y)) = attempt.error() else {
            continue;
        };
        all += 1;
        let error = match (with, attempt.press.truth) {
            (None, _) => Some((x, y)),
            (Some(geometry), Some(truth)) => {
                let column = |k: usize| attempt.press.views[k].and_then(|v| v.centroid_u);
                let outline = &attempt.session.analysis.rig.outline;
                let found = locate(&geometry, outline, [column(0), column(1)]).estimate();
                found.map(|at| (at.x_mm - truth.x_mm, at.y_mm - truth.y_mm))
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
