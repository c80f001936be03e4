//! The replayed trigger box.

use skinrig_device::{DeviceError, TriggerBox, TriggerCapabilities};
use skinrig_model::{
    BoxReport, DeviceIdentity, DeviceRole, HostDuration, HostTime, Mark, PulseTrain, SentMark,
};

use super::shared_recording::SharedRecording;

/// A trigger box that accepts the recorded marks in order and returns their recorded times.
pub(crate) struct ReplayedTriggerBox {
    recording: SharedRecording,
    busy_until: Option<HostTime>,
}

impl ReplayedTriggerBox {
    /// The box of `recording`.
    #[must_use]
    pub(crate) const fn new(recording: SharedRecording) -> Self {
        Self {
            recording,
            busy_until: None,
        }
    }
}

impl TriggerBox for ReplayedTriggerBox {
    fn identity(&self) -> DeviceIdentity {
        self.recording.lock().identity(DeviceRole::TriggerBox)
    }

    fn capabilities(&self) -> TriggerCapabilities {
        TriggerCapabilities {
            train_duration: HostDuration::from_micros(PulseTrain::DURATION_US as i64),
        }
    }

    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        let mut recording = self.recording.lock();
        recording.check(DeviceRole::TriggerBox)?;
        let serial = recording.identity(DeviceRole::TriggerBox).serial;
        let now = recording.now();
        if let Some(until) = self.busy_until.filter(|&until| now < until) {
            return Err(DeviceError::State {
                role: DeviceRole::TriggerBox,
                serial,
                expected: "idle".to_owned(),
                found: format!("busy with a train until {until}"),
            });
        }
        if PulseTrain::new(mark).is_none() {
            return Err(DeviceError::Refused {
                role: DeviceRole::TriggerBox,
                serial,
                expected: format!("up to {}", skinrig_model::pulse::LAST_MARKED_PRESS),
                found: mark.press.to_string(),
            });
        }
        let show = |m: Mark| format!("{} of {}", m.kind, m.press);
        match recording.next_mark() {
            Some(recorded) if recorded.mark == mark => {
                recording.pass_mark();
                drop(recording);
                self.busy_until = Some(now + self.capabilities().train_duration);
                Ok(recorded)
            }
            other => Err(DeviceError::Diverged {
                role: DeviceRole::TriggerBox,
                at: format!("mark {}", recording.marks_read()),
                expected: other.map_or_else(|| "no further mark".to_owned(), |m| show(m.mark)),
                found: show(mark),
            }),
        }
    }

    fn poll(&mut self, reports: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        self.recording.lock().take_reports(reports)
    }
}
