//! Owns the legends of figures: samples with names, in rows or in one line.

use crate::svg::{Px, Svg, dots};

/// Sample of one class of marks in a legend.
#[derive(Debug, Clone, Copy)]
pub(super) enum Sample {
    /// A line with this class.
    Line(&'static str),
    /// A filled area with this class.
    Area(&'static str),
    /// A dot with this class.
    Dot(&'static str),
    /// A published value.
    Published,
}

/// Width of a sample, px.
const WIDTH: f64 = 18.0;

fn sample(svg: &mut Svg, kind: Sample, (x, y): (f64, f64)) {
    match kind {
        Sample::Line(class) => {
            svg.line(class, (x, y), (x + WIDTH, y));
        }
        Sample::Area(class) => {
            svg.leaf(
                "rect",
                &[
                    ("class", &class),
                    ("x", &Px(x)),
                    ("y", &Px(y - 6.0)),
                    ("width", &Px(WIDTH)),
                    ("height", &"12"),
                ],
            );
        }
        Sample::Dot(class) => {
            svg.path(class, &dots([(x + WIDTH / 2.0, y)]));
        }
        Sample::Published => {
            svg.path("published", &diamond((x + WIDTH / 2.0, y)));
        }
    }
}

/// A line of samples starting at `at`, each as wide as its name needs.
pub(super) fn line(svg: &mut Svg, at: (f64, f64), rows: &[(Sample, &str)]) {
    let mut x = at.0;
    for (kind, name) in rows {
        sample(svg, *kind, (x, at.1));
        svg.text((x + WIDTH + 6.0, at.1 + 4.0), "tick", "start", name);
        x += WIDTH + 26.0 + 6.0 * name.chars().count() as f64;
    }
}

/// Mark of a published value: a diamond around `at`.
pub(super) fn diamond((x, y): (f64, f64)) -> String {
    format!("M{} {}l5 5l-5 5l-5 -5Z", Px(x), Px(y - 5.0))
}
