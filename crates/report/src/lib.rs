//! Owns the presentation of an analysis: self-contained HTML page, SVG figures, JSON, terminal table.
//!
//! The report computes nothing beyond layout. Every number comes from [`skinrig_analysis::result::Analysis`]; the few
//! summaries needed only for drawing (histogram bars, means per location) are in [`mod@derive`], with their formulas.
//!
//! Pages and terminal texts are built as documents (`document`). User strings (prototype, operator, notes, file names) are
//! escaped everywhere: by `markup` in HTML and figures, and by `document::html` in script data.
//!
//! Hooks for browser tests: every section, figure, button and the press table carries a `data-testid`.

mod choices;
pub mod colour;
pub mod compare;
pub mod comparison;
mod course;
pub mod derive;
pub mod figures;
pub mod night;
pub mod page;
pub mod provenance;
pub mod published;
pub mod scene_check;
pub mod scene_prediction;
pub mod style;
pub mod svg;
pub mod tradeoff;
pub mod trend;
pub mod twin;

mod detector;
mod document;
mod format;
mod input;
mod json;
mod markup;
mod plot;
mod selection;
mod tables;
mod terminal;

pub use input::ReportInput;
pub use json::{JSON_VERSION, Summary};
pub use provenance::{
    DeviceRow, InterruptionRow, LegRow, LossRow, NoteRow, Provenance, RetakeRow, SelectionEffect,
    SelectionName, Variant,
};

/// The whole report as a self-contained HTML page.
#[must_use]
pub fn html(input: &ReportInput<'_>) -> String {
    page::render(input)
}

/// The results as JSON for programs: `format` (`JSON_FORMAT`), `format_version` ([`JSON_VERSION`]), `valid` (false: do not
/// use the numbers), `provenance` ([`Provenance`]), `summary` ([`Summary`]), `analysis` (the fields of
/// [`Analysis`](skinrig_analysis::Analysis) without the bulk series `rates`, `pictures`, `zooms`, `activity`, `motion` and
/// `alignment.residuals`) and `comparison` ([`comparison::Row`]s: the session beside the published numbers).
///
/// Absent values are `null`. New fields do not change the version; a field that changes its meaning or disappears does.
#[must_use]
pub fn json(input: &ReportInput<'_>) -> serde_json::Value {
    json::json(input)
}

/// The results as a terminal table: at most 80 columns, ends with a newline.
///
/// `color` adds ANSI escapes (bold and yellow) without changing the layout.
#[must_use]
pub fn terminal_table(input: &ReportInput<'_>, color: bool) -> String {
    terminal::table(input, color)
}

/// True digits of the results: metrics, results with the fewest digits, decisions on the edge. Ends with a newline.
#[must_use]
pub fn digits_text(digits: &skinrig_analysis::digits::Digits) -> String {
    terminal::digits::text(digits)
}

/// Summary in at most eight lines of at most 80 columns: RMSE with its interval, or a note that there is none; counts; the
/// gravest faults, losses and warnings. Ends with a newline; `color` as in [`terminal_table`].
#[must_use]
pub fn terminal_summary(input: &ReportInput<'_>, color: bool) -> String {
    terminal::summary(input, color)
}
