//! Receivers of decoded events.

use skinrig_model::{CdEvent, TriggerEdge};

use super::stats::Discontinuity;

/// A status word of the camera (EVT2 OTHER with CONTINUED, EVT2.1 OTHERS, EVT3 OTHERS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Monitoring {
    /// Camera time, µs.
    pub t_us: u64,
    /// Subtype; 0x14 counts CD events in, 0x16 CD events after rate control. Others are not public.
    pub subtype: u16,
    /// Payload as sent: 28 bits in EVT2 and EVT3, 32 in EVT2.1.
    pub payload: u32,
}

/// Receives the output of a decoder, in stream order.
pub trait EventSink {
    /// One or more CD events. Their times need not be sorted, because sensors do not guarantee it.
    fn on_cd(&mut self, events: &[CdEvent]);
    /// An edge on a trigger input.
    fn on_trigger(&mut self, edge: TriggerEdge);
    /// A status word of the camera.
    fn on_monitoring(&mut self, _monitoring: Monitoring) {}
    /// A discontinuity of the time base.
    fn on_discontinuity(&mut self, _step: Discontinuity) {}
}

/// Passes CD events to a closure and discards the rest.
pub(super) struct CdSlices<F>(pub F);

impl<F: FnMut(&[CdEvent])> EventSink for CdSlices<F> {
    fn on_cd(&mut self, events: &[CdEvent]) {
        (self.0)(events);
    }
    fn on_trigger(&mut self, _edge: TriggerEdge) {}
}

/// Appends to vectors.
pub(super) struct CollectingSink<'a> {
    pub events: &'a mut Vec<CdEvent>,
    pub triggers: &'a mut Vec<TriggerEdge>,
}

impl EventSink for CollectingSink<'_> {
    fn on_cd(&mut self, events: &[CdEvent]) {
        self.events.extend_from_slice(events);
    }
    fn on_trigger(&mut self, edge: TriggerEdge) {
        self.triggers.push(edge);
    }
}
