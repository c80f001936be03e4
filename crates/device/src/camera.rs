//! An event camera.

use std::collections::BTreeMap;

use skinrig_model::{CameraId, DeviceIdentity, DeviceRole, RawChunk, Setting, StreamFormat};

use crate::DeviceError;

/// What a camera is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CameraCapabilities {
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// What its bytes are.
    pub format: StreamFormat,
    /// Trigger input channels that can be enabled.
    pub trigger_channels: Vec<u8>,
    /// Names of the biases that can be set.
    pub biases: Vec<String>,
}

/// A rectangle of pixels that stay on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Roi {
    /// First column.
    pub x: u16,
    /// First row.
    pub y: u16,
    /// Columns, at least 1.
    pub width: u16,
    /// Rows, at least 1.
    pub height: u16,
}

/// Whose time base a camera follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SyncMode {
    /// Its own.
    #[default]
    Standalone,
    /// Its own, given to others on the sync line. Started after its slaves.
    Master,
    /// The one on the sync line. Started before the master.
    Slave,
}

/// A gate that passes events only while the sensor's total rate is above a threshold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoiseFilter {
    /// Events per second of the whole sensor.
    pub min_rate_ev_s: u32,
}

/// What can be set on a camera before it starts. Everything unset keeps the device's default.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CameraSettings {
    /// Whose time base it follows.
    pub sync: SyncMode,
    /// The sensor's own noise filter; off when absent.
    pub noise_filter: Option<NoiseFilter>,
    /// Bias values by name, in the device's own unit.
    pub biases: BTreeMap<String, i64>,
    /// Pixels that stay on; all when absent.
    pub roi: Option<Roi>,
    /// Trigger input channels to enable.
    pub trigger_channels: Vec<u8>,
}

/// Events that a camera makes by itself, in place of what its pixels see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestPattern {
    /// How many are wanted, events per second.
    pub rate_ev_s: f64,
}

/// What a camera's pattern generator makes: a scan of all pixels down each column, from the first column to the last, again and
/// again, at an even rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatternScan {
    /// Events per second of the camera's own clock: the nearest to what was wanted.
    pub rate_ev_s: f64,
    /// Columns of the scan; not bound to the sensor's.
    pub columns: u16,
    /// Rows of the scan; likewise.
    pub rows: u16,
}

/// A source of raw event bytes.
///
/// States: stopped -> [`start`](Self::start) -> streaming -> [`stop`](Self::stop) -> stopped.
/// Chunk numbers count on through stop and start; bytes are never changed, reordered or dropped in
/// silence: what is lost is counted in `lost_before` of the next chunk.
pub trait EventCamera: Send {
    /// Which of the two it is.
    fn camera(&self) -> CameraId;

    /// Who it is.
    fn identity(&self) -> DeviceIdentity;

    /// What it can do.
    fn capabilities(&self) -> CameraCapabilities;

    /// Writes settings and reads them back; only while stopped.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] for unknown biases, channels or pixels, before anything is written;
    /// [`DeviceError::ReadBack`]; [`DeviceError::State`] while streaming.
    fn configure(&mut self, settings: &CameraSettings) -> Result<Vec<Setting>, DeviceError>;

    /// Starts streaming.
    ///
    /// # Errors
    /// [`DeviceError::State`] while streaming; [`DeviceError::Lost`].
    fn start(&mut self) -> Result<(), DeviceError>;

    /// Appends the chunks that filled up since the last call.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]; chunks already appended stay valid.
    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError>;

    /// Like [`poll`](Self::poll), and closes the chunk under way, so that everything up to the present has
    /// been handed over.
    ///
    /// # Errors
    /// As [`poll`](Self::poll). [`DeviceError::Pending`] from a camera that needs longer: everything up to the first of the calls
    /// that were answered so is handed over with the one that is not.
    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError>;

    /// Flushes and stops. Allowed in every state, any number of times.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]; chunks already appended stay valid.
    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError>;

    /// Appends, in sentences, what happened to the stream since the last call that its bytes do not say: bytes without a
    /// time that were let go at the start, jumps of the camera's time base, its own overflow counter. A camera that
    /// notices nothing of the kind has none.
    fn take_notes(&mut self, _notes: &mut Vec<String>) {}

    /// Temperature of the camera, °C, at the present; of which part of it the implementation says. `None` from a camera that
    /// cannot tell: it is not asked again. Allowed in every state; asked at most once a second, for it may take a request to
    /// the device.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] when a camera that could tell does not answer; [`DeviceError::Pending`] from one that needs longer.
    fn temperature_c(&mut self) -> Result<Option<f64>, DeviceError> {
        Ok(None)
    }

    /// From the next start on lets the camera's own generator make events in place of its pixels. `None` gives the pixels
    /// back, and so does [`configure`](Self::configure). Only while stopped. Answers what the generator makes; `None` when the
    /// pixels are back.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] from a camera without a generator, and for a rate that it cannot make;
    /// [`DeviceError::ReadBack`]; [`DeviceError::State`] while streaming.
    fn test_pattern(
        &mut self,
        pattern: Option<TestPattern>,
    ) -> Result<Option<PatternScan>, DeviceError> {
        match pattern {
            None => Ok(None),
            Some(_) => Err(DeviceError::Refused {
                role: DeviceRole::of_camera(self.camera()),
                serial: self.identity().serial,
                expected: "a camera that makes events by itself".to_owned(),
                found: self.identity().model,
            }),
        }
    }
}
