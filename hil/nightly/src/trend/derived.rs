//! Ratios of two metrics of the same night. Influences on both metrics (lamp, temperature, age of
//! the skin) cancel.

use super::history::{History, Point, Series};
use crate::verdict::Verdict;

/// Unit of a ratio.
pub(crate) const RATIO: &str = "ratio";

/// A charted ratio.
#[derive(Debug, Clone, Copy)]
pub struct Ratio {
    /// Series name: `derived/subject/metric`.
    pub name: &'static str,
    /// Series of the numerator.
    pub numerator: &'static str,
    /// Series of the denominator.
    pub denominator: &'static str,
    /// Which influences cancel, and which changes move the ratio.
    pub rationale: &'static str,
}

/// The ratios; each is charted if both of its series exist.
pub const RATIOS: &[Ratio] = &[
    Ratio {
        name: "derived/skin/press_over_idle",
        numerator: "golden/skin/press_events",
        denominator: "golden/skin/idle_events",
        rationale: "a weaker lamp lowers both; a less sensitive skin or a noisier sensor moves the ratio",
    },
    Ratio {
        name: "derived/skin/rmse_over_repeat_std",
        numerator: "golden/skin/rmse",
        denominator: "golden/skin/repeat_std",
        rationale: "noise raises both; a shifted skin or frame moves the error alone",
    },
    Ratio {
        name: "derived/skin/rmse_over_reference_shift",
        numerator: "golden/skin/rmse",
        denominator: "golden/skin/reference_shift",
        rationale: "error of the campaign relative to the shift of its own reference presses",
    },
    Ratio {
        name: "derived/cameras/noise_dark",
        numerator: "noise_dark/camera1/rate",
        denominator: "noise_dark/camera2/rate",
        rationale: "a warm night raises both cameras; a change of one camera moves the ratio",
    },
    Ratio {
        name: "derived/cameras/noise_lit",
        numerator: "noise_lit/camera1/rate",
        denominator: "noise_lit/camera2/rate",
        rationale: "lamp and temperature move both cameras; a change of one camera or its lens moves the ratio",
    },
    Ratio {
        name: "derived/cameras/data_rate",
        numerator: "idle/camera1/data_rate",
        denominator: "idle/camera2/data_rate",
        rationale: "the room moves both cameras; a change of one camera moves the ratio",
    },
    Ratio {
        name: "derived/cameras/jitter",
        numerator: "trigger_loopback/camera1/jitter",
        denominator: "trigger_loopback/camera2/jitter",
        rationale: "the trigger box moves both cameras; a change of one cable or camera moves the ratio",
    },
];

/// The ratios of `history` as series. A night has a value when both metrics are usable and the denominator is positive.
#[must_use]
pub fn ratios(history: &History) -> Vec<Series> {
    let find = |name| history.series.iter().find(|s| s.name == name);
    let both = |r: &Ratio| Some((*r, find(r.numerator)?, find(r.denominator)?));
    RATIOS
        .iter()
        .filter_map(both)
        .map(|(ratio, over, under)| Series {
            name: ratio.name.to_owned(),
            unit: RATIO.to_owned(),
            points: over.points.iter().filter_map(|p| point(p, under)).collect(),
        })
        .filter(|series| !series.points.is_empty())
        .collect()
}

fn point(over: &Point, under: &Series) -> Option<Point> {
    let at = under.points.binary_search_by_key(&over.night, |p| p.night);
    let below = under.points[at.ok()?].usable().filter(|v| *v > 0.0)?;
    Some(Point {
        night: over.night,
        value: Some(over.usable()? / below),
        interval: None,
        n: None,
        limit: None,
        verdict: Verdict::Pass,
        part: Verdict::Pass,
        attempts: over.attempts,
    })
}
