//! When the presses of a session happened, on the host's clock.

use skinrig_model::{PressRole, PressTiming};

use crate::clock::PressSpan;
use crate::input::SessionInput;

/// Rows and times of the presses that have any.
pub(crate) fn timings(input: &SessionInput) -> impl Iterator<Item = (usize, PressTiming)> {
    let rows = input.outcomes.iter().enumerate();
    rows.filter_map(|(row, o)| Some((row, o.as_ref()?.timing?)))
}

/// The presses that were made, in time order.
pub fn spans(input: &SessionInput) -> Vec<PressSpan> {
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
