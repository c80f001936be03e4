//! From the events of both cameras to what is felt: detector and position in one place.

use std::collections::VecDeque;

use serde::Serialize;
use skinrig_analysis::locator::LocatorModelError;
use skinrig_analysis::segment::{IDLE_US, MIN_IDLE_US};
use skinrig_model::{CameraId, CdEvent};

use crate::depth::DepthModel;
use crate::detector::{Detection, Detector, Felt, UnusableClock};
use crate::position::{Opening, Position, PositionEstimator};
use crate::settling::Settling;
use crate::skin_model::SkinModel;

/// Events of a camera that wait for the other one: 32 MiB.
const MOST_WAITING: usize = 1 << 21;

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

/// How touches are reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamSettings {
    /// Host time between two positions of a touch, µs; above 0.
    pub every_us: i64,
    /// Host time from which events count, µs.
    pub from_us: i64,
}

/// Why there is no estimator.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StreamError {
    /// The cameras have no common time.
    #[error(transparent)]
    Clock(#[from] UnusableClock),
    /// The locator of the analysis cannot be rebuilt.
    #[error("the locator of the analysis: {0}")]
    Locator(#[from] LocatorModelError),
}

/// A camera sends, and the other one does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, thiserror::Error)]
#[error(
    "{MOST_WAITING} events of {camera} wait for the other camera, which has sent nothing later than {reached_us} µs"
)]
pub struct CameraLeads {
    /// The camera that sends.
    pub camera: CameraId,
    /// Host time up to which both have sent, µs.
    pub reached_us: i64,
}

/// The estimator. Its answers depend on the events alone, not on how they are cut or in which order the cameras deliver them.
pub(crate) struct TouchStream {
    detector: Detector,
    positions: PositionEstimator,
    settling: Option<Settling>,
    depths: Option<DepthModel>,
    /// Events of each camera that the detector has not taken yet,
    waiting: [VecDeque<CdEvent>; 2],
    /// and time before which it has sent everything, camera µs.
    newest_us: [u64; 2],
    before_us: i64,
    longest_window_us: Option<i64>,
    every_us: i64,
    touch: Option<OpenTouch>,
    /// Host time since which no touch is felt, µs.
    idle_since_us: i64,
    decisions: Vec<Detection>,
}

/// A touch that is felt. Host times, µs.
#[derive(Debug, Clone, Copy)]
struct OpenTouch {
    next_us: i64,
    /// End of its window.
    end_us: i64,
}

impl TouchStream {
    /// On an idle skin.
    ///
    /// # Errors
    /// [`StreamError`]: see there.
    pub(crate) fn new(skin: &SkinModel, settings: StreamSettings) -> Result<Self, StreamError> {
        let StreamSettings { every_us, from_us } = settings;
        Ok(Self {
            detector: Detector::new(&skin.touches, &skin.clocks, skin.threshold, from_us)?,
            positions: skin.positions()?,
            settling: skin.settling.clone(),
            depths: skin.depths.clone(),
            waiting: Default::default(),
            newest_us: [0; 2],
            before_us: (skin.settings.window_before_ms * 1e3) as i64,
            longest_window_us: skin.longest_window_us,
            every_us: every_us.max(1),
            touch: None,
            idle_since_us: from_us,
            decisions: Vec::with_capacity(64),
        })
    }

    /// Takes the next events of a camera, which has sent everything before `newest_us` (camera time), and passes every new estimate
    /// to `each`.
    ///
    /// # Errors
    /// [`CameraLeads`] if too many events wait for the other camera; the newest ones of this camera are dropped then.
    pub(crate) fn push(
        &mut self,
        camera: CameraId,
        events: &[CdEvent],
        newest_us: Option<u64>,
        each: impl FnMut(Estimate),
    ) -> Result<(), CameraLeads> {
        let k = camera.index();
        self.positions.push(camera, events);
        let decisions = &mut self.decisions;
        let taken = if self.waiting[k].is_empty() {
            self.detector.push(camera, events, |d| decisions.push(d))
        } else {
            0
        };
        let room = MOST_WAITING.saturating_sub(self.waiting[k].len());
        let rest = &events[taken..];
        self.waiting[k].extend(&rest[..rest.len().min(room)]);
        self.newest_us[k] = newest_us.unwrap_or(0).max(self.newest_us[k]);
        self.join();
        self.report(each);
        if rest.len() > room {
            let reached_us = self.detector.now_us();
            return Err(CameraLeads { camera, reached_us });
        }
        Ok(())
    }

