//! The streaming cameras and the trigger box during a check: started in order, polled, and always
//! stopped. Every wait has a time limit.

mod stats;

use skinrig_device::{CameraSettings, DeviceError, EventCamera, SyncMode};
use skinrig_model::{BoxReport, CameraId, HostDuration, HostTime, Mark, RawChunk};
use skinrig_nightly::{Evidence, EvidenceKind};

use self::stats::CameraStream;
use crate::bench::{Bench, Devices, Problem};
use crate::device_evidence::{self, COMPUTER};
use crate::findings::Findings;

pub(crate) use self::stats::StreamStats;

/// Interval between two polls of the devices.
const STEP: HostDuration = HostDuration::from_millis(10);
/// Interval at which partly filled chunks are fetched too.
const FLUSH_EVERY: HostDuration = HostDuration::from_millis(200);
/// Time limit for a box to finish a train of its own.
const LINE_TIMEOUT: HostDuration = HostDuration::from_millis(1_000);
/// A poll delayed by more than this is evidence of an overloaded computer.
const MAX_POLL_DELAY: HostDuration = HostDuration::from_millis(1_000);

/// The streaming devices of a bench. Dropping this value stops the cameras.
pub(crate) struct Streams<'a> {
    devices: &'a mut Devices,
    cameras: [CameraStream; 2],
    box_problem: Option<Problem>,
    box_read_error: Option<Problem>,
    /// Whether faults of the box concern the check.
    box_is_needed: bool,
    reports: Vec<BoxReport>,
    chunks: Vec<RawChunk>,
    flushed_at: HostTime,
    timing_slack: HostDuration,
    host_late: Option<Problem>,
    measuring: bool,
    /// Whether the suite must end.
    stop: Box<dyn Fn() -> bool>,
}

impl<'a> Streams<'a> {
    /// Configures both cameras as for a run, calls `prepare` for each, and starts them, sync slaves before their master.
    pub(crate) fn start(
        bench: &'a mut dyn Bench,
        prepare: &mut dyn FnMut(CameraId, &mut dyn EventCamera) -> Result<(), DeviceError>,
    ) -> Self {
        let (timing_slack, stop) = (bench.timing_slack(), bench.stop_signal());
        let settings = CameraId::ALL.map(|camera| bench.camera_settings(camera));
        let devices = bench.devices();
        let now = devices.clock.now();
        let mut streams = Self {
            cameras: [CameraStream::default(), CameraStream::default()],
            box_problem: match &devices.trigger_box {
                Some(Err(problem)) => Some(problem.clone()),
                _ => None,
            },
            devices,
            box_read_error: None,
            box_is_needed: true,
            reports: Vec::new(),
            chunks: Vec::new(),
            flushed_at: now,
            timing_slack,
            host_late: None,
            measuring: false,
            stop,
        };
        let is_slave = |c: &CameraId| {
            settings[c.index()]
                .as_ref()
                .is_ok_and(|s| s.sync == SyncMode::Slave)
        };
        let (slaves, others): (Vec<_>, Vec<_>) = CameraId::ALL.into_iter().partition(is_slave);
        for camera in slaves.iter().chain(&others).copied() {
            let started = match &settings[camera.index()] {
                Ok(settings) => streams.start_camera(camera, settings, prepare),
                Err(problem) => Err(problem.clone()),
            };
            streams.cameras[camera.index()].problem = started.err();
        }
        let now = streams.now();
        for stream in &mut streams.cameras {
            stream.advanced_at = now;
        }
        streams.poll_box();
        streams.reports.clear();
        streams
    }

    fn start_camera(
        &mut self,
        id: CameraId,
        settings: &CameraSettings,
        prepare: &mut dyn FnMut(CameraId, &mut dyn EventCamera) -> Result<(), DeviceError>,
    ) -> Result<(), Problem> {
        let camera = match &mut self.devices.cameras[id.index()] {
            Ok(camera) => camera.as_mut(),
            Err(problem) => return Err(problem.clone()),
        };
        // The previous check may have been interrupted while it streamed.
        let stopped = camera.stop(&mut self.chunks);
        self.chunks.clear();
        let started = stopped
            .and_then(|()| camera.configure(settings).map(drop))
            .and_then(|()| prepare(id, camera))
            .and_then(|()| camera.start());
        // Discard notes about earlier streams.
        camera.take_notes(&mut Vec::new());
        started.map_err(|e| device_evidence::from_error(&e))
    }

