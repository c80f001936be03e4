//! The `EventCamera` trait, its settings and capabilities.

use std::collections::BTreeMap;

use skinrig_model::{CameraId, DeviceIdentity, DeviceRole, RawChunk, Setting, StreamFormat};

use crate::DeviceError;

/// Capabilities of a camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CameraCapabilities {
    /// Width in pixels.
    pub width: u16,
    /// Height in pixels.
    pub height: u16,
    /// Format of the byte stream.
    pub format: StreamFormat,
    /// Available trigger input channels.
    pub trigger_channels: Vec<u8>,
    /// Names of the biases.
    pub biases: Vec<String>,
}

/// A rectangle of active pixels.
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

/// Source of a camera's time base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SyncMode {
    /// Its own clock.
    #[default]
    Standalone,
    /// Its own clock, which it also sends to others on the sync line. Started after its slaves.
    Master,
    /// The clock on the sync line. Started before the master.
    Slave,
}

/// A filter that passes events only while the sensor's total rate is above a threshold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoiseFilter {
    /// Threshold in events per second of the whole sensor.
    pub min_rate_ev_s: u32,
}

/// Settings of a camera, written before it starts. Unset ones keep the device's default.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CameraSettings {
    /// Source of the time base.
    pub sync: SyncMode,
    /// The sensor's noise filter; off if `None`.
    pub noise_filter: Option<NoiseFilter>,
    /// Bias values by name, in the device's unit.
    pub biases: BTreeMap<String, i64>,
    /// Active pixels; all if `None`.
    pub roi: Option<Roi>,
    /// Trigger input channels to enable.
    pub trigger_channels: Vec<u8>,
}

/// A test pattern that the camera generates in place of pixel events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestPattern {
    /// Requested rate, events per second.
    pub rate_ev_s: f64,
}

/// Scan of a test pattern: all pixels down each column, from the first column to the last, repeatedly, at a constant rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatternScan {
    /// Actual rate in events per second of the camera's clock, the nearest to the requested one.
    pub rate_ev_s: f64,
    /// Columns of the scan; may exceed the sensor's.
    pub columns: u16,
    /// Rows of the scan; may exceed the sensor's.
    pub rows: u16,
}

/// Bytes per word of every stream format, or a multiple of it.
const WORD_BYTES: usize = 4;

/// The last whole words of a chunk, at most `most` bytes.
#[must_use]
pub fn newest_words(chunk: &[u8], most: usize) -> Vec<u8> {
    let end = chunk.len() / WORD_BYTES * WORD_BYTES;
    let begin = end.saturating_sub(most).div_ceil(WORD_BYTES) * WORD_BYTES;
    chunk[begin..end].to_vec()
}

/// Bytes of the chunk that a camera is filling.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OpenChunk {
    /// Number that the chunk will have.
    pub seq: u64,
    /// Position of the first of `bytes` in the chunk.
    pub from: usize,
    /// Bytes lost before the chunk.
    pub lost_before: u64,
    /// Whole words. The chunk will hold the same bytes at this position, unless a gap in their times splits it.
    pub bytes: Vec<u8>,
}

impl OpenChunk {
    /// The whole words of an open chunk from `from` on; `None` without any.
    #[must_use]
    pub fn of(seq: u64, lost_before: u64, chunk: &[u8], from: usize) -> Option<Self> {
        let end = chunk.len() / WORD_BYTES * WORD_BYTES;
        let bytes = chunk.get(from..end).filter(|b| !b.is_empty())?;
        Some(Self {
            seq,
            from,
            lost_before,
            bytes: bytes.to_vec(),
        })
    }
}

/// A source of raw event bytes.
///
/// States: stopped -> [`start`](Self::start) -> streaming -> [`stop`](Self::stop) -> stopped.
/// Chunk numbers continue through stop and start. Bytes are never changed, reordered or silently dropped: losses are counted in
/// `lost_before` of the next chunk.
pub trait EventCamera: Send {
    /// Camera 1 or 2.
    fn camera(&self) -> CameraId;

    /// Model, serial number and firmware.
    fn identity(&self) -> DeviceIdentity;

    /// Capabilities.
    fn capabilities(&self) -> CameraCapabilities;

    /// Writes settings and reads them back. Only while stopped.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] for unknown biases, channels or pixels, before anything is written; [`DeviceError::ReadBack`];
    /// [`DeviceError::State`] while streaming.
    fn configure(&mut self, settings: &CameraSettings) -> Result<Vec<Setting>, DeviceError>;

    /// Starts streaming.
    ///
    /// # Errors
    /// [`DeviceError::State`] while streaming; [`DeviceError::Lost`].
    fn start(&mut self) -> Result<(), DeviceError>;

    /// Appends the chunks completed since the last call.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]; chunks already appended stay valid.
    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError>;

    /// Like [`poll`](Self::poll), but also closes the current chunk, so that all data up to now is returned.
    ///
    /// # Errors
    /// As [`poll`](Self::poll). [`DeviceError::Pending`] if the camera needs longer: call again. The first call that does not return
    /// `Pending` has returned all data up to the first of these calls.
    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError>;

    /// Flushes and stops. Allowed in every state, any number of times.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]; chunks already appended stay valid.
    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError>;

    /// A copy of the newest bytes that are in no chunk yet, whole words, at most `most` bytes: for a look at what is happening. They are also
    /// part of the next chunk. `None` if the camera does not offer them, or needs longer: call again. The default does not.
    fn newest(&mut self, _most: usize) -> Option<Vec<u8>> {
        None
    }

    /// A copy of the bytes from position `from` on of the chunk that is being filled, for what cannot wait until it is complete. `None`
    /// if there are none, if the camera does not offer them, or needs longer: call again. The default does not.
    fn open_chunk(&mut self, _from: usize) -> Option<OpenChunk> {
        None
    }

    /// Appends notes about events that the bytes do not show since the last call: bytes without a time discarded at the start, jumps of the
    /// time base, overflows counted by the camera. The default has none.
    fn take_notes(&mut self, _notes: &mut Vec<String>) {}

    /// Current temperature, °C; the implementation documents where it is measured. `None` if the camera has no sensor: the caller then stops
    /// asking. Allowed in every state, at most once a second because it may need a request to the device.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] if a camera with a sensor does not respond; [`DeviceError::Pending`] if it needs longer.
    fn temperature_c(&mut self) -> Result<Option<f64>, DeviceError> {
        Ok(None)
    }

    /// Replaces pixel events by a test pattern from the next start on; `None` and [`configure`](Self::configure) restore the pixels. Only
    /// while stopped. Returns the scan, or `None` for pixels.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] without a generator, or for an unsupported rate;
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
                expected: "a camera with a test pattern generator".to_owned(),
                found: self.identity().model,
            }),
        }
    }
}
