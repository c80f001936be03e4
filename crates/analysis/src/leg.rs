//! One leg of a session: its start, and the part of a stream that belongs to it.

use skinrig_model::{HostTime, TriggerEdge};

use crate::result::ClockFit;

/// Start of a further leg.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LegStart {
    /// On the host clock; separates the times of the leg from all earlier ones.
    pub origin: HostTime,
    /// Zero of each camera's clock in this leg, as placed by the recorder, µs.
    pub recorded_us: [u64; 2],
    /// On each camera's clock; separates the events of the leg from all earlier ones, µs.
    pub camera_us: [u64; 2],
    /// Shift that [`crate::legs::align`] applied to each camera's times of the leg, µs; initially 0.
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

/// Line of a leg, and a host time in the middle of its points, µs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegLine {
    pub fit: ClockFit,
    pub middle_us: f64,
}

/// Edges of one leg (0: the first) out of all edges of a camera in stream order.
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
    // Sorted, unless the time base is broken, in which case its edges are unusable anyway.
    let start = edges.partition_point(|e| e.t_us < from);
    let end = edges.partition_point(|e| e.t_us < to).max(start);
    &edges[start..end]
}

/// Periods in which a camera was recording in one leg (0: the first), on its own clock, µs.
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

/// Leg of a host time (0: the first).
pub(crate) fn leg_at(legs: &[LegStart], t: HostTime) -> usize {
    legs.partition_point(|leg| leg.origin <= t)
}
