//! Owns scales: maps from data to pixels, round ticks and round ends.

/// About `requested` tick positions inside `low..=high`, at 1, 2 or 5 times a power of ten; none for 0.
#[must_use]
pub(crate) fn ticks(low: f64, high: f64, requested: u32) -> Vec<f64> {
    let span = high - low;
    if requested == 0 || !(span.is_finite() && span > 0.0) {
        return vec![];
    }
    let raw = span / f64::from(requested);
    let power = libm::pow(10f64, libm::log10(raw).floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter();
    let step = steps.clone().find(|s| *s >= raw * 0.999);
    let step = step.unwrap_or(10.0 * power);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// Formats a tick with the decimals that the distance `step` between ticks needs.
#[must_use]
pub(crate) fn tick_label(value: f64, step: f64) -> String {
    let digits = if step > 0.0 {
        (-libm::log10(step).floor()).max(0.0) as usize
    } else {
        0
    };
    crate::format::number(Some(value), digits.min(9))
}

/// Smallest of 1, 1.5, 2, 3, 4, 5, 6, 8, 10 times a power of ten that is at least `value`.
pub(crate) fn nice_above(value: f64) -> f64 {
    if !(value.is_finite() && value > 0.0) {
        return 1.0;
    }
    let power = libm::pow(10f64, libm::log10(value).floor());
    [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]
        .into_iter()
        .map(|m| m * power)
        .find(|c| *c >= value * (1.0 - 1e-12))
        .unwrap_or(10.0 * power)
}

/// Lowest and highest finite value; `None` without any.
pub(crate) fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|v| v.is_finite());
    finite.fold(None, |ends, v| {
        let (low, high) = ends.unwrap_or((v, v));
        Some((v.min(low), v.max(high)))
    })
}

/// End of a colour scale: round number above 98 % of the values; `None` without any.
pub(crate) fn scale_end(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(nice_above(values[(0.98 * last as f64).round() as usize]))
}

/// Map from data to pixels along one axis, linear or logarithmic.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    /// Data range; never empty.
    pub(crate) data: (f64, f64),
    /// Pixel range; may run backwards.
    pub(crate) px: (f64, f64),
    is_log: bool,
}

impl Scale {
    /// Maps `data` onto `px`. Widens an empty or non-finite data range to one unit.
    #[must_use]
    pub(crate) fn new(data: (f64, f64), px: (f64, f64)) -> Self {
        let (mut low, mut high) = data;
        if !(low.is_finite() && high.is_finite()) {
            (low, high) = (0.0, 1.0);
        }
        if high <= low {
            high = low + 1.0;
        }
        let data = (low, high);
        Self {
            data,
            px,
            is_log: false,
        }
    }

    /// Maps the logarithm of `data` onto `px`; a range that is not positive becomes one decade.
    #[must_use]
    pub(crate) fn log(data: (f64, f64), px: (f64, f64)) -> Self {
        let good = data.0 > 0.0 && data.1.is_finite() && data.0 < data.1;
        Self {
            data: if good { data } else { (1.0, 10.0) },
            px,
            is_log: true,
        }
    }

    /// Pixel position of `value`. A logarithmic scale draws values that are not positive at its lower end.
    #[must_use]
    pub(crate) fn at(&self, value: f64) -> f64 {
        let (low, high) = self.data;
        let share = if self.is_log {
            libm::log(if value > 0.0 { value } else { low } / low) / libm::log(high / low)
        } else {
            (value - low) / (high - low)
        };
        self.px.0 + share * (self.px.1 - self.px.0)
    }

    /// Pixels per data unit of a linear scale, positive.
    #[must_use]
    pub(crate) fn per_unit(&self) -> f64 {
        ((self.px.1 - self.px.0) / (self.data.1 - self.data.0)).abs()
    }

    /// True for a value inside the range.
    #[must_use]
    pub(crate) fn holds(&self, value: f64) -> bool {
        (self.data.0..=self.data.1).contains(&value)
    }

    /// Range and pixels as the page's script reads them.
    fn attribute(&self) -> String {
        let ((a, b), (c, d)) = (self.data, self.px);
        format!("{a:.6} {b:.6} {c:.4} {d:.4}")
    }
}

/// Position of a plot: both scales.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) x: Scale,
    /// Pixels run downwards.
    pub(crate) y: Scale,
}

impl Place {
    /// Pixel position of a point.
    #[must_use]
    pub(crate) fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.x.at(x), self.y.at(y))
    }

    /// Frame: left, top, width, height, px.
    #[must_use]
    pub(crate) fn frame(&self) -> (f64, f64, f64, f64) {
        let (left, right) = self.x.px;
        let (top, bottom) = (self.y.px.0.min(self.y.px.1), self.y.px.0.max(self.y.px.1));
        (left, top, right - left, bottom - top)
    }

    /// Middle of the frame, px.
    #[must_use]
    pub(crate) fn middle(&self) -> (f64, f64) {
        let (left, top, width, height) = self.frame();
        (left + width / 2.0, top + height / 2.0)
    }

    /// Opens the group of a plot, with its scales for the page's script.
    pub(crate) fn open(&self, svg: &mut crate::markup::Markup) {
        let (x, y) = (self.x.attribute(), self.y.attribute());
        svg.open("g", &[("class", &"plot"), ("data-x", &x), ("data-y", &y)]);
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
        assert!(Scale::log((0.0, 2.0), (0.0, 10.0)).at(2.0).is_finite());
        assert_eq!(extent([f64::NAN, 3.0, -1.0]), Some((-1.0, 3.0)));
        assert_eq!(extent([f64::INFINITY]), None);
    }

    #[test]
    fn a_logarithmic_scale_gives_each_decade_the_same_length() {
        let scale = Scale::log((0.1, 10.0), (0.0, 100.0));
        for (value, px) in [(0.1, 0.0), (1.0, 50.0), (10.0, 100.0)] {
            assert!((scale.at(value) - px).abs() < 1e-9, "{value}");
        }
        assert!(scale.at(0.0).is_finite());
    }
}
