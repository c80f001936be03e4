//! Writes SVG: elements with escaped attributes and text.
//!
//! Why not a plotting crate: figures must follow the page's light and dark theme, so every colour that means "ink", "grid"
//! or "camera 1" is a CSS class (`assets/frame/figure.css`) instead of a fixed value; each figure needs a title, a
//! description and one element per press for scripts; and a page of 2,500 presses must stay small. Plotting crates provide
//! none of this. The remaining work is small: elements here, axes and plots in `plot`.

use std::fmt::{self, Display, Write};

use skinrig_model::text::visible;

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

/// Writes text with the five XML specials escaped, control characters spelled out, and non-characters replaced.
struct Escaping<'a>(&'a mut String);

impl Write for Escaping<'_> {
    fn write_str(&mut self, s: &str) -> fmt::Result {
        for c in visible(s).chars() {
            match c {
                '&' => self.0.push_str("&amp;"),
                '<' => self.0.push_str("&lt;"),
                '>' => self.0.push_str("&gt;"),
                '"' => self.0.push_str("&quot;"),
                '\'' => self.0.push_str("&#39;"),
                '\n' | '\t' => self.0.push(c),
                '\u{fffe}' | '\u{ffff}' => {
                    self.0.push(char::REPLACEMENT_CHARACTER);
                }
                c => self.0.push(c),
            }
        }
        Ok(())
    }
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

/// Attributes: name and value. Values are escaped.
pub(crate) type Attributes<'a> = &'a [(&'a str, &'a dyn Display)];

/// An SVG document or fragment under construction.
#[derive(Debug, Default)]
pub struct Svg {
    out: String,
    open: Vec<&'static str>,
}

impl Svg {
    /// An empty document.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    fn start(&mut self, tag: &str, attributes: Attributes<'_>) {
        self.out.push('<');
        self.out.push_str(tag);
        for (name, value) in attributes {
            self.out.push(' ');
            self.out.push_str(name);
            self.out.push_str("=\"");
            // Writing to a String cannot fail.
            let _ = write!(Escaping(&mut self.out), "{value}");
            self.out.push('"');
        }
    }

    /// Opens an element.
    pub fn open(&mut self, tag: &'static str, attributes: Attributes<'_>) -> &mut Self {
        self.start(tag, attributes);
        self.out.push('>');
        self.open.push(tag);
        self
    }

    /// Closes the innermost open element, if any.
    pub fn close(&mut self) -> &mut Self {
        if let Some(tag) = self.open.pop() {
            let _ = write!(self.out, "</{tag}>");
        }
        self
    }

    /// An element without content.
    pub fn leaf(&mut self, tag: &str, attributes: Attributes<'_>) -> &mut Self {
        self.start(tag, attributes);
        self.out.push_str("/>");
        self
    }

    /// An element that contains only text.
    pub fn holding(&mut self, tag: &str, attributes: Attributes<'_>, text: &str) -> &mut Self {
        self.start(tag, attributes);
        self.out.push('>');
        let _ = Escaping(&mut self.out).write_str(text);
        let _ = write!(self.out, "</{tag}>");
        self
    }

    /// Text at (x, y), anchored `start`, `middle` or `end`.
    pub fn text(&mut self, at: (f64, f64), class: &str, anchor: &str, text: &str) -> &mut Self {
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
    pub fn turned(
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
    pub fn line(&mut self, class: &str, from: (f64, f64), to: (f64, f64)) -> &mut Self {
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
    pub fn path(&mut self, class: &str, data: &str) -> &mut Self {
        if data.is_empty() {
            return self;
        }
        self.leaf("path", &[("class", &class), ("d", &data)])
    }

    /// Closes all open elements and returns the text.
    #[must_use]
    pub fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.out
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
    fn specials_are_escaped_in_attributes_and_text() {
        let mut svg = Svg::new();
        svg.open("g", &[("data-x", &"\"><script>&'")]);
        svg.text((1.0, f64::NAN), "a", "start", "</text><img onerror=x>\u{0}");
        assert_eq!(
            svg.finish(),
            "<g data-x=\"&quot;&gt;&lt;script&gt;&amp;&#39;\"><text x=\"1\" y=\"0\" class=\"a\" \
             text-anchor=\"start\">&lt;/text&gt;&lt;img onerror=x&gt;\\u{0}</text></g>"
        );
    }

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
