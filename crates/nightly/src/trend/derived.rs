//! Ratios of values of one night: what moves both alike, as the lamp, the temperature and the age of the skin do, leaves them alone.

use super::history::{History, Point, Series};
use crate::verdict::Verdict;

/// Unit of a ratio.
pub(crate) const RATIO: &str = "ratio";

/// A ratio that is charted.
#[derive(Debug, Clone, Copy)]
pub struct Ratio {
    /// Its name: `derived/subject/metric`.
    pub name: &'static str,
    /// The series above the line.
    pub over: &'static str,
    /// The series below it.
    pub under: &'static str,
    /// What leaves it alone, and what it shows.
    pub why: &'static str,
}

/// The ratios that are charted where both of their series are there.
pub const RATIOS: &[Ratio] = &[
    Ratio {
        name: "derived/skin/press_over_idle",
        over: "golden/skin/press_events",
        under: "golden/skin/idle_events",
        why: "a weaker lamp lowers both; a skin that gives less, or a sensor that makes more of its own, moves it",
    },
    Ratio {
        name: "derived/skin/rmse_over_repeat_std",
        over: "golden/skin/rmse",
        under: "golden/skin/repeat_std",
        why: "noise raises both; a skin or a frame that shifted moves the error alone",
    },
    Ratio {
        name: "derived/skin/rmse_over_reference_shift",
        over: "golden/skin/rmse",
        under: "golden/skin/reference_shift",
        why: "the error of the campaign against what its own reference presses did meanwhile",
    },
    Ratio {
        name: "derived/cameras/noise_dark",
        over: "noise_dark/camera1/rate",
        under: "noise_dark/camera2/rate",
        why: "a warm night raises both cameras; one camera that changed moves it",
    },
    Ratio {
        name: "derived/cameras/noise_lit",
        over: "noise_lit/camera1/rate",
        under: "noise_lit/camera2/rate",
        why: "the lamp and a warm night move both cameras; one camera or its lens moves it",
    },
    Ratio {
        name: "derived/cameras/data_rate",
        over: "idle/camera1/data_rate",
        under: "idle/camera2/data_rate",
        why: "the room moves both cameras; one camera moves it",
    },
    Ratio {
        name: "derived/cameras/jitter",
        over: "trigger_loopback/camera1/jitter",
        under: "trigger_loopback/camera2/jitter",
        why: "the trigger box moves both cameras; one cable or camera moves it",
    },
];

/// The ratios of `history`, as series of their own. A night has one when both values speak and the lower one is above zero.
#[must_use]
pub fn ratios(history: &History) -> Vec<Series> {
    let find = |name| history.series.iter().find(|s| s.name == name);
    let both = |r: &Ratio| Some((*r, find(r.over)?, find(r.under)?));
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
