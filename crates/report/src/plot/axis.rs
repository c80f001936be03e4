//! Owns axes: range, label and ticks, and their drawing around a plot.

use super::scale::{Place, Scale, extent, nice_above, tick_label, ticks};
use crate::markup::Markup;
use crate::svg::Px;

/// Width of a tick digit, px: 0.6 of the 11 px in figure.css, rounded up.
const DIGIT_PX: f64 = 6.7;
/// Minimum distance from the axis to the middle of its left label, px; enough for four-digit ticks.
const LABEL_PX: f64 = 46.0;
/// A logarithmic axis over more decades than this has ticks at powers of ten only.
const MAX_DENSE_DECADES: f64 = 3.0;

#[derive(Debug, Clone)]
enum Ticks {
    /// About this many at round numbers.
    About(u32),
    Decades,
    Named(Vec<(f64, String)>),
}

/// An axis: range, label with unit, ticks.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    range: (f64, f64),
    label: String,
    ticks: Ticks,
    is_log: bool,
    is_downwards: bool,
}

/// Texts of the left axis of a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LeftTexts {
    Shown,
    /// Shown on a phone, where the plot starts a row.
    OnPhone,
    /// The neighbour has them.
    None,
}

impl Axis {
    /// A linear axis with about five ticks.
    pub(crate) fn linear(range: (f64, f64), label: impl Into<String>) -> Self {
        Self {
            range,
            label: label.into(),
            ticks: Ticks::About(5),
            is_log: false,
            is_downwards: false,
        }
    }

    /// From zero to a round number above all `values`.
    pub(crate) fn from_zero(
        values: impl IntoIterator<Item = f64>,
        label: impl Into<String>,
    ) -> Self {
        let high = extent(values).map_or(0.0, |e| e.1);
        Self::linear((0.0, nice_above(high)), label)
    }

    /// A logarithmic axis over a positive range.
    pub(crate) fn log(range: (f64, f64), label: impl Into<String>) -> Self {
        Self {
            ticks: Ticks::Decades,
            is_log: true,
            ..Self::linear(range, label)
        }
    }

    /// One place per name, at 0, 1, 2, ...
    pub(crate) fn categories(
        names: impl IntoIterator<Item = String>,
        label: impl Into<String>,
    ) -> Self {
        let names: Vec<(f64, String)> = (0..).map(f64::from).zip(names).collect();
        let range = (-0.5, names.len() as f64 - 0.5);
        Self::linear(range, label).marked(names)
    }

    /// About this many ticks.
    pub(crate) fn ticks(self, requested: u32) -> Self {
        Self {
            ticks: Ticks::About(requested),
            ..self
        }
    }

    /// Ticks at these values with these texts.
    pub(crate) fn marked(self, ticks: Vec<(f64, String)>) -> Self {
        Self {
            ticks: Ticks::Named(ticks),
            ..self
        }
    }

    /// Grows downwards, as the rows of a sensor.
    pub(crate) fn downwards(self) -> Self {
        Self {
            is_downwards: true,
            ..self
        }
    }

    fn has_label(&self) -> bool {
        !self.label.is_empty()
    }

    /// Height of texts below the axis, px.
    pub(super) fn foot(&self) -> f64 {
        let is_double = |t: &(f64, String)| t.1.contains('\n');
        match &self.ticks {
            _ if self.has_label() => 46.0,
            Ticks::Named(marks) if marks.iter().any(is_double) => 40.0,
            _ => 26.0,
        }
    }

    /// Maps the range onto these pixels.
    pub(crate) fn scale(&self, px: (f64, f64)) -> Scale {
        let px = if self.is_downwards { (px.1, px.0) } else { px };
        if self.is_log {
            Scale::log(self.range, px)
        } else {
            Scale::new(self.range, px)
        }
    }

    fn marks(&self, scale: Scale) -> Vec<(f64, String)> {
        let (low, high) = scale.data;
        match &self.ticks {
            Ticks::Named(marks) => marks.clone(),
            Ticks::Decades => decades(low, high),
            Ticks::About(requested) => {
                let at = ticks(low, high, *requested);
                let step = if at.len() > 1 { at[1] - at[0] } else { 1.0 };
                at.iter().map(|t| (*t, tick_label(*t, step))).collect()
            }
        }
    }
}

