//! One leg of a session: where it begins, and what of a stream belongs to it.

use skinrig_model::{HostTime, TriggerEdge};

use crate::result::ClockFit;

/// Where a further leg of the session begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LegStart {
    /// On the host's clock; all times of the leg are at or after it, all earlier ones before.
    pub origin: HostTime,
    /// Where the recorder put each camera's zero of the leg, µs.
    pub recorded_us: [u64; 2],
    /// On each camera's clock: all events of the leg are at or after it, all earlier ones before, µs.
    pub camera_us: [u64; 2],
    /// By how much [`crate::legs::align`] moved each camera's times of the leg, µs; 0 before it.
    pub moved_us: [i64; 2],
}

impl LegStart {
    /// A leg as it was recorded.
    #[must_use]
    pub const fn recorded(origin: HostTime, recorded_us: [u64; 2]) -> Self {
        Self {
            origin,
            recorded_us,
            camera_us: recorded_us,
            moved_us: [0; 2],
        }
    }
}

/// A leg's line, and a host time in the middle of what it was fitted to, µs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegLine {
    pub fit: ClockFit,
    pub middle_us: f64,
}

/// The edges of one leg, 0 for the first, out of all edges of a camera in stream order.
pub(crate) fn edges_of<'a>(
    edges: &'a [TriggerEdge],
    legs: &[LegStart],
    leg: usize,
    camera: usize,
) -> &'a [TriggerEdge] {
    let from = leg.checked_sub(1).map_or(0, |i| legs[i].camera_us[camera]);
    let to = legs
        .get(leg)
        .map_or(u64::MAX, |next| next.camera_us[camera]);
    // In order but for a broken time base, whose edges are nowhere anyway.
    let start = edges.partition_point(|e| e.t_us < from);
    let end = edges.partition_point(|e| e.t_us < to).max(start);
    &edges[start..end]
}

/// When a camera was recording in one leg, 0 for the first, on its own clock, µs.
pub(crate) fn recorded_of(
    recorded: &[(u64, u64)],
    legs: &[LegStart],
    leg: usize,
    camera: usize,
) -> Vec<(u64, u64)> {
    let of = |t_us: u64| legs.partition_point(|next| next.camera_us[camera] <= t_us);
    let spans = recorded.iter().copied();
    spans.filter(|(from, _)| of(*from) == leg).collect()
}

/// The leg that a host time belongs to, 0 for the first.
pub(crate) fn leg_at(legs: &[LegStart], t: HostTime) -> usize {
    legs.partition_point(|leg| leg.origin <= t)
}
