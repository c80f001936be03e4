//! The press in progress: its phases, the marks still to send, and what its cameras delivered.

use skinrig_model::{
    AttemptId, CameraId, HostTime, Mark, MarkKind, PoseSample, PressFault, RawChunk,
};
use skinrig_protocol::plan::PressStep;

use crate::press_tracker::PressTracker;

/// Data of one camera during the press.
#[derive(Debug, Clone, Copy, Default)]
struct DataCount {
    lost_bytes: u64,
    bytes: u64,
    events: u64,
}

/// An attempt at a press between its intent and its outcome.
pub(crate) struct OpenPress {
    attempt: AttemptId,
    /// Time of the intent.
    began: HostTime,
    /// Set once the tip goes down.
    tracker: Option<PressTracker>,
    /// Marks for phases that have not been reached.
    marks: Vec<MarkKind>,
    data: [DataCount; 2],
    /// Faults of its data other than lost or no bytes.
    data_faults: Vec<PressFault>,
}

impl OpenPress {
    pub(crate) fn new(attempt: AttemptId, step: &PressStep, began: HostTime) -> Self {
        Self {
            attempt,
            began,
            tracker: None,
            marks: step.marks.clone(),
            data: [DataCount::default(); 2],
            data_faults: Vec::new(),
        }
    }

    pub(crate) const fn attempt(&self) -> AttemptId {
        self.attempt
    }

    /// Starts to track the phases.
    pub(crate) fn track(&mut self, tracker: PressTracker) {
        self.tracker = Some(tracker);
    }

    pub(crate) const fn tracker(&self) -> Option<&PressTracker> {
        self.tracker.as_ref()
    }

    pub(crate) const fn tracker_mut(&mut self) -> Option<&mut PressTracker> {
        self.tracker.as_mut()
    }

    /// Processes the next pose sample.
    pub(crate) fn feed(&mut self, sample: &PoseSample) {
        if let Some(tracker) = &mut self.tracker {
            tracker.feed(sample);
        }
    }

    /// Counts the data of a camera.
    pub(crate) fn count(&mut self, chunk: &RawChunk) {
        let data = &mut self.data[chunk.camera.index()];
        data.lost_bytes += chunk.lost_before;
        data.bytes += chunk.bytes.len() as u64;
        data.events += chunk.facts.cd_events;
    }

    /// Takes the marks for phases that have been reached.
    pub(crate) fn take_reached_marks(&mut self) -> Vec<Mark> {
        let Some(tracker) = &self.tracker else {
            return Vec::new();
        };
        let is_reached = |kind: &MarkKind| match kind {
            MarkKind::Approach => tracker.approach().is_some(),
            MarkKind::Contact => tracker.contact().is_some(),
            MarkKind::AtDepth => tracker.at_depth().is_some(),
            MarkKind::Retract => tracker.retract().is_some(),
            MarkKind::Release => tracker.release().is_some(),
        };
        let press = self.attempt.press;
        let (reached, later): (Vec<_>, Vec<_>) = self.marks.iter().copied().partition(is_reached);
        self.marks = later;
        reached
            .into_iter()
            .map(|kind| Mark { kind, press })
            .collect()
    }

    /// Time at which the tip was back at clearance height.
    pub(crate) fn cleared_at(&self) -> Option<HostTime> {
        self.tracker.as_ref().and_then(PressTracker::clear)
    }

    /// Adds a fault of its data.
    pub(crate) fn add_data_fault(&mut self, fault: PressFault) {
        self.data_faults.push(fault);
    }

    /// Compares the event rates since the intent with the limit, ev/s.
    pub(crate) fn check_event_rate(&mut self, now: HostTime, level_ev_s: f64) {
        let seconds = (now - self.began).as_secs_f64().max(1e-3);
        for camera in CameraId::ALL {
            let found_ev_s = self.data[camera.index()].events as f64 / seconds;
            if found_ev_s > level_ev_s {
                self.data_faults.push(PressFault::EventStorm {
                    camera,
                    level_ev_s,
                    found_ev_s,
                });
            }
        }
    }

    /// All faults of its data.
    pub(crate) fn data_faults(&self) -> Vec<PressFault> {
        let mut faults = Vec::new();
        for camera in CameraId::ALL {
            let data = self.data[camera.index()];
            if data.lost_bytes > 0 {
                faults.push(PressFault::DataLost {
                    camera,
                    bytes: data.lost_bytes,
                });
            } else if data.bytes == 0 {
                faults.push(PressFault::NoData { camera });
            }
        }
        faults.extend_from_slice(&self.data_faults);
        faults
    }
}
