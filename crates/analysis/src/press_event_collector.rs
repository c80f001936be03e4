//! Collects the events around selected presses while a camera's stream passes.

use skinrig_model::CdEvent;

use crate::press_events::{EventView, PackedEvent};

/// Maximum number of events per camera: 128 MiB.
const MAX_EVENTS: usize = 1 << 24;

/// A press whose events are wanted, with its view.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RetentionPlan {
    /// Row of the press in the plan.
    pub row: usize,
    /// Its view, initially without events.
    pub view: EventView,
}

/// Collects views that may overlap.
pub(crate) struct PressEventCollector {
    plans: Vec<RetentionPlan>,
    /// Views before this index are complete.
    next: usize,
    events: usize,
}

impl PressEventCollector {
    /// An empty collector; the plans are sorted by the start of their views.
    pub(crate) const fn new(plans: Vec<RetentionPlan>) -> Self {
        Self {
            plans,
            next: 0,
            events: 0,
        }
    }

    /// Processes the next events in time order. When the memory limit is reached, this press and all later ones are dropped.
    pub(crate) fn take(&mut self, events: &[CdEvent]) {
        for plan in &mut self.plans[self.next..] {
            let view = &mut plan.view;
            let start = events.partition_point(|e| e.t_us < view.start_us);
            let events = &events[start..];
            if events.is_empty() {
                break;
            }
            let within = |e: &CdEvent| e.t_us - view.start_us < u64::from(view.length_us);
            let end = events.partition_point(within);
            let packed = events[..end].iter();
            let before = view.events.len();
            let start_us = view.start_us;
            view.events
                .extend(packed.filter_map(|e| PackedEvent::pack(e, start_us)));
            self.events += view.events.len() - before;
        }
        if self.events > MAX_EVENTS {
            self.plans.truncate(self.next);
        }
    }

    /// Declares that no event before `time_us` will follow.
    pub(crate) fn advance(&mut self, time_us: u64) {
        while let Some(RetentionPlan { view, .. }) = self.plans.get_mut(self.next) {
            if view.start_us + u64::from(view.length_us) > time_us {
                break;
            }
            view.events.sort_unstable();
            view.events.shrink_to_fit();
            self.next += 1;
        }
    }

    /// The complete views, without dropped ones.
    pub(crate) fn finish(mut self) -> Vec<RetentionPlan> {
        self.advance(u64::MAX);
        self.plans
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::Polarity;

    use super::*;

    fn plan(row: usize, start_us: u64, length_us: u32) -> RetentionPlan {
        let view = EventView {
            start_us,
            length_us,
            ..EventView::default()
        };
        RetentionPlan { row, view }
    }

    #[test]
    fn overlapping_views_get_all_of_their_events_in_order() {
        let mut collector = PressEventCollector::new(vec![plan(0, 100, 50), plan(1, 120, 50)]);
        for t_us in [99, 100, 149, 130, 150, 169, 170] {
            collector.take(&[CdEvent {
                t_us,
                x: 5,
                y: 200,
                polarity: Polarity::On,
            }]);
            collector.advance(t_us.saturating_sub(30));
        }
        let done = collector.finish();
        let times =
            |i: usize| -> Vec<u32> { done[i].view.events.iter().map(|e| e.t_us()).collect() };
        assert_eq!((done[0].row, times(0)), (0, vec![0, 30, 49]));
        assert_eq!((done[1].row, times(1)), (1, vec![10, 29, 30, 49]));
    }
}
