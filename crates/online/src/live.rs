//! From the bytes of both cameras to what is felt.

use skinrig_formats::{Decoder, Geometry};
use skinrig_model::{CameraId, CdEvent, StreamFormat};

use crate::detector::Detector;
use crate::skin_model::SkinModel;
use crate::stream::{CameraLeads, Estimate, StreamError, StreamSettings, TouchStream};

/// Most events of a packet that are kept between two packets, before the vector grows.
const PACKET: usize = 1 << 16;

/// Decoders of both cameras. They are fed from the start of a stream, so that they know its time.
pub struct Decoders {
    cameras: [Decoder; 2],
    packet: Vec<CdEvent>,
}

impl Decoders {
    /// For cameras that send these formats.
    #[must_use]
    pub fn new(formats: [StreamFormat; 2]) -> Self {
        Self {
            cameras: formats.map(|f| Decoder::with_geometry(f, Geometry::ANY)),
            packet: Vec::with_capacity(PACKET),
        }
    }

    /// Notes that bytes of a camera were lost.
    pub fn lost(&mut self, camera: CameraId, bytes: u64) {
        self.cameras[camera.index()].lost(bytes);
    }

    /// Decodes the next bytes of a camera.
    pub fn decode(&mut self, camera: CameraId, bytes: &[u8]) -> &[CdEvent] {
        let packet = &mut self.packet;
        packet.clear();
        self.cameras[camera.index()].for_each_slice(bytes, |e| packet.extend_from_slice(e));
        packet
    }

    /// Time of the newest word of a camera, µs.
    #[must_use]
    pub fn newest_us(&self, camera: CameraId) -> Option<u64> {
        self.cameras[camera.index()].last_us()
    }
}

/// The whole estimator. Its answers depend on the bytes alone, not on how they are cut.
pub struct Live {
    decoders: Decoders,
    stream: TouchStream,
}

impl Live {
    /// For the next bytes of these decoders.
    ///
    /// # Errors
    /// [`StreamError`]: see there.
    pub fn new(
        decoders: Decoders,
        skin: &SkinModel,
        settings: StreamSettings,
    ) -> Result<Self, StreamError> {
        let stream = TouchStream::new(skin, settings)?;
        Ok(Self { decoders, stream })
    }

    /// Notes that bytes of a camera were lost.
    pub fn lost(&mut self, camera: CameraId, bytes: u64) {
        self.decoders.lost(camera, bytes);
    }

    /// Decodes the next bytes of a camera and passes every new estimate to `each`; returns how many events they held.
    ///
    /// # Errors
    /// [`CameraLeads`] if too many events wait for the other camera.
    pub fn push(
        &mut self,
        camera: CameraId,
        bytes: &[u8],
        each: impl FnMut(Estimate),
    ) -> Result<usize, CameraLeads> {
        self.decoders.decode(camera, bytes);
        let newest_us = self.decoders.newest_us(camera);
        let packet = &self.decoders.packet;
        self.stream.push(camera, packet, newest_us, each)?;
        Ok(packet.len())
    }

    /// Ends the streams.
    pub fn finish(&mut self, each: impl FnMut(Estimate)) {
        self.stream.finish(each);
    }

    /// The detector.
    #[must_use]
    pub const fn detector(&self) -> &Detector {
        self.stream.detector()
    }

    /// Events of the last packet.
    #[must_use]
    pub fn packet(&self) -> &[CdEvent] {
        &self.decoders.packet
    }

    /// Time of the newest word of a camera, µs.
    #[must_use]
    pub fn newest_us(&self, camera: CameraId) -> Option<u64> {
        self.decoders.newest_us(camera)
    }

    /// The decoders, for a new estimator that continues their streams.
    #[must_use]
    pub fn into_decoders(self) -> Decoders {
        self.decoders
    }
}
