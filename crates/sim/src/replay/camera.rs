//! A replayed camera.

use skinrig_device::{CameraCapabilities, CameraSettings, DeviceError, EventCamera};
use skinrig_model::{
    CameraId, DeviceIdentity, DeviceRole, RawChunk, SENSOR_HEIGHT, SENSOR_WIDTH, Setting,
    StreamFormat,
};

use super::shared_recording::SharedRecording;

/// A camera that returns the recorded chunks unchanged.
pub(crate) struct ReplayedCamera {
    recording: SharedRecording,
    id: CameraId,
    format: StreamFormat,
    streaming: bool,
}

impl ReplayedCamera {
    /// Camera `id` of `recording`.
    #[must_use]
    pub(crate) const fn new(
        recording: SharedRecording,
        id: CameraId,
        format: StreamFormat,
    ) -> Self {
        Self {
            recording,
            id,
            format,
            streaming: false,
        }
    }

    fn expect_stopped(&self) -> Result<(), DeviceError> {
        if self.streaming {
            return Err(DeviceError::State {
                role: DeviceRole::of_camera(self.id),
                serial: self.identity().serial,
                expected: "stopped".to_owned(),
                found: "streaming".to_owned(),
            });
        }
        Ok(())
    }

    fn refused(&self, expected: &str, found: String) -> DeviceError {
        DeviceError::Refused {
            role: DeviceRole::of_camera(self.id),
            serial: self.identity().serial,
            expected: expected.to_owned(),
            found,
        }
    }
}

impl EventCamera for ReplayedCamera {
    fn camera(&self) -> CameraId {
        self.id
    }

    fn identity(&self) -> DeviceIdentity {
        self.recording
            .lock()
            .identity(DeviceRole::of_camera(self.id))
    }

    fn capabilities(&self) -> CameraCapabilities {
        let recorded = self
            .recording
            .lock()
            .settings(DeviceRole::of_camera(self.id));
        let biases = recorded.into_iter().map(|s| s.name);
        CameraCapabilities {
            width: SENSOR_WIDTH,
            height: SENSOR_HEIGHT,
            format: self.format,
            trigger_channels: vec![0, 6, 7],
            biases: biases.filter(|n| n.starts_with("bias_")).collect(),
        }
    }

    /// Returns the recorded settings. Rejects other biases than the recorded ones.
    fn configure(&mut self, settings: &CameraSettings) -> Result<Vec<Setting>, DeviceError> {
        self.expect_stopped()?;
        let can = self.capabilities();
        let recorded = self
            .recording
            .lock()
            .settings(DeviceRole::of_camera(self.id));
        for (name, value) in &settings.biases {
            let known = recorded.iter().find(|s| s.name == *name);
            if known.is_none_or(|s| s.read_back != value.to_string()) {
                return Err(self.refused("the recorded biases", format!("{name} = {value}")));
            }
        }
        for channel in &settings.trigger_channels {
            if !can.trigger_channels.contains(channel) {
                return Err(self.refused("trigger channel 0, 6 or 7", channel.to_string()));
            }
        }
        if let Some(r) = settings.roi {
            let fits = |from: u16, size: u16, limit: u16| {
                size > 0 && u32::from(from) + u32::from(size) <= u32::from(limit)
            };
            if !fits(r.x, r.width, can.width) || !fits(r.y, r.height, can.height) {
                return Err(self.refused("a non-empty region within the sensor", format!("{r:?}")));
            }
        }
        Ok(recorded)
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        self.expect_stopped()?;
        self.streaming = true;
        Ok(())
    }

    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        if !self.streaming {
            return Ok(());
        }
        self.recording.lock().take_chunks(self.id, false, chunks)
    }

    /// Same as [`poll`](Self::poll): the recorded chunks are already closed where they were flushed.
    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.poll(chunks)
    }

    /// Returns the rest of the recording once all recorded commands have been given.
    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        if !self.streaming {
            return Ok(());
        }
        self.streaming = false;
        self.recording.lock().take_chunks(self.id, true, chunks)
    }
}
