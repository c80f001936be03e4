//! Samples on their way from the thread that owns the library to whoever polls, bounded and never lost in silence.

use std::sync::{Mutex, MutexGuard, PoisonError};

use skinrig_device::{DeviceError, RobotSample};

/// Samples kept between two polls: eight seconds at 2 kHz.
pub(crate) const CAPACITY: usize = 16_384;

/// The stream.
#[derive(Debug, Default)]
pub(crate) struct Stream {
    inside: Mutex<Inside>,
}

#[derive(Debug, Default)]
struct Inside {
    samples: Vec<RobotSample>,
    dropped: u64,
    failure: Option<DeviceError>,
    watched: bool,
    notes: Vec<String>,
}

impl Stream {
    fn lock(&self) -> MutexGuard<'_, Inside> {
        // Every change is complete at once: what a panicking thread left behind is whole.
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a sample; one that finds no room is counted.
    pub(crate) fn push(&self, sample: RobotSample) {
        let mut inside = self.lock();
        if inside.samples.len() < CAPACITY {
            inside.samples.push(sample);
        } else {
            inside.dropped += 1;
        }
    }

    /// Every poll gives this error from now on.
    pub(crate) fn fail(&self, error: DeviceError) {
        self.lock().failure.get_or_insert(error);
    }

    /// Forgets the failure.
    pub(crate) fn heal(&self) {
        self.lock().failure = None;
    }

    /// The failure.
    pub(crate) fn failure(&self) -> Option<DeviceError> {
        self.lock().failure.clone()
    }

    /// Something that the operator should know.
    pub(crate) fn note(&self, note: String) {
        self.lock().notes.push(note);
    }

    /// Moves all notes to the end of `into`.
    pub(crate) fn take_notes(&self, into: &mut Vec<String>) {
        into.append(&mut self.lock().notes);
    }

    /// Somebody looks after the robot.
    pub(crate) fn watch(&self) {
        self.lock().watched = true;
    }

    /// Whether somebody did since the last call; taking samples counts.
    pub(crate) fn was_watched(&self) -> bool {
        std::mem::take(&mut self.lock().watched)
    }

    /// Moves all samples to the end of `into`; gives how many found no room since the last call.
    pub(crate) fn take(&self, into: &mut Vec<RobotSample>) -> u64 {
        let mut inside = self.lock();
        inside.watched = true;
        into.append(&mut inside.samples);
        std::mem::take(&mut inside.dropped)
    }
}
