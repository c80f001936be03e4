//! Owns the errors of writing a report.

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The page template failed; a defect of this crate.
    #[error("cannot render the report template: {0}; please report this as a defect")]
    Template(#[from] minijinja::Error),
    /// The script data could not be written as JSON; a defect of this crate.
    #[error("cannot write the report data as JSON: {0}; please report this as a defect")]
    Json(#[from] serde_json::Error),
}
