//! Draws SVG: shapes, texts, paths, and the style of figures.
//!
//! Why not a plotting crate: figures must follow the page's light and dark theme, so every colour that means "ink", "grid"
//! or "camera 1" is a CSS class (`assets/frame/figure.css`) instead of a fixed value; each figure needs a title, a
//! description and one element per press for scripts; and a page of 2,500 presses must stay small. Plotting crates provide
//! none of this. The remaining work is small: shapes here, axes and plots in `plot`.

use std::fmt::{self, Display, Write};

use crate::markup::Markup;

/// Style of the figures: classes and theme variables, light by default.
pub(crate) const FIGURE_CSS: &str = include_str!("../assets/frame/figure.css");

/// [`FIGURE_CSS`] with every `var(--name)` replaced by its light value, for programs without CSS variables.
#[must_use]
pub(crate) fn plain_css() -> String {
    let mut css = FIGURE_CSS.to_owned();
    let block = FIGURE_CSS.split(['{', '}']).nth(1).unwrap_or("");
    for (name, value) in block.split(';').filter_map(|d| d.split_once(':')) {
        if name.trim().starts_with("--") {
            css = css.replace(&format!("var({})", name.trim()), value.trim());
        }
    }
    css
}

/// Coordinate with two decimals and no trailing zeros; non-finite values become 0 so that the file stays valid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Px(pub f64);

impl Display for Px {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hundredths = (self.0 * 100.0).round();
        if !hundredths.is_finite() || hundredths == 0.0 {
            return f.write_str("0");
        }
        write!(f, "{}", hundredths / 100.0)
    }
}

impl Markup {
    /// Text at (x, y), anchored `start`, `middle` or `end`.
    pub(crate) fn text(
        &mut self,
        at: (f64, f64),
        class: &str,
        anchor: &str,
        text: &str,
    ) -> &mut Self {
        self.holding(
            "text",
            &[
                ("x", &Px(at.0)),
                ("y", &Px(at.1)),
                ("class", &class),
                ("text-anchor", &anchor),
            ],
            text,
        )
    }

    /// Text at (x, y), turned by `degrees`.
    pub(crate) fn turned(
        &mut self,
        at: (f64, f64),
        class: &str,
        anchor: &str,
        degrees: f64,
        text: &str,
    ) -> &mut Self {
        let turn = format!("translate({} {}) rotate({degrees})", Px(at.0), Px(at.1));
        self.holding(
            "text",
            &[
                ("class", &class),
                ("text-anchor", &anchor),
                ("transform", &turn),
            ],
            text,
        )
    }

    /// A straight line.
    pub(crate) fn line(&mut self, class: &str, from: (f64, f64), to: (f64, f64)) -> &mut Self {
        self.leaf(
            "line",
            &[
                ("class", &class),
                ("x1", &Px(from.0)),
                ("y1", &Px(from.1)),
                ("x2", &Px(to.0)),
                ("y2", &Px(to.1)),
            ],
        )
    }

    /// A path with the given data.
    pub(crate) fn path(&mut self, class: &str, data: &str) -> &mut Self {
        if data.is_empty() {
            return self;
        }
        self.leaf("path", &[("class", &class), ("d", &data)])
    }
}

/// Path through the points; `close` returns to the first one. A point that is not finite breaks the path.
pub fn polyline(points: impl IntoIterator<Item = (f64, f64)>, close: bool) -> String {
    let mut d = String::new();
    let mut last: Option<(String, String)> = None;
    // Start of a horizontal piece in `d`, and its direction: longer ones replace it.
    let mut level: Option<(usize, bool)> = None;
    let mut from = f64::NAN;
    for (x, y) in points {
        if !(x.is_finite() && y.is_finite()) {
            (last, level) = (None, None);
            continue;
        }
        let (tx, ty) = (Px(x).to_string(), Px(y).to_string());
        let (command, still) = match &last {
            None => (format!("M{tx} {ty}"), None),
            Some((lx, ly)) if *lx == tx && *ly == ty => continue,
            Some((_, ly)) if *ly == ty => {
                let forwards = x > from;
                let start = level.filter(|l| l.1 == forwards).map_or(d.len(), |l| l.0);
                d.truncate(start);
                (format!("H{tx}"), Some((start, forwards)))
            }
            Some((lx, _)) if *lx == tx => (format!("V{ty}"), None),
            Some(_) => (format!("L{tx} {ty}"), None),
        };
        d += &command;
        (last, level, from) = (Some((tx, ty)), still, x);
    }
    if close && !d.is_empty() {
        d.push('Z');
    }
    d
}

/// Path of dots: zero-length strokes, round with `stroke-linecap: round`. Much smaller than circles.
pub fn dots(points: impl IntoIterator<Item = (f64, f64)>) -> String {
    let mut d = String::new();
    for (x, y) in points {
        let _ = write!(d, "M{} {}h0", Px(x), Px(y));
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_short_and_break_where_a_value_is_missing() {
        let at = |points: &[(f64, f64)]| polyline(points.iter().copied(), false);
        let level = [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (2.0, 3.0), (4.0, 5.0)];
        assert_eq!(at(&level), "M0 1H2V3L4 5");
        assert_eq!(at(&[(0.0, 1.0), (2.0, 1.0), (1.0, 1.0)]), "M0 1H2H1");
        assert_eq!(at(&[(0.0, 1.0), (1.0, f64::NAN), (2.0, 1.0)]), "M0 1M2 1");
    }

    #[test]
    fn plain_css_needs_no_variables() {
        assert!(FIGURE_CSS.contains("var(--ink)"));
        assert!(!plain_css().contains("var("), "{}", plain_css());
    }
}
