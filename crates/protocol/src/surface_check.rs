//! Where a run touches the surface to see that it still lies where the frame says, before it presses anything.

use serde::{Deserialize, Serialize};
use skinrig_model::Point2;

use crate::keys::{POINT_ITEM, default, required};
use crate::shape::{Field, Key, Keys, Range, Shape, Table, Word};
use crate::surface::{Surface, TouchSearch};
use skinrig_settings::Collector;
use skinrig_settings::Dimension::Length;

/// The check of the surface. A touch farther than the tolerance from z = 0 of the frame ends the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfaceCheck {
    /// Where to touch, skin frame, in order; at least one.
    pub points: Vec<Point2>,
    /// Largest distance of the touched surface from z = 0, mm.
    pub tolerance_mm: f64,
    /// Also at the end of each repetition, not only before the first press.
    pub each_repetition: bool,
    /// How a touch is found.
    pub search: TouchSearch,
}

/// The keys of `surface_check`.
pub(crate) static SURFACE_CHECK: Table = Table {
    name: "surface_check",
    doc: "Touches the skin before the first press: a surface that is not where the frame says ends the run. Needs a robot that reports force.",
    keys: KEYS,
    exactly_one: &[],
};

const KEYS: &[Key] = &[
    required(
        "points",
        Shape::List {
            of: &POINT_ITEM,
            min: 1,
            max: 100,
        },
        "Where to touch, skin frame. Touched as `press` says, with its defaults when it says `known` or nothing.",
    ),
    default(
        "tolerance",
        Shape::Quantity(&[Length], Range::above_zero(10.0)),
        "0.3 mm",
        "Largest distance of the touched surface from z = 0. A touch on a soft skin lies about threshold / stiffness below its surface.",
    ),
    default("at", Shape::Choice(WHEN), "start", "When to touch."),
];

const WHEN: &[Word] = &[
    ("start", "before the first press"),
    (
        "each_repetition",
        "before the first press and at the end of each repetition",
    ),
];

/// Reads a mapping of the table `surface_check`; `press` says how to touch.
pub(crate) fn surface_check(
    f: &Field,
    press: Option<&Surface>,
    out: &mut Collector,
) -> Option<SurfaceCheck> {
    let search = match press {
        Some(Surface::Touch(search)) => *search,
        _ => TouchSearch::default(),
    };
    let tolerance_mm = f.quantity("tolerance")?;
    if tolerance_mm >= search.band_mm {
        out.error(
            f.get("tolerance")?.span,
            "surface_check.tolerance",
            "a surface beyond the tolerance would not be found",
        )
        .expected(format!(
            "less than {} mm, the band in which the surface is searched (`press.band`)",
            search.band_mm
        ))
        .found(format!("{tolerance_mm} mm"));
        return None;
    }
    let points = f.get("points")?.items().iter().map(|p| {
        let [x, y] = p.pair()?;
        Some(Point2::new(x, y))
    });
    Some(SurfaceCheck {
        points: points.collect::<Option<_>>()?,
        tolerance_mm,
        each_repetition: f.word("at")? == "each_repetition",
        search,
    })
}
