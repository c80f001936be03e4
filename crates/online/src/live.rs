//! From the bytes of both cameras to what is felt: decoder, detector and position in one place.

use serde::Serialize;
use skinrig_analysis::Analysis;
use skinrig_analysis::locator::LocatorModelError;
use skinrig_analysis::result::ClockFit;
use skinrig_formats::{Decoder, Geometry};
use skinrig_model::{CameraId, CdEvent, StreamFormat};

use crate::detector::{Detection, Detector, Felt, UnusableClock};
use crate::model::TouchModel;
use crate::position::{Position, PositionEstimator};

/// Most events of a packet that are kept between two packets, before the vector grows.
const PACKET: usize = 1 << 16;

/// Something new.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Estimate {
    /// A touch began, was withdrawn or ended.
    Felt(Detection),
    /// Where the touch is, by the events before this host time, µs.
    Position {
        /// Host time, µs.
        host_us: i64,
        /// The position.
        position: Position,
    },
}

/// How positions are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveSettings {
    /// Threshold of the detector, nats.
    pub threshold: f64,
    /// Host time between two positions of a touch, µs; above 0.
    pub every_us: i64,
    /// Host time from which events count, µs.
    pub from_us: i64,
}

/// Why there is no estimator.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LiveError {
    /// The cameras have no common time.
    #[error(transparent)]
    Clock(#[from] UnusableClock),
    /// The locator of the analysis cannot be rebuilt.
    #[error("the locator of the analysis: {0}")]
    Locator(#[from] LocatorModelError),
}

/// A camera leads the other by more than the detector can hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{camera} is more than 128 ms ahead of the other camera; deliver their bytes in turn")]
pub struct CameraLeads {
    /// Camera.
    pub camera: CameraId,
}

/// The whole estimator. Its answers depend on the bytes alone, not on how they are cut.
pub struct Live {
    decoders: [Decoder; 2],
    detector: Detector,
    positions: PositionEstimator,
    before_us: i64,
    every_us: i64,
    /// Host time of the next position of the touch.
    next_us: Option<i64>,
    packet: Vec<CdEvent>,
    decisions: Vec<Detection>,
}

impl Live {
    /// For cameras that send these formats, with the settings and locator of an analysis.
    ///
    /// # Errors
    /// [`LiveError`]: see there.
    pub fn new(
        formats: [StreamFormat; 2],
        analysis: &Analysis,
        model: &TouchModel,
        clocks: &[ClockFit; 2],
        settings: LiveSettings,
    ) -> Result<Self, LiveError> {
        let LiveSettings {
            threshold,
            every_us,
            from_us,
        } = settings;
        Ok(Self {
            decoders: formats.map(|f| Decoder::with_geometry(f, Geometry::ANY)),
            detector: Detector::new(model, clocks, threshold, from_us)?,
            positions: PositionEstimator::of(analysis)?,
            before_us: (analysis.settings.window_before_ms * 1e3) as i64,
            every_us: every_us.max(1),
            next_us: None,
            packet: Vec::with_capacity(PACKET),
            decisions: Vec::with_capacity(64),
        })
    }

    /// Notes that bytes of a camera were lost.
    pub fn lost(&mut self, camera: CameraId, bytes: u64) {
        self.decoders[camera.index()].lost(bytes);
    }

    /// Decodes the next bytes of a camera and passes every new estimate to `each`; returns how many events they held.
    ///
    /// # Errors
    /// [`CameraLeads`] if some of them cannot be taken.
    pub fn push(
        &mut self,
        camera: CameraId,
        bytes: &[u8],
        each: impl FnMut(Estimate),
    ) -> Result<usize, CameraLeads> {
        let decoder = &mut self.decoders[camera.index()];
        let packet = &mut self.packet;
        packet.clear();
        decoder.for_each_slice(bytes, |events| packet.extend_from_slice(events));
        let newest_us = decoder.last_us();
        self.positions.push(camera, &self.packet);
        let decisions = &mut self.decisions;
        let taken = self
            .detector
            .push(camera, &self.packet, |d| decisions.push(d));
        if taken < self.packet.len() {
            return Err(CameraLeads { camera });
        }
        if let Some(newest_us) = newest_us {
            self.detector
                .promise(camera, newest_us, |d| decisions.push(d));
        }
        self.report(each);
        Ok(taken)
    }

    /// Ends the streams.
    pub fn finish(&mut self, each: impl FnMut(Estimate)) {
        let decisions = &mut self.decisions;
        self.detector.finish(|d| decisions.push(d));
        self.report(each);
    }

    /// The detector.
    #[must_use]
    pub const fn detector(&self) -> &Detector {
        &self.detector
    }

    /// Events of the last packet.
    #[must_use]
    pub fn packet(&self) -> &[CdEvent] {
        &self.packet
    }

    /// Time of the newest word of a camera, µs.
    #[must_use]
    pub fn newest_us(&self, camera: CameraId) -> Option<u64> {
        self.decoders[camera.index()].last_us()
    }

    fn report(&mut self, mut each: impl FnMut(Estimate)) {
        let mut decisions = std::mem::take(&mut self.decisions);
        for decision in decisions.drain(..) {
            self.positions_until(decision.host_us, &mut each);
            each(Estimate::Felt(decision));
            match decision.felt {
                Felt::Onset => {
                    let from_us = self.detector.camera_us(decision.since_us - self.before_us);
                    self.positions.open(from_us);
                    self.next_us = Some(decision.host_us);
                }
                Felt::Withdrawn | Felt::Release => {
                    self.positions.close();
                    self.next_us = None;
                }
            }
        }
        self.decisions = decisions;
        self.positions_until(self.detector.now_us(), &mut each);
    }

    fn positions_until(&mut self, host_us: i64, each: &mut impl FnMut(Estimate)) {
        while let Some(next_us) = self.next_us.filter(|next| *next <= host_us) {
            let until_us = self.detector.camera_us(next_us);
            let position = self.positions.position(until_us);
            each(Estimate::Position {
                host_us: next_us,
                position,
            });
            self.next_us = Some(next_us + self.every_us);
        }
    }
}