/// Ticks of a logarithmic axis: 1, 2 and 5 of each power of ten, or only the powers.
fn decades(low: f64, high: f64) -> Vec<(f64, String)> {
    let wide = libm::log10(high / low) > MAX_DENSE_DECADES;
    let powers = libm::log10(low).floor() as i32..=libm::log10(high).ceil() as i32;
    let factors: &[f64] = if wide { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let all = powers.flat_map(|p| factors.iter().map(move |f| f * 10f64.powi(p)));
    all.filter(|t| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(t))
        .map(|t| (t, tick_label(t, t.min(1.0))))
        .collect()
}

/// Draws grid, ticks and labels around a plot.
pub(crate) fn draw(svg: &mut Markup, place: &Place, (x, y): (&Axis, &Axis), left_texts: LeftTexts) {
    let (left, top, width, height) = place.frame();
    let (right, bottom) = (left + width, top + height);
    let (xs, ys) = (x.marks(place.x), y.marks(place.y));
    svg.open("g", &[("class", &"axes")]);
    svg.open("g", &[("class", &"x-ticks")]);
    for (t, label) in &xs {
        let at = place.x.at(*t);
        svg.line("grid", (at, top), (at, bottom));
        for (i, line) in label.split('\n').enumerate() {
            let dy = format!("{}em", Px(0.95 + 1.27 * i as f64));
            below(svg, (at, bottom + 5.5), "tick", &dy, line);
        }
    }
    svg.close();
    for (t, _) in &ys {
        let at = place.y.at(*t);
        svg.line("grid", (left, at), (right, at));
    }
    svg.line("axis", (left, bottom), (right, bottom));
    svg.line("axis", (left, top), (left, bottom));
    if x.has_label() {
        let middle = f64::midpoint(left, right);
        below(svg, (middle, bottom + 5.0), "label", "2.5em", &x.label);
    }
    if left_texts != LeftTexts::None {
        let class = if left_texts == LeftTexts::Shown {
            "y-ticks"
        } else {
            "on-phone"
        };
        svg.open("g", &[("class", &class)]);
        left_side(svg, place, y, &ys);
        svg.close();
    }
    svg.close();
}

/// Text whose distance from `at` grows with its size.
fn below(svg: &mut Markup, (x, y): (f64, f64), class: &str, dy: &str, text: &str) {
    let anchor: &str = "middle";
    svg.holding(
        "text",
        &[
            ("x", &Px(x)),
            ("y", &Px(y)),
            ("dy", &dy),
            ("class", &class),
            ("text-anchor", &anchor),
        ],
        text,
    );
}

fn left_side(svg: &mut Markup, place: &Place, y: &Axis, ticks: &[(f64, String)]) {
    let (left, top, _, height) = place.frame();
    for (t, label) in ticks {
        svg.text((left - 7.0, place.y.at(*t) + 4.0), "tick", "end", label);
    }
    if y.has_label() {
        // Left of the widest tick, but inside the drawing.
        let widest = ticks
            .iter()
            .map(|(_, l)| l.chars().count())
            .max()
            .unwrap_or(0);
        let away = (widest as f64).mul_add(DIGIT_PX, 17.0).max(LABEL_PX);
        let x = (left - away).max(left.min(14.0));
        svg.turned((x, top + height / 2.0), "label", "middle", -90.0, &y.label);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks end 7 px beside the axis; the label must clear the widest one by more than half its height.
    #[test]
    fn the_label_at_the_left_stands_clear_of_wide_ticks() {
        let label_px = |tick: &str| {
            let x = Axis::linear((0.0, 1.0), "").ticks(0);
            let y = Axis::linear((0.0, 1.0), "ev/s").marked(vec![(0.5, tick.to_owned())]);
            let place = Place {
                x: x.scale((100.0, 200.0)),
                y: y.scale((200.0, 100.0)),
            };
            let mut svg = Markup::new();
            draw(&mut svg, &place, (&x, &y), LeftTexts::Shown);
            let drawn = svg.finish();
            let (_, rest) = drawn.split_once("translate(").unwrap();
            rest.split(' ').next().unwrap().parse::<f64>().unwrap()
        };
        assert_eq!(label_px("2.5"), 54.0);
        assert!(label_px("2.600e5") < 100.0 - 7.0 - 7.0 * 6.6 - 7.0);
    }

    #[test]
    fn logarithmic_ticks_thin_out_over_many_decades() {
        let names = |low, high| {
            decades(low, high)
                .into_iter()
                .map(|t| t.1)
                .collect::<Vec<_>>()
        };
        assert_eq!(names(0.5, 20.0), ["0.5", "1", "2", "5", "10", "20"]);
        assert_eq!(names(0.01, 100.0), ["0.01", "0.1", "1", "10", "100"]);
    }
}
