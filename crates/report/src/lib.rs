//! Owns the presentation of an analysis: self-contained HTML page, SVG figures, JSON, terminal table.
//!
//! The report computes nothing beyond layout. Every number comes from
//! [`skinrig_analysis::result::Analysis`]; the few summaries that only a drawing needs (bars of a histogram,
//! means per location) are in one place, [`mod@derive`], with their formulas.
//!
//! User strings (prototype, operator, notes, file names) are escaped wherever they land: by minijinja's
//! auto-escape in HTML, by the [`svg`] builder in figures, and by `page::script_json` in script data.
//!
//! Hooks for browser tests: every section, figure, button and the press table carries a `data-testid`.

pub mod axes;
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
pub mod svg;
pub mod tradeoff;
pub mod trend;

mod detector;
mod document;
mod error;
mod format;
mod frame;
mod input;
mod tables;
mod terminal;

pub use document::{JSON_FORMAT, JSON_VERSION, Summary};
pub use error::ReportError;
pub use input::ReportInput;
pub use provenance::{
    DeviceRow, InterruptionRow, LegRow, LossRow, NoteRow, Provenance, RetakenRow, Variant,
};

/// The whole report as one HTML page that needs no network and no other file.
///
/// # Errors
/// [`ReportError`] when the template or the script data cannot be written; no input is known to cause it.
pub fn html(input: &ReportInput<'_>) -> Result<String, ReportError> {
    page::render(input)
}

/// The results as JSON for programs: `format` ([`JSON_FORMAT`]), `format_version` ([`JSON_VERSION`]),
/// `valid` (false when the alignment certificate is beyond its limits: the numbers are not to be used),
/// `provenance` ([`Provenance`]), `summary` ([`Summary`]), `analysis` (the fields of [`Analysis`](skinrig_analysis::Analysis) without the bulk series `rates`, `pictures`,
/// `zooms`, `activity` and `motion`, and without `alignment.residuals`) and `comparison` ([`comparison::Row`]s: the session beside the published numbers).
///
/// A field that has no value is `null`. Fields are added without a new version; a field that changes its
/// meaning or disappears raises the version.
#[must_use]
pub fn json(input: &ReportInput<'_>) -> serde_json::Value {
    document::json(input)
}

/// The results as a table for a terminal: at most 80 columns, ends with a newline.
///
/// `color` adds ANSI escapes (bold and yellow, nothing that changes the layout).
#[must_use]
pub fn terminal_table(input: &ReportInput<'_>, color: bool) -> String {
    terminal::table(input, color)
}
