//! Owns the figures of a comparison: maps, differences in margins, location by location, causes.

mod causes;
mod locations;
mod maps;
mod margins;
mod scales;

pub(super) use causes::causes;
pub(super) use locations::locations;
pub(super) use maps::maps;
pub(super) use margins::margins;

use serde::Serialize;
use skinrig_compare::Comparison;

use super::text::short;
use crate::svg::{Px, Svg};

/// A figure for the template.
#[derive(Debug, Serialize)]
pub(super) struct RenderedFigure {
    pub id: String,
    pub title: String,
    pub caption: String,
    pub svg: String,
    /// Name of the data table behind it.
    pub table: String,
    pub interaction: &'static str,
}

/// Colours of better and worse, dark enough on light and dark paper. Blue and orange are distinct in all common types of
/// colour vision.
pub(super) const BETTER: &str = "#2b7bba";
pub(super) const WORSE: &str = "#d9721a";
pub(super) const NEITHER: &str = "#8f99a3";

/// Colour for -1 (better), 1 (worse) or 0.
const fn sign_colour(sign: i8) -> &'static str {
    match sign {
        -1 => BETTER,
        1 => WORSE,
        _ => NEITHER,
    }
}

/// Builder for a figure.
struct FigureBuilder {
    svg: Svg,
    id: String,
    title: String,
    caption: String,
    table: String,
}

impl FigureBuilder {
    fn new(id: &str, title: String, caption: String, table: &str, (w, h): (f64, f64)) -> Self {
        let mut svg = Svg::new();
        let view = format!("0 0 {} {}", Px(w), Px(h));
        let labelled = format!("{id}-title {id}-desc");
        svg.open(
            "svg",
            &[
                ("xmlns", &"http://www.w3.org/2000/svg"),
                ("class", &"fig"),
                ("id", &id),
                ("viewBox", &view),
                ("role", &"img"),
                ("aria-labelledby", &labelled),
            ],
        );
        svg.holding("title", &[("id", &format!("{id}-title"))], &title);
        svg.holding("desc", &[("id", &format!("{id}-desc"))], &caption);
        Self {
            svg,
            id: id.to_owned(),
            title,
            caption,
            table: table.to_owned(),
        }
    }

    /// Adds the footer with the sessions behind the figure, and closes it.
    fn finish(mut self, result: &Comparison, k: usize, height: f64) -> RenderedFigure {
        let of = |i: usize| {
            let skin = &result.skins[i];
            let ids: Vec<String> = skin
                .sessions
                .iter()
                .take(3)
                .map(|s| short(&s.session_id))
                .collect();
            let more = if skin.sessions.len() > 3 { ", …" } else { "" };
            format!("{} {} ({}{more})", skin.letter, skin.name, ids.join(", "))
        };
        let stand_in = super::text::stand_in(result).map_or(String::new(), |w| format!("   {w}"));
        let foot = format!("{}   {}{stand_in}", of(0), of(k));
        self.svg.text((10.0, height - 8.0), "foot", "start", &foot);
        RenderedFigure {
            id: self.id,
            title: self.title,
            caption: self.caption,
            svg: self.svg.finish(),
            table: self.table,
            interaction: "",
        }
    }
}
