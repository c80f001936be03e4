//! Owns [`Figure`] and the canvas that all figures are drawn on.

use skinrig_model::PressId;

use crate::format::or_missing;
use crate::input::ReportInput;
use crate::svg::{Attributes, Px, Svg, plain_css, polyline};

/// A figure.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Identifier, unique in a page; also the stem of downloaded files.
    pub id: &'static str,
    /// Title, plain text.
    pub title: &'static str,
    /// What the figure shows and how to read it, plain text.
    pub caption: String,
    /// The `<svg>` element, without style (see [`Figure::standalone`]).
    pub svg: String,
    /// Name of the data table behind the figure in the page's script data.
    pub table: &'static str,
    /// Interaction in the page: `select` (presses), `zoom` (time axis) or empty.
    pub interaction: &'static str,
}

impl Figure {
    /// The figure as a stand-alone file, with XML declaration and style.
    #[must_use]
    pub fn standalone(&self) -> String {
        let styled = self.svg.replacen(
            "</title>",
            &format!("</title><style>{}</style>", plain_css()),
            1,
        );
        format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{styled}\n")
    }
}

/// Footer of every figure: session, and `simulated` or `emulated`.
pub(super) fn foot(input: &ReportInput<'_>) -> String {
    let p = &input.provenance;
    let stand_in = p
        .stand_in()
        .map_or_else(String::new, |word| format!(" · {word} rig"));
    let usable = input.analysis.is_valid();
    let invalid = if usable { "" } else { "INVALID · " };
    let variant = p
        .variant
        .as_ref()
        .map_or_else(String::new, |v| format!(" · variant {}", v.name));
    format!(
        "{invalid}session {}{stand_in}{variant}",
        or_missing(&p.session_id)
    )
}

/// A figure under construction.
pub(super) struct Canvas<'a> {
    pub(super) svg: Svg,
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) input: &'a ReportInput<'a>,
    pub(super) size: (f64, f64),
    pub(super) caption: String,
}

impl<'a> Canvas<'a> {
    /// Opens the `<svg>` element with its title and description.
    pub(super) fn new(
        input: &'a ReportInput<'a>,
        id: &'static str,
        title: &'static str,
        caption: String,
        size: (f64, f64),
        extra: Attributes<'_>,
    ) -> Self {
        let mut svg = Svg::new();
        let (title_id, desc_id) = (format!("{id}-title"), format!("{id}-desc"));
        let view = format!("0 0 {} {}", Px(size.0), Px(size.1));
        let labelled = format!("{title_id} {desc_id}");
        let mut attributes: Vec<(&str, &dyn std::fmt::Display)> = vec![
            ("xmlns", &"http://www.w3.org/2000/svg"),
            ("class", &"fig"),
            ("id", &id),
            ("viewBox", &view),
            ("role", &"img"),
            ("aria-labelledby", &labelled),
        ];
        attributes.extend_from_slice(extra);
        svg.open("svg", &attributes);
        svg.holding("title", &[("id", &title_id)], title);
        svg.holding("desc", &[("id", &desc_id)], &caption);
        Self {
            svg,
            id,
            title,
            input,
            size,
            caption,
        }
    }

    /// Writes the reason for an empty figure into its middle.
    pub(super) fn empty(&mut self, why: &str) {
        let (w, h) = self.size;
        self.svg.text((w / 2.0, h / 2.0), "empty", "middle", why);
    }

    /// Writes the footer (session, simulated or not, n) and closes the figure.
    pub(super) fn finish(
        mut self,
        n: &str,
        table: &'static str,
        interaction: &'static str,
    ) -> Figure {
        let foot = foot(self.input);
        let (w, h) = self.size;
        self.svg.text((10.0, h - 8.0), "foot", "start", &foot);
        self.svg.text((w - 10.0, h - 8.0), "foot count", "end", n);
        Figure {
            id: self.id,
            title: self.title,
            caption: self.caption,
            svg: self.svg.finish(),
            table,
            interaction,
        }
    }
}

/// Attribute of an `<svg>` that follows the page's filter.
pub(super) const LINKED: (&str, &dyn std::fmt::Display) = ("data-linked", &"");

/// A path with one segment (`M...`) per press, which the page's filter can hide.
pub(super) fn press_path(svg: &mut Svg, class: &str, data: &str, presses: &[PressId]) {
    if data.is_empty() {
        return;
    }
    let runs = presses.chunk_by(|a, b| a.index() + 1 == b.index());
    let runs = runs.map(|run| match run {
        [one] => one.number().to_string(),
        [first, .., last] => format!("{}-{}", first.number(), last.number()),
        [] => String::new(),
    });
    svg.leaf(
        "path",
        &[
            ("class", &class),
            ("d", &data),
            ("data-presses", &runs.collect::<Vec<_>>().join(" ")),
        ],
    );
}

/// Smallest of 1, 1.5, 2, 3, 4, 5, 6, 8, 10 times a power of ten that is at least `value`.
pub(crate) fn nice_above(value: f64) -> f64 {
    if !(value.is_finite() && value > 0.0) {
        return 1.0;
    }
    let power = 10f64.powf(value.log10().floor());
    [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]
        .into_iter()
        .map(|m| m * power)
        .find(|c| *c >= value * (1.0 - 1e-12))
        .unwrap_or(10.0 * power)
}

/// Path of the area between two lines, from x and the y of both.
pub(super) fn band(points: impl IntoIterator<Item = (f64, (f64, f64))>) -> String {
    let points: Vec<_> = points.into_iter().collect();
    let forth = points.iter().map(|(x, (low, _))| (*x, *low));
    let back = points.iter().rev().map(|(x, (_, high))| (*x, *high));
    polyline(forth.chain(back), true)
}
