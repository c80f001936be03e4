//! Time base of a session from the reports of its trigger box.

use crate::input::SessionInput;
use crate::press_spans::spans;
use crate::timebase::{TimeBase, TimeBaseInput};

/// The time base, if the trigger box reported its clock.
pub(crate) fn time_base(input: &SessionInput) -> Option<TimeBase> {
    let used_at_us: Vec<f64> = spans(input)
        .iter()
        .flat_map(|s| [s.contact_us, s.release_us])
        .collect();
    let ties = TimeBaseInput {
        reports: &input.box_reports,
        edges: [&input.edges[0], &input.edges[1]],
        channel: input.rig.trigger_channel?,
        recorded: [&input.recorded[0], &input.recorded[1]],
        legs: &input.legs,
        used_at_us: &used_at_us,
    };
    TimeBase::new(&ties, &input.settings.alignment)
}
