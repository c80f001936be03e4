//! Owns the view of a press by one camera: its event counts and the estimate of its column.

use crate::estimators::ColumnEstimate;
use crate::result::PressView;
use crate::segment::Window;

/// Event counts of a press in one camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct EventCounts {
    /// Events in the window.
    pub events: u32,
    /// ON events in the window.
    pub on: u32,
    /// Events in the idle time before the press.
    pub idle: u64,
    /// See [`PressView::core_threshold`].
    pub core_threshold: Option<u32>,
    /// See [`PressView::width_u`].
    pub width_u: Option<f64>,
}

/// Combines counts and estimate into the view of one camera.
pub(crate) fn press_view(
    window: &Window,
    tally: EventCounts,
    sighting: &ColumnEstimate,
) -> PressView {
    let per_s = |n: f64, s: f64| if s > 0.0 { n / s } else { 0.0 };
    PressView {
        events: tally.events,
        on_events: tally.on,
        clusters: sighting.clusters,
        cluster_events: sighting.events,
        centroid_u: sighting.column,
        centroid_v: sighting.row,
        rate_per_s: per_s(f64::from(tally.events), window.length_s()),
        idle_rate_per_s: per_s(tally.idle as f64, window.idle_s()),
        idle_s: window.idle_s(),
        spread_u: sighting.spread_u,
        spread_v: sighting.spread_v,
        width_u: tally.width_u,
        core_threshold: tally.core_threshold,
    }
}
