//! Owns the shapes of marks: rings, squares, diamonds, bands, and paths with one piece per press.

use skinrig_model::PressId;

use crate::markup::Markup;
use crate::svg::{Px, polyline};

/// A rectangle.
pub(crate) fn rectangle(svg: &mut Markup, class: &str, frame: (f64, f64, f64, f64)) {
    let (x, y, width, height) = frame;
    svg.leaf(
        "rect",
        &[
            ("class", &class),
            ("x", &Px(x)),
            ("y", &Px(y)),
            ("width", &Px(width)),
            ("height", &Px(height)),
        ],
    );
}

/// A circle.
pub(crate) fn circle(svg: &mut Markup, class: &str, (x, y): (f64, f64), radius: f64) {
    svg.leaf(
        "circle",
        &[
            ("class", &class),
            ("cx", &Px(x)),
            ("cy", &Px(y)),
            ("r", &Px(radius)),
        ],
    );
}

/// Mark of a published value: a diamond around `at`.
pub(crate) fn diamond((x, y): (f64, f64)) -> String {
    format!("M{} {}l5 5l-5 5l-5 -5Z", Px(x), Px(y - 5.0))
}

/// Open squares around points.
pub(crate) fn squares(points: impl IntoIterator<Item = (f64, f64)>, side: f64) -> String {
    let half = side / 2.0;
    let square = |(x, y)| format!("M{} {}h{side}v{side}h-{side}Z", Px(x - half), Px(y - half));
    points.into_iter().map(square).collect()
}

/// Path of the area between two lines, from x and the y of both.
pub(crate) fn band(points: impl IntoIterator<Item = (f64, (f64, f64))>) -> String {
    let points: Vec<_> = points.into_iter().collect();
    let forth = points.iter().map(|(x, (low, _))| (*x, *low));
    let back = points.iter().rev().map(|(x, (_, high))| (*x, *high));
    polyline(forth.chain(back), true)
}

/// A path with one segment (`M...`) per press, which the page's filter can hide.
pub(crate) fn press_path(svg: &mut Markup, class: &str, data: &str, presses: &[PressId]) {
    if data.is_empty() {
        return;
    }
    let runs = presses.chunk_by(|a, b| a.index() + 1 == b.index());
    let runs = runs.map(|run| match run {
        [one] => one.number().to_string(),
        [first, .., last] => format!("{}-{}", first.number(), last.number()),
        [] => String::new(),
    });
    let runs = runs.collect::<Vec<_>>().join(" ");
    svg.leaf(
        "path",
        &[("class", &class), ("d", &data), ("data-presses", &runs)],
    );
}
