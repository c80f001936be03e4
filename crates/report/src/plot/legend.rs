//! Owns legends: samples with names, and colour bars.

use super::path::{circle, diamond, rectangle};
use super::scale::{Scale, tick_label, ticks};
use crate::markup::Markup;
use crate::svg::{Px, dots};

/// Sample of one class of marks in a legend.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Sample {
    /// A line with this class.
    Line(&'static str),
    /// A filled area with this class.
    Area(&'static str),
    /// A dot with this class.
    Dot(&'static str),
    /// A path around (0, 0) with this class.
    Path(&'static str, &'static str),
    /// A ring.
    Ring(&'static str),
    /// A published value.
    Published,
}

/// Width of a sample, px.
const WIDTH: f64 = 18.0;

/// Width of a sample with its name, px.
pub(crate) fn width(name: &str) -> f64 {
    WIDTH + 26.0 + 6.0 * name.chars().count() as f64
}

/// Draws a sample with its name at `(x, y)`: its left end, vertical middle.
pub(crate) fn entry(svg: &mut Markup, (x, y): (f64, f64), sample: Sample, name: &str) {
    let middle = (x + WIDTH / 2.0, y);
    match sample {
        Sample::Line(class) => {
            svg.line(class, (x, y), (x + WIDTH, y));
        }
        Sample::Area(class) => rectangle(svg, class, (x, y - 6.0, WIDTH, 12.0)),
        Sample::Dot(class) => {
            svg.path(class, &dots([middle]));
        }
        Sample::Path(class, data) => {
            let to = format!("translate({} {})", Px(middle.0), Px(y));
            svg.leaf(
                "path",
                &[("class", &class), ("d", &data), ("transform", &to)],
            );
        }
        Sample::Ring(class) => circle(svg, class, middle, 7.0),
        Sample::Published => {
            svg.path("published", &diamond(middle));
        }
    }
    svg.text((x + WIDTH + 6.0, y + 4.0), "tick", "start", name);
}

/// Draws a column of samples from `(x, y)` downwards.
pub(crate) fn column(svg: &mut Markup, (x, y): (f64, f64), entries: &[(Sample, &str)]) {
    for (i, (sample, name)) in entries.iter().enumerate() {
        entry(svg, (x, y + 21.0 * i as f64), *sample, name);
    }
}

/// Draws a colour bar with ticks: upright from (x, top) or lying, as long as `scale` runs.
pub(crate) fn colour_bar(
    svg: &mut Markup,
    scale: Scale,
    across: (f64, f64),
    is_upright: bool,
    colour: impl Fn(f64) -> String,
    marks: Option<Vec<(f64, String)>>,
) {
    const STEPS: u32 = 48;
    let step = (scale.px.1 - scale.px.0) / f64::from(STEPS);
    let (near, far) = across;
    for i in 0..STEPS {
        let share = (f64::from(i) + 0.5) / f64::from(STEPS);
        let (a, b) = (
            scale.px.0 + step * f64::from(i),
            scale.px.0 + step * f64::from(i + 1),
        );
        let (from, long) = (a.min(b), step.abs() + 0.4);
        let (x, y, width, height) = if is_upright {
            (near, from, far - near, long)
        } else {
            (from, near, long, far - near)
        };
        svg.leaf(
            "rect",
            &[
                ("x", &Px(x)),
                ("y", &Px(y)),
                ("width", &Px(width)),
                ("height", &Px(height)),
                ("fill", &colour(share)),
            ],
        );
    }
    let marks = marks.unwrap_or_else(|| {
        let requested = if scale.data.0 < 0.0 || is_upright {
            5
        } else {
            3
        };
        let at = ticks(scale.data.0, scale.data.1, requested);
        let step = if at.len() > 1 {
            at[1] - at[0]
        } else {
            scale.data.1
        };
        at.into_iter().map(|t| (t, tick_label(t, step))).collect()
    });
    for (t, text) in marks {
        let at = scale.at(t);
        if is_upright {
            svg.line("axis", (far, at), (far + 4.0, at));
            svg.text((far + 8.0, at + 4.0), "tick", "start", &text);
        } else {
            svg.line("axis", (at, far), (at, far + 5.0));
            svg.text((at, far + 17.0), "tick", "middle", &text);
        }
    }
}
