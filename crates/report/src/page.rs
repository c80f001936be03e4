//! Owns the HTML page.

use crate::{ReportError, ReportInput};

pub(crate) fn render(input: &ReportInput<'_>) -> Result<String, ReportError> {
    Ok(input.provenance.session_id.clone())
}
