//! A camera of one of the models as an event camera.

use std::mem;

use skinrig_device::{CameraCapabilities, CameraSettings, Clock, DeviceError, EventCamera};
use skinrig_formats::Scanner;
use skinrig_model::{
    CameraId, DeviceIdentity, DeviceRole, HostDuration, HostTime, RawChunk, Setting, StreamFormat,
};

use crate::link::{Link, LinkError, Packets};
use crate::model::Model;
use crate::wanted::Wanted;

/// A full chunk, bytes.
const CHUNK_BYTES: usize = 1 << 20;

/// A camera that sends EVT3 words.
pub struct Evt3Camera {
    model: Model,
    camera: CameraId,
    serial: String,
    link: Box<dyn Link>,
    clock: Box<dyn Clock>,
    wanted: Wanted,
    stream: Option<Box<dyn Packets>>,
    scanner: Scanner,
    filling: Filling,
}

/// The chunk under way.
#[derive(Default)]
struct Filling {
    seq: u64,
    bytes: Vec<u8>,
    arrived: HostTime,
    lost_before: u64,
    /// Packets dropped that have been counted.
    dropped: u64,
}

impl Evt3Camera {
    /// The camera of this model and serial number behind `link`; it is opened at every start. What it sends is stamped on `clock`.
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
            wanted: Wanted::default(),
            stream: None,
            scanner: Scanner::with_geometry(StreamFormat::Evt3, model.geometry()),
            filling: Filling::default(),
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

    /// Takes every packet that is there.
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
                    self.tell_last_loss(stream.dropped(), chunks);
                    return Err(self.lost(&error));
                }
            }
            if after_loss {
                self.close(chunks);
                let fresh = self.freshly_dropped(stream.dropped()).max(1);
                // At most: how many bytes they held is not known.
                self.filling.lost_before = fresh * most;
            }
            // Two packets may be stamped in the same moment, never back.
            self.filling.arrived = self.filling.arrived.max(arrived);
            self.filling.bytes.append(&mut bytes);
            if self.filling.bytes.len() >= CHUNK_BYTES {
                self.close(chunks);
            }
        }
        self.stream = Some(stream);
        Ok(())
    }

    /// How many of the `dropped` packets have not been counted yet; counts them.
    fn freshly_dropped(&mut self, dropped: u64) -> u64 {
        let counted = mem::replace(&mut self.filling.dropped, dropped);
        dropped.saturating_sub(counted)
    }

    /// At the end of a stream, of which `dropped` packets were dropped: those after the last one that arrived are told
    /// by a chunk without bytes.
    fn tell_last_loss(&mut self, dropped: u64, chunks: &mut Vec<RawChunk>) {
        let fresh = self.freshly_dropped(dropped);
        if fresh > 0 {
            self.filling.lost_before = fresh * self.link.packet_bytes() as u64;
            self.filling.arrived = self.filling.arrived.max(self.clock.now());
            self.close(chunks);
        }
    }

    /// Closes the chunk under way, when there is anything to say.
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
            firmware: "unknown: the driver crate does not tell".into(),
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
        let wanted = Wanted::new(self.model, settings);
        self.wanted = wanted.map_err(|(expected, found)| DeviceError::Refused {
            role: self.role(),
            serial: self.serial.clone(),
            expected,
            found,
        })?;
        Ok(self.wanted.settings())
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        self.expect_stopped()?;
        let opened = self.link.stream(&self.wanted);
        self.stream = Some(opened.map_err(|e| self.lost(&e))?);
        // A new stream: its words do not continue those of the last one, and its time begins anew.
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

    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        let flushed = self.flush(chunks);
        if let Some(stream) = self.stream.take() {
            self.tell_last_loss(stream.dropped(), chunks);
        }
        flushed
    }
}
