//! Press times of a session on the host clock.

use skinrig_model::{PressRole, PressTiming};

use crate::clock::PressSpan;
use crate::input::SessionInput;

/// Rows and times of the presses that have times.
pub(crate) fn timings(input: &SessionInput) -> impl Iterator<Item = (usize, PressTiming)> {
    let rows = input.outcomes.iter().enumerate();
    rows.filter_map(|(row, o)| Some((row, o.as_ref()?.timing?)))
}

/// Executed presses in time order.
pub(crate) fn spans(input: &SessionInput) -> Vec<PressSpan> {
    let mut spans: Vec<PressSpan> = timings(input)
        .map(|(row, t)| PressSpan {
            contact_us: t.contact.0 as f64 * 1e-3,
            release_us: t.release.0 as f64 * 1e-3,
            sync: input.planned[row].role == PressRole::Sync,
        })
        .collect();
    spans.sort_by(|a, b| a.contact_us.total_cmp(&b.contact_us));
    spans
}
