//! The estimator of a running recording: it decodes from the start, and feels touches once it has learnt a skin.

use skinrig_model::{CameraId, StreamFormat};

use crate::live::{Decoders, Live};
use crate::skin_model::SkinModel;
use crate::stream::{CameraLeads, Estimate, StreamError, StreamSettings};

/// Bytes of both cameras in, estimates out.
pub(crate) struct RunEstimator {
    state: State,
    every_us: i64,
}

enum State {
    /// No skin is learnt yet: only the time of the streams is followed.
    Decoding(Box<Decoders>),
    Feeling(Box<(Live, SkinModel)>),
    /// A step failed.
    Failed,
}

impl RunEstimator {
    /// For cameras that send these formats; positions of a touch come every so many µs of host time.
    pub(crate) fn new(formats: [StreamFormat; 2], every_us: i64) -> Self {
        Self {
            state: State::Decoding(Box::new(Decoders::new(formats))),
            every_us,
        }
    }

    /// Feels on an idle skin from the bytes that follow.
    ///
    /// # Errors
    /// [`StreamError`]; then nothing is felt.
    pub(crate) fn start(&mut self, skin: SkinModel) -> Result<(), StreamError> {
        let decoders = match std::mem::replace(&mut self.state, State::Failed) {
            State::Decoding(decoders) => decoders,
            State::Feeling(both) => Box::new(both.0.into_decoders()),
            State::Failed => return Ok(()),
        };
        let host_us = |camera: CameraId| {
            let newest_us = decoders.newest_us(camera).unwrap_or(0);
            skin.clocks()[camera.index()].host_us_of_camera(newest_us as f64) as i64
        };
        let settings = StreamSettings {
            every_us: self.every_us,
            from_us: host_us(CameraId::One).max(host_us(CameraId::Two)),
        };
        let live = Live::new(*decoders, &skin, settings)?;
        self.state = State::Feeling(Box::new((live, skin)));
        Ok(())
    }

    /// The next bytes of a camera, with `lost` bytes missing before them; every new estimate goes to `each`.
    ///
    /// # Errors
    /// [`CameraLeads`] if the other camera has long sent nothing: what waited for it was skipped, and the skin counts as idle.
    pub(crate) fn feed(
        &mut self,
        camera: CameraId,
        lost: u64,
        bytes: &[u8],
        mut each: impl FnMut(&SkinModel, Estimate),
    ) -> Result<(), CameraLeads> {
        match &mut self.state {
            State::Failed => Ok(()),
            State::Decoding(decoders) => {
                if lost > 0 {
                    decoders.lost(camera, lost);
                }
                decoders.decode(camera, bytes);
                Ok(())
            }
            State::Feeling(both) => {
                let (live, skin) = both.as_mut();
                if lost > 0 {
                    live.lost(camera, lost);
                }
                live.push(camera, bytes, |e| each(skin, e)).map(drop)
            }
        }
    }

    /// Bytes of both cameras were skipped: the skin counts as idle from the bytes that follow.
    ///
    /// # Errors
    /// [`StreamError`]; then nothing is felt any more.
    pub(crate) fn skip(&mut self, bytes: [u64; 2]) -> Result<(), StreamError> {
        for camera in CameraId::ALL {
            let lost = bytes[camera.index()];
            match &mut self.state {
                State::Decoding(decoders) if lost > 0 => decoders.lost(camera, lost),
                State::Feeling(both) if lost > 0 => both.0.lost(camera, lost),
                _ => {}
            }
        }
        match &self.state {
            State::Feeling(both) => self.start(both.1.clone()),
            State::Decoding(_) | State::Failed => Ok(()),
        }
    }

    /// Host time up to which both cameras have sent everything, µs; `None` before anything is felt.
    pub(crate) fn reached_us(&self) -> Option<i64> {
        match &self.state {
            State::Feeling(both) => Some(both.0.detector().now_us()),
            State::Decoding(_) | State::Failed => None,
        }
    }
}