    /// Current time.
    #[must_use]
    pub(crate) fn now(&self) -> HostTime {
        self.devices.clock.now()
    }

    /// Whether this camera still streams.
    #[must_use]
    pub(crate) fn is_live(&self, camera: CameraId) -> bool {
        self.cameras[camera.index()].problem.is_none()
    }

    /// All reports of the box so far.
    #[must_use]
    pub(crate) fn reports(&self) -> &[BoxReport] {
        &self.reports
    }

    /// Whether every report of the box arrived and could be read.
    #[must_use]
    pub(crate) fn box_reports_are_complete(&self) -> bool {
        self.box_problem.is_none() && self.box_read_error.is_none()
    }

    /// Ignores faults of the trigger box. In a check of the cameras alone they would hide faults of
    /// the cameras.
    pub(crate) fn without_box(mut self) -> Self {
        self.box_is_needed = false;
        self
    }

    /// Starts counting.
    pub(crate) fn start_counting(&mut self, on_chunk: &mut dyn FnMut(&RawChunk)) {
        self.poll_devices(true, on_chunk);
        self.measuring = true;
        self.cameras
            .iter_mut()
            .for_each(CameraStream::start_counting);
    }

    /// Polls the devices for `span`, or until the suite must end, and passes each chunk to `on_chunk`.
    pub(crate) fn pass(&mut self, span: HostDuration, on_chunk: &mut dyn FnMut(&RawChunk)) {
        let end = self.now() + span;
        while self.now() < end && !(self.stop)() {
            self.step(end, on_chunk);
        }
    }

    /// Sends a mark as soon as the line is free, and polls the devices until its train has ended. Returns
    /// false if the mark was not sent, because the box failed ([`Self::finish`] adds the evidence) or the
    /// suite must end.
    pub(crate) fn send(&mut self, mark: Mark, on_chunk: &mut dyn FnMut(&RawChunk)) -> bool {
        let until = self.now() + LINE_TIMEOUT + self.timing_slack;
        while self.box_problem.is_none() && !(self.stop)() {
            let Some(Ok(trigger)) = &mut self.devices.trigger_box else {
                return false;
            };
            match trigger.send(mark) {
                Ok(sent) => {
                    let over = sent.t + trigger.capabilities().train_duration;
                    while self.now() < over {
                        self.step(over, on_chunk);
                    }
                    return true;
                }
                Err(DeviceError::Pending { .. }) => self.step(self.now() + STEP, on_chunk),
                Err(DeviceError::State { .. }) if self.now() < until => self.step(until, on_chunk),
                Err(e) => self.box_problem = Some(device_evidence::from_error(&e)),
            }
        }
        false
    }

    /// Polls the devices until the box has reported `marks`, for as long as it may need.
    pub(crate) fn wait_for_reports(&mut self, marks: &[Mark], on_chunk: &mut dyn FnMut(&RawChunk)) {
        let until = self.now() + LINE_TIMEOUT + self.timing_slack;
        let is_missing = |reports: &[BoxReport]| {
            marks.iter().any(|sent| {
                let of = |r: &BoxReport| matches!(r, BoxReport::Mark { mark, .. } if mark == sent);
                !reports.iter().any(of)
            })
        };
        while self.box_problem.is_none()
            && self.now() < until
            && is_missing(&self.reports)
            && !(self.stop)()
        {
            self.step(until, on_chunk);
        }
    }

