//! Owns the results table for a terminal.

use crate::ReportInput;

pub(crate) fn table(input: &ReportInput<'_>, color: bool) -> String {
    let _ = color;
    input.provenance.session_id.clone()
}
