//! Owns the figures: one function each, from an analysis to a labelled SVG with title and description.

mod activity;
mod centroids;
mod clocks;
mod correlation;
mod errors;
mod latency_course;
mod latency_onsets;
mod latency_roc;
mod legend;
mod map;
mod models;
mod motion;
mod pictures;
mod raster;
mod rates;
mod reduction;
mod residuals;
mod skin;
mod threshold;
pub(crate) mod tradeoff;

pub use activity::activity;
pub use centroids::centroid_tracks;
pub use clocks::clock_residuals;
pub use correlation::correlation;
pub use errors::{error_distribution, error_scatter};
pub use latency_course::latency_course;
pub use latency_onsets::latency_onsets;
pub use latency_roc::latency_roc;
pub use map::{repeat_map, skin_map};
pub(crate) use models::model_name;
pub use models::models;
pub use motion::{pose_course, pose_presses};
pub use pictures::press_pictures;
pub use rates::{event_rates, press_rates};
pub use reduction::reduction;
pub use residuals::residuals;
pub use threshold::threshold;

use skinrig_model::PressId;

use crate::ReportInput;
use crate::format::or_missing;
use crate::svg::{Attributes, Px, Svg, plain_css, polyline};

/// A figure.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Identifier, unique in a page; also the stem of downloaded files.
    pub id: &'static str,
    /// Headline, plain text.
    pub title: &'static str,
    /// What is drawn and how to read it, plain text.
    pub caption: String,
    /// The `<svg>` element, without style (see [`Figure::standalone`]).
    pub svg: String,
    /// Name of the data table behind the figure in the page's script data.
    pub table: &'static str,
    /// What the figure lets its reader do: `select` (presses), `zoom` (time axis) or nothing.
    pub interaction: &'static str,
}

impl Figure {
    /// The figure as a file of its own: with XML declaration and style.
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

/// All figures in the order of the page. Figures without any data are left out where they are optional.
#[must_use]
pub fn all(input: &ReportInput<'_>) -> Vec<Figure> {
    let mut figures = vec![
        skin_map(input),
        event_rates(input),
        error_distribution(input),
        error_scatter(input),
        centroid_tracks(input),
        repeat_map(input),
    ];
    let optional = [
        press_rates,
        press_pictures,
        activity,
        models,
        correlation,
        residuals,
        threshold,
        reduction,
        latency_course,
        latency_roc,
        latency_onsets,
        clock_residuals,
        pose_course,
        pose_presses,
        speed_accuracy,
    ];
    figures.extend(optional.into_iter().filter_map(|draw| draw(input)));
    figures
}

/// Error against cost, when a tradeoff was measured on the session.
#[must_use]
pub fn speed_accuracy(input: &ReportInput<'_>) -> Option<Figure> {
    let result = input.tradeoff.as_ref()?.as_ref().ok()?;
    let rig = "CPU times are those of the machine that measured them.";
    Some(tradeoff::fronts(result, rig, &foot(input)))
}

/// Session, and what stands in for hardware: the foot line of every figure.
fn foot(input: &ReportInput<'_>) -> String {
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

/// A figure being drawn.
struct Canvas<'a> {
    svg: Svg,
    id: &'static str,
    title: &'static str,
    input: &'a ReportInput<'a>,
    size: (f64, f64),
    caption: String,
}

impl<'a> Canvas<'a> {
    /// Opens the `<svg>` element with its title and description.
    fn new(
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

    /// Says in the middle of the figure why it is empty.
    fn empty(&mut self, why: &str) {
        let (w, h) = self.size;
        self.svg.text((w / 2.0, h / 2.0), "empty", "middle", why);
    }

    /// Writes the foot line (session, simulated or not, n) and closes.
    fn finish(mut self, n: &str, table: &'static str, interaction: &'static str) -> Figure {
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

/// Attribute of an `<svg>` whose drawing follows the page's filter.
const LINKED: (&str, &dyn std::fmt::Display) = ("data-linked", &"");

/// A path with one piece (`M...`) for each of these presses, which the page's filter can take out.
fn press_path(svg: &mut Svg, class: &str, data: &str, presses: &[PressId]) {
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

/// The smallest of 1, 1.5, 2, 3, 4, 5, 6, 8, 10 times a power of ten that is not below `value`.
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

/// Path data of the area between two lines: x with the y of both.
fn band(points: impl IntoIterator<Item = (f64, (f64, f64))>) -> String {
    let points: Vec<_> = points.into_iter().collect();
    let forth = points.iter().map(|(x, (low, _))| (*x, *low));
    let back = points.iter().rev().map(|(x, (_, high))| (*x, *high));
    polyline(forth.chain(back), true)
}
