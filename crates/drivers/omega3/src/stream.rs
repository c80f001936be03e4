//! Bounded queue of samples from the owner thread to the polling program. Dropped samples are counted.

use std::sync::{Mutex, MutexGuard, PoisonError};

use skinrig_device::{DeviceError, RobotSample};

/// Samples queued between two polls: eight seconds at 2 kHz.
pub(crate) const CAPACITY: usize = 16_384;

/// The queue with failure and notes.
#[derive(Debug, Default)]
pub(crate) struct Stream {
    inner: Mutex<Inner>,
}

#[derive(Debug, Default)]
struct Inner {
    samples: Vec<RobotSample>,
    dropped: u64,
    failure: Option<DeviceError>,
    is_active: bool,
    notes: Vec<String>,
}

impl Stream {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        // Every update is complete under one lock, so a poisoned lock has consistent data.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a sample, or counts it as dropped if the queue is full.
    pub(crate) fn push(&self, sample: RobotSample) {
        let mut inner = self.lock();
        if inner.samples.len() < CAPACITY {
            inner.samples.push(sample);
        } else {
            inner.dropped += 1;
        }
    }

    /// Sets the failure that every poll returns from now on. The first one stays.
    pub(crate) fn fail(&self, error: DeviceError) {
        self.lock().failure.get_or_insert(error);
    }

    /// Clears the failure.
    pub(crate) fn clear_failure(&self) {
        self.lock().failure = None;
    }

    /// The current failure.
    pub(crate) fn failure(&self) -> Option<DeviceError> {
        self.lock().failure.clone()
    }

    /// Adds a note for the operator.
    pub(crate) fn note(&self, note: String) {
        self.lock().notes.push(note);
    }

    /// Moves all notes to the end of `into`.
    pub(crate) fn take_notes(&self, into: &mut Vec<String>) {
        into.append(&mut self.lock().notes);
    }

    /// Marks the robot as polled or commanded.
    pub(crate) fn mark_active(&self) {
        self.lock().is_active = true;
    }

    /// Whether the robot was polled or commanded since the last call.
    pub(crate) fn take_activity(&self) -> bool {
        std::mem::take(&mut self.lock().is_active)
    }

    /// Moves all samples to the end of `into`. Returns the number dropped since the last call.
    pub(crate) fn take(&self, into: &mut Vec<RobotSample>) -> u64 {
        let mut inner = self.lock();
        inner.is_active = true;
        into.append(&mut inner.samples);
        std::mem::take(&mut inner.dropped)
    }
}
