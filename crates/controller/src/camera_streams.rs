//! Both cameras with their streams: the order of their chunks, their continuity in time, and data not yet taken.

use skinrig_device::{
    CameraCapabilities, CameraSettings, DeviceError, EventCamera, OpenChunk, SyncMode,
};
use skinrig_model::{
    CameraId, DeviceIdentity, HostDuration, HostTime, RawChunk, RunFault, Setting,
};

use crate::continuity::{Continuity, StreamTiming};

/// How to read the cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReadMode {
    /// Full chunks only.
    Poll,
    /// All data up to now.
    Flush,
}

/// The cameras and the state of their streams.
pub(crate) struct CameraStreams {
    devices: [Box<dyn EventCamera>; 2],
    settings: [CameraSettings; 2],
    continuity: [Continuity; 2],
    next_seq: [Option<u64>; 2],
    /// Data that were read but not yet taken.
    chunks: Vec<RawChunk>,
    /// Largest deviation of a camera's time from the host's; `None` disables the check.
    lag_limit: Option<HostDuration>,
}

impl CameraStreams {
    pub(crate) fn new(
        devices: [Box<dyn EventCamera>; 2],
        settings: [CameraSettings; 2],
        lag_limit: Option<HostDuration>,
    ) -> Self {
        Self {
            devices,
            settings,
            continuity: [Continuity::default(); 2],
            next_seq: [None; 2],
            chunks: Vec::new(),
            lag_limit,
        }
    }

    /// Id of the device in the position of `camera`.
    pub(crate) fn id(&self, camera: CameraId) -> CameraId {
        self.devices[camera.index()].camera()
    }

    pub(crate) fn capabilities(&self, camera: CameraId) -> CameraCapabilities {
        self.devices[camera.index()].capabilities()
    }

    /// Writes the settings of the rig to a camera; returns its identity and the settings read back.
    pub(crate) fn configure(
        &mut self,
        camera: CameraId,
    ) -> Result<(DeviceIdentity, Vec<Setting>), DeviceError> {
        let i = camera.index();
        let settings = self.devices[i].configure(&self.settings[i])?;
        Ok((self.devices[i].identity(), settings))
    }

    /// Starts both cameras. Those that follow another's time base wait for it, so they start first.
    pub(crate) fn start(&mut self) -> Result<(), DeviceError> {
        let mut order = CameraId::ALL;
        order.sort_by_key(|c| self.settings[c.index()].sync != SyncMode::Slave);
        for camera in order {
            self.devices[camera.index()].start()?;
        }
        Ok(())
    }

    /// Reads a camera, including its data before a failure. A camera that needs longer for a flush delivers the rest
    /// later: see [`is_flushed_to`](Self::is_flushed_to).
    pub(crate) fn read(
        &mut self,
        camera: CameraId,
        how: ReadMode,
        now: HostTime,
    ) -> Result<(), DeviceError> {
        let device = &mut self.devices[camera.index()];
        match how {
            ReadMode::Poll => device.poll(&mut self.chunks),
            ReadMode::Flush => {
                let flushed = device.flush(&mut self.chunks);
                self.continuity[camera.index()].flush(now, flushed)
            }
        }
    }

    /// See [`EventCamera::newest`].
    pub(crate) fn newest(&mut self, camera: CameraId, most: usize) -> Option<Vec<u8>> {
        self.devices[camera.index()].newest(most)
    }

    /// See [`EventCamera::open_chunk`].
    pub(crate) fn open_chunk(&mut self, camera: CameraId, from: usize) -> Option<OpenChunk> {
        self.devices[camera.index()].open_chunk(from)
    }

    /// Stops a camera and reads its remaining data; returns the result and the camera's notes.
    pub(crate) fn stop(&mut self, camera: CameraId) -> (Result<(), DeviceError>, Vec<String>) {
        let device = &mut self.devices[camera.index()];
        let stopped = device.stop(&mut self.chunks);
        let mut notes = Vec::new();
        device.take_notes(&mut notes);
        (stopped, notes)
    }

    /// Takes the data that were read.
    pub(crate) fn take_chunks(&mut self) -> Vec<RawChunk> {
        std::mem::take(&mut self.chunks)
    }

    /// Checks that no chunk is missing before this one.
    pub(crate) fn check_order(&mut self, chunk: &RawChunk) -> Result<(), RunFault> {
        let i = chunk.camera.index();
        let expected = self.next_seq[i].replace(chunk.seq + 1);
        match expected {
            Some(expected) if expected != chunk.seq => Err(RunFault::ChunkOrder {
                camera: chunk.camera,
                expected,
                found: chunk.seq,
            }),
            _ => Ok(()),
        }
    }

    /// Checks the time of a chunk. Late data are reported once, and the verdict on a press waits for them. A forward jump of
    /// the camera's clock is an error, because later presses could not be placed in time. When resumed, the session gets a
    /// new clock for what follows.
    ///
    /// Returns how late the data are, if this is to be reported.
    pub(crate) fn check_time(&mut self, chunk: &RawChunk) -> Result<Option<LateData>, RunFault> {
        let Some(limit) = self.lag_limit else {
            return Ok(None);
        };
        let camera = chunk.camera;
        match self.continuity[camera.index()].observe(chunk, limit) {
            StreamTiming::InStep => Ok(None),
            StreamTiming::Stepped(us) => Err(RunFault::ClockStep {
                camera,
                limit,
                found: HostDuration(us * 1_000),
            }),
            StreamTiming::Late(us) => Ok(Some(LateData {
                camera,
                limit,
                found: HostDuration(us * 1_000),
            })),
        }
    }

    /// Whether the times of the streams are checked.
    pub(crate) const fn checks_time(&self) -> bool {
        self.lag_limit.is_some()
    }

    /// Whether both cameras have delivered everything up to `t`.
    pub(crate) fn is_flushed_to(&self, t: HostTime) -> bool {
        self.continuity.iter().all(|c| c.is_flushed_to(t))
    }

    /// Host time up to which the stream of a camera is complete; see [`Continuity::reached`].
    pub(crate) fn reached(&self, camera: CameraId) -> Option<HostTime> {
        self.continuity[camera.index()].reached()
    }

    /// Whether the stream of a camera has not reached `end`.
    pub(crate) fn is_behind(&self, end: HostTime) -> bool {
        let mut reached = self.continuity.iter().map(Continuity::reached);
        reached.any(|r| r.is_none_or(|t| t < end))
    }

    /// Temperature of a camera in °C; `None` if it cannot measure it.
    pub(crate) fn temperature_c(&mut self, camera: CameraId) -> Result<Option<f64>, DeviceError> {
        self.devices[camera.index()].temperature_c()
    }
}

/// Data that arrived late.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{camera}: expected data within {limit}, found them {found} late")]
pub(crate) struct LateData {
    camera: CameraId,
    limit: HostDuration,
    found: HostDuration,
}
