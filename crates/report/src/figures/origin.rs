//! Owns the texts common to the figures of a session: footer, label of the time axis.

use crate::format::or_missing;
use crate::input::ReportInput;

/// Label of the axis of a session's time.
pub(super) const HOST_TIME: &str = "time since the session's start, host clock (s)";

/// Footer of every figure: session, and `simulated` or `emulated`.
pub(super) fn foot(input: &ReportInput<'_>) -> String {
    let p = &input.provenance;
    let stand_in = p.stand_in();
    let stand_in = stand_in.map_or_else(String::new, |word| format!(" · {word} rig"));
    let usable = input.analysis.is_valid();
    let invalid = if usable { "" } else { "INVALID · " };
    let variant = p.variant.as_ref();
    let variant = variant.map_or_else(String::new, |v| format!(" · variant {}", v.name));
    format!(
        "{invalid}session {}{stand_in}{variant}",
        or_missing(&p.session_id)
    )
}