    /// Brings the detector as far as both cameras reach.
    fn join(&mut self) {
        let decisions = &mut self.decisions;
        loop {
            let (mut taken, before_us) = (0, self.detector.now_us());
            for camera in CameraId::ALL {
                let waiting = &mut self.waiting[camera.index()];
                let reached = waiting
                    .front()
                    .map_or(self.newest_us[camera.index()], |e| e.t_us);
                self.detector
                    .promise(camera, reached, |d| decisions.push(d));
                let more = self
                    .detector
                    .push(camera, waiting.as_slices().0, |d| decisions.push(d));
                waiting.drain(..more);
                taken += more;
            }
            if taken == 0 && self.detector.now_us() == before_us {
                return;
            }
        }
    }

    /// Ends the streams.
    pub(crate) fn finish(&mut self, each: impl FnMut(Estimate)) {
        let decisions = &mut self.decisions;
        self.detector.finish(|d| decisions.push(d));
        self.report(each);
    }

    /// The detector.
    pub(crate) const fn detector(&self) -> &Detector {
        &self.detector
    }

    fn report(&mut self, mut each: impl FnMut(Estimate)) {
        let mut decisions = std::mem::take(&mut self.decisions);
        for decision in decisions.drain(..) {
            self.positions_until(decision.host_us, &mut each);
            each(Estimate::Felt(decision));
            match decision.felt {
                Felt::Onset => {
                    self.open(decision.since_us - self.before_us);
                    self.touch = Some(OpenTouch {
                        next_us: decision.host_us,
                        end_us: self
                            .longest_window_us
                            .map_or(i64::MAX, |us| decision.since_us.saturating_add(us)),
                    });
                }
                Felt::Withdrawn | Felt::Release => {
                    self.positions.close();
                    self.touch = None;
                    self.idle_since_us = decision.host_us;
                }
            }
        }
        self.decisions = decisions;
        self.positions_until(self.detector.now_us(), &mut each);
    }

    /// Opens a window that begins at this host time; the idle time before it is as long as an analysis takes it, but begins after the
    /// touch before.
    fn open(&mut self, from_us: i64) {
        let idle_us = (from_us - IDLE_US as i64).max(self.idle_since_us);
        let idle_us = if from_us - idle_us >= MIN_IDLE_US as i64 {
            idle_us
        } else {
            from_us
        };
        let [idle, from] = [idle_us, from_us].map(|t| self.detector.camera_us(t));
        self.positions.open([0, 1].map(|k| Opening {
            idle_us: idle[k],
            from_us: from[k],
        }));
    }

    fn positions_until(&mut self, host_us: i64, each: &mut impl FnMut(Estimate)) {
        while let Some(touch) = self.touch.filter(|t| t.next_us <= host_us) {
            let host_us = touch.next_us;
            let position = self.position(host_us.min(touch.end_us));
            each(Estimate::Position { host_us, position });
            let next_us = host_us + self.every_us;
            self.touch = Some(OpenTouch { next_us, ..touch });
        }
    }

    fn position(&mut self, at_us: i64) -> Position {
        let until_us = self.detector.camera_us(at_us);
        let position = self.positions.position(until_us);
        let last = self.positions.last_region(&position);
        let region = |settling: &Settling| settling.region(last?, position.clustered);
        let located = position.location.filter(|_| position.complete);
        let depth = |depths: &DepthModel| depths.reached(located?.at, position.rising);
        Position {
            region: self.settling.as_ref().and_then(region),
            depth: self.depths.as_ref().and_then(depth),
            ..position
        }
    }
}
