//! Why a report could not be written.

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The page template failed; a defect of this crate.
    #[error("expected the report template to render, found: {0}; please report this as a defect")]
    Template(#[from] minijinja::Error),
    /// The script data could not be written as JSON; a defect of this crate.
    #[error("expected report data that JSON can hold, found: {0}; please report this as a defect")]
    Json(#[from] serde_json::Error),
}
