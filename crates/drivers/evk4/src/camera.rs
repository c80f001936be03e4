//! Adapter from a link to an `EventCamera`.

use std::mem;

use skinrig_device::{
    CameraCapabilities, CameraSettings, Clock, DeviceError, EventCamera, OpenChunk, newest_words,
};
use skinrig_formats::Scanner;
use skinrig_model::{
    CameraId, DeviceIdentity, DeviceRole, HostDuration, HostTime, RawChunk, Setting, StreamFormat,
};

use crate::link::{Link, LinkError, Packets};
use crate::model::Model;
use crate::stream_settings::StreamSettings;

/// Chunk size, bytes.
const CHUNK_BYTES: usize = 1 << 20;

/// A camera that sends EVT3 words.
pub struct Evt3Camera {
    model: Model,
    camera: CameraId,
    serial: String,
    link: Box<dyn Link>,
    clock: Box<dyn Clock>,
    settings: StreamSettings,
    stream: Option<Box<dyn Packets>>,
    scanner: Scanner,
    filling: PartialChunk,
}

/// The current chunk.
#[derive(Default)]
struct PartialChunk {
    seq: u64,
    bytes: Vec<u8>,
    arrived: HostTime,
    lost_before: u64,
    /// Dropped packets already counted.
    dropped: u64,
}

impl Evt3Camera {
    /// The camera with this model and serial number behind `link`; it is opened at every start. Data is stamped with `clock`.
    #[must_use]
    pub fn new(
        model: Model,
        link: Box<dyn Link>,
        serial: &str,
        camera: CameraId,
        clock: Box<dyn Clock>,
    ) -> Self {
        Self {
            model,
            camera,
            serial: serial.to_owned(),
            link,
            clock,
            settings: StreamSettings::default(),
            stream: None,
            scanner: Scanner::with_geometry(StreamFormat::Evt3, model.geometry()),
            filling: PartialChunk::default(),
        }
    }

    fn role(&self) -> DeviceRole {
        DeviceRole::of_camera(self.camera)
    }

    fn lost(&mut self, error: &LinkError) -> DeviceError {
        self.stream = None;
        DeviceError::Lost {
            role: self.role(),
            serial: self.serial.clone(),
            detail: error.to_string(),
        }
    }

    fn expect_stopped(&self) -> Result<(), DeviceError> {
        if self.stream.is_none() {
            return Ok(());
        }
        Err(DeviceError::State {
            role: self.role(),
            serial: self.serial.clone(),
            expected: "stopped".into(),
            found: "streaming".into(),
        })
    }

    /// Takes all available packets.
    fn catch_up(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        let Some(mut stream) = self.stream.take() else {
            return Ok(());
        };
        let now = self.clock.now();
        let most = self.link.packet_bytes() as u64;
        loop {
            let mut bytes = Vec::new();
            let mut arrived = now;
            let mut after_loss = false;
            let more = stream.next(&mut |packet| {
                bytes.extend_from_slice(packet.bytes);
                let age = i64::try_from(packet.age.as_nanos()).unwrap_or(i64::MAX);
                arrived = now - HostDuration(age);
                after_loss = packet.after_loss;
            });
            match more {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    self.close(chunks);
                    self.report_last_loss(stream.dropped(), chunks);
                    return Err(self.lost(&error));
                }
            }
            if after_loss {
                self.close(chunks);
                let fresh = self.newly_dropped(stream.dropped()).max(1);
                // An upper bound: the size of dropped packets is unknown.
                self.filling.lost_before = fresh * most;
            }
            // Packets may have the same time stamp, but never an earlier one.
            self.filling.arrived = self.filling.arrived.max(arrived);
            self.filling.bytes.append(&mut bytes);
            if self.filling.bytes.len() >= CHUNK_BYTES {
                self.close(chunks);
            }
        }
        self.stream = Some(stream);
        Ok(())
    }

    /// Number of the `dropped` packets that were not counted yet; counts them.
    fn newly_dropped(&mut self, dropped: u64) -> u64 {
        let counted = mem::replace(&mut self.filling.dropped, dropped);
        dropped.saturating_sub(counted)
    }

    /// At the end of a stream with `dropped` dropped packets: reports those after the last received one in a chunk without bytes.
    fn report_last_loss(&mut self, dropped: u64, chunks: &mut Vec<RawChunk>) {
        let fresh = self.newly_dropped(dropped);
        if fresh > 0 {
            self.filling.lost_before = fresh * self.link.packet_bytes() as u64;
            self.filling.arrived = self.filling.arrived.max(self.clock.now());
            self.close(chunks);
        }
    }

    /// Closes the current chunk if it has content.
    fn close(&mut self, chunks: &mut Vec<RawChunk>) {
        if self.filling.bytes.is_empty() && self.filling.lost_before == 0 {
            return;
        }
        let bytes = mem::take(&mut self.filling.bytes);
        self.scanner.lost(self.filling.lost_before);
        let (facts, triggers) = self.scanner.push(&bytes);
        chunks.push(RawChunk {
            camera: self.camera,
            seq: self.filling.seq,
            host_time: self.filling.arrived,
            lost_before: mem::take(&mut self.filling.lost_before),
            lost_from_us: None,
            bytes,
            facts,
            triggers,
        });
        self.filling.seq += 1;
    }
}

impl EventCamera for Evt3Camera {
    fn camera(&self) -> CameraId {
        self.camera
    }

    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            model: self.model.name().into(),
            serial: self.serial.clone(),
            firmware: "unknown: not reported by the driver crate".into(),
        }
    }

    fn capabilities(&self) -> CameraCapabilities {
        let sensor = self.model.geometry();
        let owned = |name: &&str| (*name).to_owned();
        CameraCapabilities {
            width: sensor.width,
            height: sensor.height,
            format: StreamFormat::Evt3,
            trigger_channels: self.model.trigger_channels().to_vec(),
            biases: self.model.biases().iter().map(owned).collect(),
        }
    }

    fn configure(&mut self, settings: &CameraSettings) -> Result<Vec<Setting>, DeviceError> {
        self.expect_stopped()?;
        let settings = StreamSettings::new(self.model, settings);
        self.settings = settings.map_err(|e| DeviceError::Refused {
            role: self.role(),
            serial: self.serial.clone(),
            expected: e.expected,
            found: e.found,
        })?;
        Ok(self.settings.settings())
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        self.expect_stopped()?;
        let opened = self.link.stream(&self.settings);
        self.stream = Some(opened.map_err(|e| self.lost(&e))?);
        // A new stream does not continue the words of the previous one, and its time restarts.
        self.scanner = Scanner::with_geometry(StreamFormat::Evt3, self.model.geometry());
        self.filling.dropped = 0;
        Ok(())
    }

    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.catch_up(chunks)
    }

    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        let caught_up = self.catch_up(chunks);
        self.close(chunks);
        caught_up
    }

    fn newest(&mut self, most: usize) -> Option<Vec<u8>> {
        Some(newest_words(&self.filling.bytes, most))
    }

    fn open_chunk(&mut self, from: usize) -> Option<OpenChunk> {
        let filling = &self.filling;
        OpenChunk::of(filling.seq, filling.lost_before, &filling.bytes, from)
    }

    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        let flushed = self.flush(chunks);
        if let Some(stream) = self.stream.take() {
            self.report_last_loss(stream.dropped(), chunks);
        }
        flushed
    }
}
