//! Owns presses that a camera's clock does not time: those too far from all ties to the host's clock.

use skinrig_model::CameraId;

use crate::clock::{MarksFit, fit_marks};
use crate::input::SessionInput;
use crate::press_spans::timings;
use crate::session_base::time_base;
use crate::tie::{Tie, UntimedPress};
use crate::timebase::{TimeBase, distance_us};

/// Rows of the plan that the clock of `camera` does not time. `marks`: ties of its clock if there is no time base. Does not
/// apply to a clock aligned by event rates, whose ties are the presses themselves.
pub(crate) fn rows(
    input: &SessionInput,
    camera: CameraId,
    base: Option<&TimeBase>,
    marks: Option<&MarksFit>,
) -> Vec<Option<UntimedPress>> {
    let limit_us = input.settings.alignment.max_tie_distance_us;
    let by_base = base.filter(|b| b.clocks[camera.index()].is_some());
    let furthest = |host_us: f64| -> Option<(Tie, f64)> {
        match (by_base, marks) {
            (Some(base), _) => base.tie_distance_us(camera.index(), host_us),
            (None, Some(marks)) => Some((Tie::Mark, distance_us(&marks.seen_us, host_us))),
            (None, None) => None,
        }
    };
    let mut out = vec![None; input.planned.len()];
    for (row, timing) in timings(input) {
        let ends = [timing.contact, timing.release].map(|t| t.0 as f64 * 1e-3);
        let far = ends.into_iter().filter_map(furthest);
        out[row] = far
            .filter(|(_, distance_us)| *distance_us > limit_us)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(tie, distance_us)| UntimedPress {
                tie,
                distance_us,
                limit_us,
            });
    }
    out
}

/// Same for both cameras, from the session alone.
pub(crate) fn of_session(input: &SessionInput) -> [Vec<Option<UntimedPress>>; 2] {
    let base = time_base(input);
    CameraId::ALL.map(|camera| {
        let k = camera.index();
        let by_base = base.as_ref().is_some_and(|b| b.clocks[k].is_some());
        let channel = input.rig.trigger_channel.filter(|_| !by_base);
        let marks = channel.and_then(|c| fit_marks(&input.edges[k], c, &input.marks).ok());
        rows(input, camera, base.as_ref(), marks.as_ref())
    })
}
