//! The line of the trigger box: the queue of marks, and the time until which a mark occupies the line.

use std::collections::VecDeque;

use skinrig_device::{Clock, DeviceError, TriggerBox};
use skinrig_model::{BoxReport, DeviceIdentity, HostDuration, HostTime, Mark, SentMark};

/// The trigger box, if the rig has one, and its queue.
pub(crate) struct TriggerLine {
    device: Option<Box<dyn TriggerBox>>,
    queue: VecDeque<Mark>,
    /// Since when the first mark of the queue has waited.
    waiting_since: HostTime,
    free_at: HostTime,
    /// Longest time that the box may stay busy.
    busy_limit: HostDuration,
}

impl TriggerLine {
    pub(crate) fn new(device: Option<Box<dyn TriggerBox>>, busy_limit: HostDuration) -> Self {
        Self {
            device,
            queue: VecDeque::new(),
            waiting_since: HostTime::ZERO,
            free_at: HostTime::ZERO,
            busy_limit,
        }
    }

    pub(crate) const fn is_connected(&self) -> bool {
        self.device.is_some()
    }

    /// Identity of the box, if the rig has one.
    pub(crate) fn identity(&self) -> Option<DeviceIdentity> {
        self.device.as_ref().map(|d| d.identity())
    }

    /// Reads the reports of the box, including those before a failure.
    pub(crate) fn poll(&mut self, reports: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        match &mut self.device {
            Some(device) => device.poll(reports),
            None => Ok(()),
        }
    }

    /// Takes the notes of the box.
    pub(crate) fn take_notes(&mut self) -> Vec<String> {
        self.device
            .as_mut()
            .map_or_else(Vec::new, |device| device.take_notes())
    }

    /// Queues marks.
    pub(crate) fn queue(&mut self, marks: Vec<Mark>, now: HostTime) {
        if self.queue.is_empty() {
            self.waiting_since = now;
        }
        self.queue.extend(marks);
    }

    /// Sends the next mark if the line is free. A box that stays busy for too long is a fault.
    pub(crate) fn send_next(&mut self, clock: &dyn Clock) -> Result<Option<SentMark>, DeviceError> {
        let (Some(mark), Some(device)) = (self.queue.front().copied(), &mut self.device) else {
            return Ok(None);
        };
        let now = clock.now();
        if now < self.free_at {
            return Ok(None);
        }
        match device.send(mark) {
            Ok(sent) => {
                self.queue.pop_front();
                self.waiting_since = now;
                self.free_at = sent.t + device.capabilities().train_duration;
                Ok(Some(sent))
            }
            // In transit: the next turn polls for the answer.
            Err(DeviceError::Pending { .. }) => Ok(None),
            // Busy: the next turn tries again.
            Err(DeviceError::State { .. }) if now - self.waiting_since < self.busy_limit => {
                Ok(None)
            }
            Err(e) => Err(e),
        }
    }

    /// Sends a mark past the queue; without a box it does nothing.
    pub(crate) fn send_now(&mut self, mark: Mark) -> Result<(), DeviceError> {
        if let Some(device) = &mut self.device {
            let sent = device.send(mark)?;
            self.free_at = sent.t + device.capabilities().train_duration;
        }
        Ok(())
    }

    /// Time to send the next mark, if one is queued.
    pub(crate) fn next_due(&self) -> Option<HostTime> {
        (!self.queue.is_empty()).then_some(self.free_at)
    }

    /// True if no mark is queued or on the line.
    pub(crate) fn is_free(&self, now: HostTime) -> bool {
        self.queue.is_empty() && now >= self.free_at
    }

    /// End of the mark on the line.
    pub(crate) const fn free_at(&self) -> HostTime {
        self.free_at
    }
}
