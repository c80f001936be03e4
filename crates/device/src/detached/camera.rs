//! A camera on a separate thread.

use std::sync::mpsc::{self, Receiver, Sender};

use skinrig_model::{CameraId, DeviceIdentity, DeviceRole, RawChunk, Setting};

use super::{Call, Calls, Timeouts, Worker};
use crate::{
    CameraCapabilities, CameraSettings, Clock, DeviceError, EventCamera, OpenChunk, PatternScan,
    TestPattern,
};

type Device = Box<dyn EventCamera>;
type Answer<T> = Result<T, DeviceError>;

/// An [`EventCamera`] whose calls run on a separate thread. Each poll returns the chunks fetched by the previous one.
pub struct DetachedCamera {
    camera: CameraId,
    capabilities: CameraCapabilities,
    worker: Worker<Device>,
    /// Chunks fetched by calls, in order.
    chunks: Receiver<RawChunk>,
    hand_over: Sender<RawChunk>,
    poll: Option<Call<Answer<()>>>,
    flush: Option<Call<Answer<()>>>,
    temperature: Option<Call<Answer<Option<f64>>>>,
    newest: Option<Call<Option<Vec<u8>>>>,
    open_chunk: Option<Call<Option<OpenChunk>>>,
    notes: Vec<String>,
}

impl DetachedCamera {
    /// Moves a stopped camera to a separate thread.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] if the thread cannot be started.
    pub fn new(
        device: Device,
        clock: Box<dyn Clock>,
        timeouts: Timeouts,
    ) -> Result<Self, DeviceError> {
        let (camera, capabilities) = (device.camera(), device.capabilities());
        let role = DeviceRole::of_camera(camera);
        let worker = Worker::start(role, device.identity(), device, clock, timeouts)?;
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
            newest: None,
            open_chunk: None,
            notes: Vec::new(),
        })
    }

    /// Number of unfinished calls.
    #[must_use]
    pub fn calls(&self) -> Calls {
        self.worker.calls.clone()
    }

    /// A call of `fetch` that forwards the chunks.
    fn fetching(
        &self,
        fetch: fn(&mut dyn EventCamera, &mut Vec<RawChunk>) -> Answer<()>,
    ) -> impl FnOnce(&mut Device) -> Answer<()> + use<> {
        let hand_over = self.hand_over.clone();
        move |device| {
            let mut chunks = Vec::new();
            let answer = fetch(device.as_mut(), &mut chunks);
            for chunk in chunks {
                // Sending fails only if the receiver is gone.
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
        // Chunks fetched before a call failed are valid too.
        chunks.extend(self.chunks.try_iter());
        let answer = answer?;
        if self.poll.is_none() {
            let fetch = self.fetching(|d, chunks| d.poll(chunks));
            let within = self.worker.timeouts.running;
            self.poll = Some(self.worker.request("poll", within, fetch)?);
        }
        answer.unwrap_or(Ok(()))
    }

    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Answer<()> {
        if self.flush.is_none() {
            let fetch = self.fetching(|d, chunks| d.flush(chunks));
            let within = self.worker.timeouts.running;
            self.flush = Some(self.worker.request("flush", within, fetch)?);
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
        // Earlier calls have finished: their chunks are included.
        (self.poll, self.flush) = (None, None);
        answer
    }

    /// Result of the previous call, once. A device that does not answer fails at the next poll.
    fn newest(&mut self, most: usize) -> Option<Vec<u8>> {
        let answer = self.worker.answer(&mut self.newest).ok()?;
        if self.newest.is_none() && answer.is_none() {
            let within = self.worker.timeouts.running;
            let call = move |d: &mut Device| d.newest(most);
            self.newest = self.worker.request("newest", within, call).ok();
        }
        answer?
    }

    /// Result of the previous call, once. A device that does not answer fails at the next poll.
    fn open_chunk(&mut self, from: usize) -> Option<OpenChunk> {
        let answer = self.worker.answer(&mut self.open_chunk).ok()?;
        if self.open_chunk.is_none() {
            let within = self.worker.timeouts.running;
            let call = move |d: &mut Device| d.open_chunk(from);
            self.open_chunk = self.worker.request("open chunk", within, call).ok();
        }
        answer?
    }

    /// Notes up to the last stop.
    fn take_notes(&mut self, notes: &mut Vec<String>) {
        notes.append(&mut self.notes);
    }

    /// Result of the previous call.
    fn temperature_c(&mut self) -> Answer<Option<f64>> {
        let answer = self.worker.answer(&mut self.temperature)?;
        if self.temperature.is_none() {
            let within = self.worker.timeouts.running;
            let call = |d: &mut Device| d.temperature_c();
            self.temperature = Some(self.worker.request("temperature", within, call)?);
        }
        answer.unwrap_or_else(|| Err(self.worker.pending("temperature")))
    }

    fn test_pattern(&mut self, pattern: Option<TestPattern>) -> Answer<Option<PatternScan>> {
        self.worker
            .wait("test pattern", move |d| d.test_pattern(pattern))?
    }
}
