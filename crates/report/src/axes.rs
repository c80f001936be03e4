//! Owns the axes of figures: linear scales, ticks and labels.

use crate::svg::{Px, Svg};

/// Width of a tick digit, px: 0.6 of the 11 px in figure.css, rounded up.
const DIGIT_PX: f64 = 6.7;
/// Minimum distance from the axis to the middle of its left label, px; enough for four-digit ticks.
const LABEL_PX: f64 = 46.0;

/// About `wanted` tick positions inside `low..=high`, at 1, 2 or 5 times a power of ten; none for 0.
#[must_use]
pub fn ticks(low: f64, high: f64, wanted: u32) -> Vec<f64> {
    let span = high - low;
    if wanted == 0 || !(span.is_finite() && span > 0.0) {
        return vec![];
    }
    let raw = span / f64::from(wanted);
    let power = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * power)
        .find(|s| *s >= raw * 0.999)
        .unwrap_or(10.0 * power);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// Formats a tick with the decimals that the distance `step` between ticks needs.
#[must_use]
pub(crate) fn tick_label(value: f64, step: f64) -> String {
    let digits = if step > 0.0 {
        (-step.log10().floor()).max(0.0) as usize
    } else {
        0
    };
    crate::format::number(Some(value), digits.min(9))
}

/// Linear map from data to pixels along one axis.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    /// Data range; never empty.
    pub data: (f64, f64),
    /// Pixel range; may run backwards.
    pub px: (f64, f64),
}

impl Scale {
    /// Maps `data` onto `px`. Widens an empty or non-finite data range to one unit.
    #[must_use]
    pub fn new(data: (f64, f64), px: (f64, f64)) -> Self {
        let (mut low, mut high) = data;
        if !(low.is_finite() && high.is_finite()) {
            (low, high) = (0.0, 1.0);
        }
        if high <= low {
            high = low + 1.0;
        }
        Self {
            data: (low, high),
            px,
        }
    }

    /// Pixel position of `value`.
    #[must_use]
    pub fn at(&self, value: f64) -> f64 {
        let share = (value - self.data.0) / (self.data.1 - self.data.0);
        self.px.0 + share * (self.px.1 - self.px.0)
    }

    /// Pixels per data unit, positive.
    #[must_use]
    pub(crate) fn per_unit(&self) -> f64 {
        ((self.px.1 - self.px.0) / (self.data.1 - self.data.0)).abs()
    }
}

/// Two scales with labels.
#[derive(Debug, Clone)]
pub struct Axes {
    /// Horizontal.
    pub x: Scale,
    /// Vertical (pixels run downwards).
    pub y: Scale,
    /// Label below, with unit.
    pub x_label: String,
    /// Label at the left, with unit.
    pub y_label: String,
    /// About how many ticks (x, y).
    pub tick_count: (u32, u32),
}

impl Axes {
    /// Draws grid, ticks and labels, ticks at round numbers.
    pub fn draw(&self, svg: &mut Svg) {
        let marks = |scale: Scale, wanted| {
            let at = ticks(scale.data.0, scale.data.1, wanted);
            let step = if at.len() > 1 { at[1] - at[0] } else { 1.0 };
            let labelled = at.into_iter().map(|t| (t, tick_label(t, step)));
            labelled.collect::<Vec<_>>()
        };
        let (xs, ys) = (
            marks(self.x, self.tick_count.0),
            marks(self.y, self.tick_count.1),
        );
        self.draw_with(svg, &xs, &ys);
    }

    /// Draws grid, the given ticks (value and text) and labels.
    pub(crate) fn draw_with(&self, svg: &mut Svg, xs: &[(f64, String)], ys: &[(f64, String)]) {
        let (left, right) = (self.x.px.0.min(self.x.px.1), self.x.px.0.max(self.x.px.1));
        let (top, bottom) = (self.y.px.0.min(self.y.px.1), self.y.px.0.max(self.y.px.1));
        svg.open("g", &[("class", &"axes")]);
        svg.open("g", &[("class", &"x-ticks")]);
        for (t, label) in xs {
            let x = self.x.at(*t);
            svg.line("grid", (x, top), (x, bottom));
            svg.text((x, bottom + 16.0), "tick", "middle", label);
        }
        svg.close();
        for (t, label) in ys {
            let y = self.y.at(*t);
            svg.line("grid", (left, y), (right, y));
            svg.text((left - 7.0, y + 4.0), "tick", "end", label);
        }
        svg.line("axis", (left, bottom), (right, bottom));
        svg.line("axis", (left, top), (left, bottom));
        svg.text(
            ((left + right) / 2.0, bottom + 36.0),
            "label",
            "middle",
            &self.x_label,
        );
        // Left of the widest tick, but inside the drawing.
        let widest = ys.iter().map(|(_, l)| l.chars().count()).max().unwrap_or(0);
        let away = (widest as f64).mul_add(DIGIT_PX, 17.0).max(LABEL_PX);
        let (x, y) = ((left - away).max(left.min(12.0)), (top + bottom) / 2.0);
        svg.holding(
            "text",
            &[
                ("class", &"label"),
                ("text-anchor", &"middle"),
                (
                    "transform",
                    &format_args!("translate({} {}) rotate(-90)", Px(x), Px(y)),
                ),
            ],
            &self.y_label,
        );
        svg.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(0.0, 10.0, 5), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(ticks(-0.3, 0.3, 4), [-0.2, 0.0, 0.2]);
        assert!(ticks(1.0, 1.0, 4).is_empty());
        assert!(ticks(f64::NAN, 1.0, 4).is_empty());
        assert_eq!(tick_label(0.2, 0.2), "0.2");
        assert_eq!(tick_label(20.0, 20.0), "20");
        assert_eq!(tick_label(0.25, 0.05), "0.25");
    }

    #[test]
    fn an_empty_range_still_maps() {
        assert!(Scale::new((2.0, 2.0), (0.0, 10.0)).at(2.0).is_finite());
        assert!(Scale::new((f64::NAN, 2.0), (0.0, 10.0)).at(2.0).is_finite());
    }

    /// Ticks end 7 px beside the axis; the label must clear the widest one by more than half its height.
    #[test]
    fn the_label_at_the_left_stands_clear_of_wide_ticks() {
        let scale = Scale::new((0.0, 1.0), (100.0, 200.0));
        let axes = Axes {
            x: scale,
            y: scale,
            x_label: String::new(),
            y_label: "ev/s".to_owned(),
            tick_count: (0, 0),
        };
        let label_px = |tick: &str| {
            let mut svg = Svg::new();
            axes.draw_with(&mut svg, &[], &[(0.5, tick.to_owned())]);
            let drawn = svg.finish();
            let (_, rest) = drawn.split_once("translate(").unwrap();
            rest.split(' ').next().unwrap().parse::<f64>().unwrap()
        };
        assert_eq!(label_px("2.5"), 54.0);
        assert!(label_px("2.600e5") < 100.0 - 7.0 - 7.0 * 6.6 - 7.0);
    }
}
