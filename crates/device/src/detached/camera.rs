//! A camera on a thread of its own.

use std::sync::mpsc::{self, Receiver, Sender};

use skinrig_model::{CameraId, DeviceIdentity, DeviceRole, RawChunk, Setting};

use super::{Call, Calls, Patience, Worker};
use crate::{
    CameraCapabilities, CameraSettings, Clock, DeviceError, EventCamera, PatternScan, TestPattern,
};

type Device = Box<dyn EventCamera>;
type Answer<T> = Result<T, DeviceError>;

/// An [`EventCamera`] whose calls are carried out on a thread of its own. Chunks come at the look after the one that asked for them.
pub struct DetachedCamera {
    camera: CameraId,
    capabilities: CameraCapabilities,
    worker: Worker<Device>,
    /// What calls handed over, in order.
    chunks: Receiver<RawChunk>,
    hand_over: Sender<RawChunk>,
    poll: Option<Call<Answer<()>>>,
    flush: Option<Call<Answer<()>>>,
    temperature: Option<Call<Answer<Option<f64>>>>,
    notes: Vec<String>,
}

impl DetachedCamera {
    /// Takes a stopped camera to a thread of its own.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] when there is no thread to be had.
    pub fn new(
        device: Device,
        clock: Box<dyn Clock>,
        patience: Patience,
    ) -> Result<Self, DeviceError> {
        let (camera, capabilities) = (device.camera(), device.capabilities());
        let role = DeviceRole::of_camera(camera);
        let worker = Worker::start(role, device.identity(), device, clock, patience)?;
        let (hand_over, chunks) = mpsc::channel();
        Ok(Self {
            camera,
            capabilities,
            worker,
            chunks,
            hand_over,
            poll: None,
            flush: None,
            temperature: None,
            notes: Vec::new(),
        })
    }

    /// The calls that it has not answered.
    #[must_use]
    pub fn calls(&self) -> Calls {
        self.worker.calls.clone()
    }

    /// A call of `fetch`, which hands over chunks.
    fn fetching(
        &self,
        fetch: fn(&mut dyn EventCamera, &mut Vec<RawChunk>) -> Answer<()>,
    ) -> impl FnOnce(&mut Device) -> Answer<()> + use<> {
        let hand_over = self.hand_over.clone();
        move |device| {
            let mut chunks = Vec::new();
            let answer = fetch(device.as_mut(), &mut chunks);
            for chunk in chunks {
                // Nobody is left to take it when this fails.
                let _ = hand_over.send(chunk);
            }
            answer
        }
    }
}

impl EventCamera for DetachedCamera {
    fn camera(&self) -> CameraId {
        self.camera
    }

    fn identity(&self) -> DeviceIdentity {
        self.worker.identity.clone()
    }

    fn capabilities(&self) -> CameraCapabilities {
        self.capabilities.clone()
    }

    fn configure(&mut self, settings: &CameraSettings) -> Answer<Vec<Setting>> {
        let settings = settings.clone();
        self.worker
            .wait("configure", move |d| d.configure(&settings))?
    }

    fn start(&mut self) -> Answer<()> {
        self.worker.wait("start", |d| d.start())?
    }

    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Answer<()> {
        let answer = self.worker.answer(&mut self.poll);
        // Also what came before a call failed.
        chunks.extend(self.chunks.try_iter());
        let answer = answer?;
        if self.poll.is_none() {
            let fetch = self.fetching(|d, chunks| d.poll(chunks));
            let within = self.worker.patience.running;
            self.poll = Some(self.worker.ask("poll", within, fetch)?);
        }
        answer.unwrap_or(Ok(()))
    }

    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Answer<()> {
        if self.flush.is_none() {
            let fetch = self.fetching(|d, chunks| d.flush(chunks));
            let within = self.worker.patience.running;
            self.flush = Some(self.worker.ask("flush", within, fetch)?);
        }
        let answer = self.worker.answer(&mut self.flush);
        chunks.extend(self.chunks.try_iter());
        match answer? {
            Some(answer) => answer,
            None => Err(self.worker.pending("flush")),
        }
    }

    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Answer<()> {
        let stop = self.fetching(|d, chunks| d.stop(chunks));
        let stopped = self.worker.wait("stop", |d| {
            let answer = stop(d);
            let mut notes = Vec::new();
            d.take_notes(&mut notes);
            (answer, notes)
        });
        chunks.extend(self.chunks.try_iter());
        let (answer, notes) = stopped?;
        self.notes.extend(notes);
        // They were answered before: their chunks are among those that came.
        (self.poll, self.flush) = (None, None);
        answer
    }

    /// What was noticed up to the last stop.
    fn take_notes(&mut self, notes: &mut Vec<String>) {
        notes.append(&mut self.notes);
    }

    /// The answer to the call before, at most as old as that.
    fn temperature_c(&mut self) -> Answer<Option<f64>> {
        let answer = self.worker.answer(&mut self.temperature)?;
        if self.temperature.is_none() {
            let within = self.worker.patience.running;
            let call = |d: &mut Device| d.temperature_c();
            self.temperature = Some(self.worker.ask("temperature", within, call)?);
        }
        answer.unwrap_or_else(|| Err(self.worker.pending("temperature")))
    }

    fn test_pattern(&mut self, pattern: Option<TestPattern>) -> Answer<Option<PatternScan>> {
        self.worker
            .wait("test pattern", move |d| d.test_pattern(pattern))?
    }
}
