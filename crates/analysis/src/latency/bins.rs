//! Event counts in bins of equal width around a contact, on host time.

use crate::press_events::{EventView, PackedEvent};
use crate::result::ClockFit;

/// Consecutive bins; bin 0 begins at the contact, so that no bin mixes events before and after it.
///
/// Bins are half-open. (numpy's histogram closes the last bin; here an event at the end of a window belongs to the next one,
/// so that adjoining windows count every event once.)
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Number of the first bin; negative before the contact.
    pub first: i64,
    /// Number of bins.
    pub len: usize,
}

impl Grid {
    /// The whole bins of `bin_us` between two host times relative to the contact, µs.
    #[must_use]
    pub fn within(from_us: f64, to_us: f64, bin_us: f64) -> Self {
        let first = (from_us / bin_us).ceil() as i64;
        let end = (to_us / bin_us).floor() as i64;
        Self {
            first,
            len: (end - first).max(0) as usize,
        }
    }

    /// Number of the bin after the last one.
    #[must_use]
    pub const fn end(&self) -> i64 {
        self.first + self.len as i64
    }

    /// Middle of the bin at `index`, ms after the contact.
    #[must_use]
    pub(crate) fn centre_ms(&self, index: usize, bin_ms: f64) -> f64 {
        ((self.first + index as i64) as f64 + 0.5) * bin_ms
    }

    /// Total length, s.
    #[must_use]
    pub fn length_s(&self, bin_ms: f64) -> f64 {
        self.len as f64 * bin_ms * 1e-3
    }
}

/// Events of one camera on host time relative to the contact.
#[derive(Debug, Clone, Copy)]
pub struct HostTimeView<'a> {
    view: &'a EventView,
    /// Contact in camera time after the view's start, µs.
    contact_us: f64,
    /// Camera µs per host µs.
    rate: f64,
}

impl<'a> HostTimeView<'a> {
    /// A view with the clock of its camera; the contact is `late_us` later than the single line through that clock predicts.
    #[must_use]
    pub fn new(view: &'a EventView, clock: &ClockFit, late_us: f64) -> Self {
        Self {
            view,
            contact_us: view.contact_us + late_us,
            rate: 1.0 + clock.drift_ppm * 1e-6,
        }
    }

    /// Host time relative to the contact of a camera time after the view's start, µs.
    #[must_use]
    pub fn host_us(&self, camera_us: f64) -> f64 {
        (camera_us - self.contact_us) / self.rate
    }

    /// The view.
    #[must_use]
    pub const fn view(&self) -> &'a EventView {
        self.view
    }

    /// Position of an event in bins after the contact.
    fn position(&self, event: PackedEvent, bin_us: f64) -> f64 {
        (f64::from(event.t_us()) - self.contact_us) / (self.rate * bin_us)
    }

    /// Events in the bins of `grid`.
    #[must_use]
    pub fn within(&self, grid: Grid, bin_us: f64) -> &'a [PackedEvent] {
        let before = |edge: i64| {
            let edge = edge as f64;
            let events = &self.view.events;
            events.partition_point(|e| self.position(*e, bin_us) < edge)
        };
        let (from, to) = (before(grid.first), before(grid.end()));
        &self.view.events[from..to.max(from)]
    }

    /// Adds events within `grid` to `counts`.
    pub fn count(
        &self,
        events: impl Iterator<Item = PackedEvent>,
        grid: Grid,
        bin_us: f64,
        counts: &mut [u32],
    ) {
        for event in events {
            let bin = self.position(event, bin_us).floor() as i64 - grid.first;
            if let Some(count) = usize::try_from(bin).ok().and_then(|b| counts.get_mut(b)) {
                *count = count.saturating_add(1);
            }
        }
    }
}