    /// Waits until both camera streams reach the time of this call or stall, then stops the cameras
    /// and counts their last data. Adds failures to `findings`, with `metrics` unmeasured on the
    /// failed camera.
    pub(crate) fn finish(
        mut self,
        findings: &mut Findings,
        metrics: &[&'static str],
        on_chunk: &mut dyn FnMut(&RawChunk),
    ) -> [Option<StreamStats>; 2] {
        let end = self.now();
        while CameraId::ALL
            .iter()
            .any(|c| self.is_live(*c) && self.cameras[c.index()].advanced_at <= end)
        {
            self.flushed_at = self.flushed_at.min(end - FLUSH_EVERY);
            self.step(self.now() + STEP, on_chunk);
        }
        for camera in CameraId::ALL {
            if let Ok(device) = &mut self.devices.cameras[camera.index()] {
                let stopped = device.stop(&mut self.chunks);
                let stream = &mut self.cameras[camera.index()];
                device.take_notes(&mut stream.stats.notes);
                if let Err(e) = stopped {
                    stream
                        .problem
                        .get_or_insert_with(|| device_evidence::from_error(&e));
                }
            }
            self.forward_chunks(on_chunk);
        }
        if let (Some(problem), Some(slot)) = (&self.box_problem, &mut self.devices.trigger_box) {
            *slot = Err(problem.clone());
        }
        let box_problems = [self.box_problem.take(), self.box_read_error.take()];
        let box_problems = box_problems.into_iter().filter(|_| self.box_is_needed);
        let others = box_problems.chain([self.host_late.take()]);
        findings.evidence.extend(others.flatten().map(|t| *t));
        CameraId::ALL.map(|camera| {
            let stream = std::mem::take(&mut self.cameras[camera.index()]);
            match stream.problem {
                None => Some(stream.stats),
                Some(problem) => {
                    if problem.kind == EvidenceKind::DeviceLost {
                        // A lost camera must be reopened; the bench does that for the next check.
                        self.devices.cameras[camera.index()] = Err(problem.clone());
                    }
                    findings.failed(*problem, device_evidence::camera_subject(camera), metrics);
                    None
                }
            }
        })
    }

    /// Waits for the next poll, at most until `end`, and polls.
    fn step(&mut self, end: HostTime, on_chunk: &mut dyn FnMut(&RawChunk)) {
        let due = (self.now() + STEP).min(end);
        self.devices.clock.wait_until(due);
        let now = self.now();
        let late = now - due;
        if late > MAX_POLL_DELAY + self.timing_slack {
            let what = format!(
                "expected a poll of the devices every {} ms, found {:.1} s without one",
                STEP.0 / 1_000_000,
                late.as_secs_f64()
            );
            let evidence = Evidence::new(EvidenceKind::HostLate, COMPUTER, what)
                .next("find out what else ran at that time (`journalctl`, backups, sleep)");
            self.host_late = Some(Box::new(evidence));
        }
        self.poll_devices(now - self.flushed_at >= FLUSH_EVERY, on_chunk);
    }

    /// Fetches data from the devices: full chunks, and partly filled ones too if `all`.
    fn poll_devices(&mut self, all: bool, on_chunk: &mut dyn FnMut(&RawChunk)) {
        let now = self.now();
        if all {
            self.flushed_at = now;
        }
        for camera in CameraId::ALL {
            let i = camera.index();
            if self.cameras[i].problem.is_some() {
                continue;
            }
            let Ok(device) = &mut self.devices.cameras[i] else {
                continue;
            };
            let fetched = match all {
                true => device.flush(&mut self.chunks),
                false => device.poll(&mut self.chunks),
            };
            self.forward_chunks(on_chunk);
            let stream = &mut self.cameras[i];
            let fetched = match fetched {
                Err(DeviceError::Pending { .. }) => Ok(()), // a later poll fetches the rest
                other => other,
            };
            if let Err(e) = fetched {
                stream.problem = Some(device_evidence::from_error(&e));
            } else if all {
                stream.problem = stream.check_stall(camera, now, self.timing_slack);
            }
        }
        self.poll_box();
    }

    /// Counts the new chunks and passes them on.
    fn forward_chunks(&mut self, on_chunk: &mut dyn FnMut(&RawChunk)) {
        let now = self.devices.clock.now();
        for chunk in self.chunks.drain(..) {
            self.cameras[chunk.camera.index()].add_chunk(&chunk, now, self.measuring);
            on_chunk(&chunk);
        }
    }

    /// Fetches the box's reports.
    fn poll_box(&mut self) {
        let Some(Ok(trigger)) = &mut self.devices.trigger_box else {
            return;
        };
        match trigger.poll(&mut self.reports) {
            Ok(()) => {}
            Err(e @ (DeviceError::Lost { .. } | DeviceError::Silent { .. })) => {
                self.box_problem
                    .get_or_insert_with(|| device_evidence::from_error(&e));
            }
            // Unreadable data on the line; later reports may still be readable.
            Err(e) => {
                self.box_read_error
                    .get_or_insert_with(|| device_evidence::from_error(&e));
            }
        }
    }
}

impl Drop for Streams<'_> {
    fn drop(&mut self) {
        for camera in self.devices.cameras.iter_mut().flatten() {
            // After `finish` they are stopped already; otherwise the check has reported its error.
            let _ = camera.stop(&mut self.chunks);
        }
    }
}
