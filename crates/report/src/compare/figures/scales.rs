//! Owns the colour scales of the maps. Errors and differences have the same number of px per mm.

use crate::colour::{diverging, viridis};
use crate::markup::Markup;
use crate::plot::{Sample, Scale, colour_bar, column};

/// Height of everything below the axes of the maps, px.
pub(super) const HEIGHT: f64 = 96.0;

const LEGEND: [(Sample, &str); 3] = [
    (
        Sample::Path("better", "M-6 -5h12l-6 9Z"),
        "errs less, interval excludes zero",
    ),
    (
        Sample::Path("worse", "M-6 4h12l-6 -9Z"),
        "errs more, interval excludes zero",
    ),
    (
        Sample::Path("cross", "M-4 -4l8 8m0 -8l-8 8"),
        "cross: attempted, never located",
    ),
];

/// Scale of the errors up to `end` mm, below the map that starts at `(left, y)`. Half as long as the scale of differences.
pub(super) fn errors(svg: &mut Markup, (left, y): (f64, f64), width: f64, end: f64) {
    let scale = Scale::new((0.0, end), (left, left + width / 2.0));
    colour_bar(svg, scale, (y, y + 13.0), false, viridis, None);
    svg.text((left, y + 50.0), "label", "start", "mean error (mm)");
}

/// Scale of the differences.
pub(super) fn differences(
    svg: &mut Markup,
    (left, y): (f64, f64),
    width: f64,
    end: f64,
    letter: char,
) {
    let scale = Scale::new((-end, end), (left, left + width));
    colour_bar(
        svg,
        scale,
        (y, y + 13.0),
        false,
        |share| diverging(2.0 * share - 1.0),
        None,
    );
    svg.text(
        (left, y + 50.0),
        "label",
        "start",
        &format!("{letter} - A (mm)"),
    );
    for (x, anchor, how) in [(left, "start", "less"), (left + width, "end", "more")] {
        svg.text(
            (x, y - 6.0),
            "tick",
            anchor,
            &format!("{letter} errs {how}"),
        );
    }
}

/// Meaning of the marks.
pub(super) fn marks(svg: &mut Markup, (left, y): (f64, f64)) {
    column(svg, (left, y + 4.0), &LEGEND);
}
