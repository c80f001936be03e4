//! Test support: presses without a controller, and a recording in memory.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use skinrig_device::{
    CameraCapabilities, CameraSettings, Clock, DeviceError, EventCamera, Indenter,
    IndenterCapabilities, MotionLimits, Rig, RobotSample, TriggerBox, TriggerCapabilities,
};
use skinrig_model::{
    BoxReport, CameraId, DeviceIdentity, DeviceRole, HostDuration, HostTime, Mark, MarkKind,
    MotionCommand, Point2, Point3, PoseSample, PressId, RawChunk, RigidTransform, Robot, SentMark,
    Setting, Skin,
};
use skinrig_sim::replay::{Recording, RecordingError};

/// Limits that every rig of these tests accepts.
pub(crate) const LIMITS: MotionLimits = MotionLimits {
    min_mm: [-80.0, -80.0, -60.0],
    max_mm: [80.0, 80.0, 60.0],
    max_speed_mm_s: 100.0,
    max_acceleration_mm_s2: 500.0,
    max_force_n: 8.0,
};

/// Configures, starts, arms.
pub(crate) fn ready(rig: &mut Rig) {
    rig.indenter.configure(&LIMITS).unwrap();
    for (camera, settings) in rig.cameras.iter_mut().zip(&rig.camera_settings) {
        camera.configure(settings).unwrap();
        camera.start().unwrap();
    }
    rig.indenter.arm().unwrap();
}

/// Results of a run.
#[derive(Default)]
pub(crate) struct RunData {
    pub samples: Vec<RobotSample>,
    pub chunks: [Vec<RawChunk>; 2],
    pub marks: Vec<SentMark>,
    pub reports: Vec<BoxReport>,
}

impl RunData {
    /// The bytes of a camera as one string.
    pub(crate) fn bytes(&self, camera: CameraId) -> Vec<u8> {
        self.chunks[camera.index()]
            .iter()
            .flat_map(|c| c.bytes.iter().copied())
            .collect()
    }

    /// Collects the available data of the devices.
    pub(crate) fn poll(&mut self, rig: &mut Rig) -> Result<(), DeviceError> {
        rig.indenter.poll(&mut self.samples)?;
        for (camera, chunks) in rig.cameras.iter_mut().zip(&mut self.chunks) {
            camera.poll(chunks)?;
        }
        if let Some(trigger) = &mut rig.trigger_box {
            trigger.poll(&mut self.reports)?;
        }
        Ok(())
    }

    /// Ends the run.
    pub(crate) fn stop(&mut self, rig: &mut Rig) {
        let _ = rig.indenter.disarm();
        for (camera, chunks) in rig.cameras.iter_mut().zip(&mut self.chunks) {
            let _ = camera.stop(chunks);
        }
    }
}

/// Presses 2 mm deep at each location, on a fixed schedule of 1.5 s per press; `ticks` are the polling intervals in µs, repeated.
pub(crate) fn press_all(
    rig: &mut Rig,
    places: &[Point2],
    ticks: &[i64],
) -> Result<RunData, DeviceError> {
    let mut take = RunData::default();
    let mut tick = ticks.iter().copied().cycle();
    let up = rig.robot_from_skin;
    let mut wait =
        |rig: &mut Rig, take: &mut RunData, until: HostTime| -> Result<(), DeviceError> {
            while rig.clock.now() < until {
                let next =
                    rig.clock.now() + HostDuration::from_micros(tick.next().unwrap_or(1_000));
                rig.clock.wait_until(next.min(until));
                take.poll(rig)?;
            }
            Ok(())
        };
    for (n, &place) in places.iter().enumerate() {
        let start = HostTime(1_500_000_000 * n as i64);
        let at = |ms: i64| start + HostDuration::from_millis(ms);
        rig.indenter.command(up.apply(place.at_height(3.0)), 60.0)?;
        wait(rig, &mut take, at(600))?;
        rig.indenter
            .command(up.apply(place.at_height(-2.0)), 20.0)?;
        if let Some(trigger) = &mut rig.trigger_box {
            let mark = Mark {
                kind: MarkKind::Approach,
                press: PressId::from_index(n as u32),
            };
            take.marks.push(trigger.send(mark)?);
        }
        wait(rig, &mut take, at(1_000))?;
        rig.indenter.command(up.apply(place.at_height(3.0)), 20.0)?;
        wait(rig, &mut take, at(1_500))?;
    }
    Ok(take)
}

/// Locations on the skin in view of both cameras.
pub(crate) fn places(n: usize) -> Vec<Point2> {
    (0..n)
        .map(|k| Point2::new(-18.0 + 7.0 * (k % 7) as f64, -14.0 + 6.0 * (k % 6) as f64))
        .collect()
}

/// All data of a run, in memory.
#[derive(Default, Clone)]
pub(crate) struct Log {
    pub identities: Vec<(DeviceRole, DeviceIdentity)>,
    pub settings: Vec<(DeviceRole, Vec<Setting>)>,
    pub commands: VecDeque<(HostTime, MotionCommand)>,
    pub poses: VecDeque<PoseSample>,
    pub marks: VecDeque<SentMark>,
    pub reports: VecDeque<(HostTime, BoxReport)>,
    pub chunks: [VecDeque<RawChunk>; 2],
}

impl Recording for Log {
    fn identity(&self, role: DeviceRole) -> Option<DeviceIdentity> {
        let known = self.identities.iter().find(|(r, _)| *r == role);
        known.map(|(_, id)| id.clone())
    }
    fn settings(&self, role: DeviceRole) -> Vec<Setting> {
        let known = self.settings.iter().rfind(|(r, _)| *r == role);
        known.map(|(_, s)| s.clone()).unwrap_or_default()
    }
    fn next_command(&mut self) -> Result<Option<(HostTime, MotionCommand)>, RecordingError> {
        Ok(self.commands.pop_front())
    }
    fn next_poses(&mut self) -> Result<Option<Vec<PoseSample>>, RecordingError> {
        let n = self.poses.len().min(97);
        let block: Vec<PoseSample> = self.poses.drain(..n).collect();
        Ok((!block.is_empty()).then_some(block))
    }
    fn next_mark(&mut self) -> Result<Option<SentMark>, RecordingError> {
        Ok(self.marks.pop_front())
    }
    fn next_box_report(&mut self) -> Result<Option<(HostTime, BoxReport)>, RecordingError> {
        Ok(self.reports.pop_front())
    }
    fn next_chunk(&mut self, camera: CameraId) -> Result<Option<RawChunk>, RecordingError> {
        Ok(self.chunks[camera.index()].pop_front())
    }
}

/// A device that records all calls.
pub(crate) struct LoggedDevice<D> {
    inner: D,
    log: Arc<Mutex<Log>>,
    clock: Box<dyn Clock>,
    skin_from_robot: RigidTransform<Skin, Robot>,
}

impl<D> LoggedDevice<D> {
    pub(crate) fn new(
        inner: D,
        log: &Arc<Mutex<Log>>,
        clock: Box<dyn Clock>,
        robot_from_skin: RigidTransform<Robot, Skin>,
    ) -> Self {
        Self {
            inner,
            log: Arc::clone(log),
            clock,
            skin_from_robot: robot_from_skin.inverse(),
        }
    }
}

impl Indenter for LoggedDevice<Box<dyn Indenter>> {
    fn identity(&self) -> DeviceIdentity {
        self.inner.identity()
    }
    fn capabilities(&self) -> IndenterCapabilities {
        self.inner.capabilities()
    }
    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        let settings = self.inner.configure(limits)?;
        let mut log = self.log.lock().unwrap();
        log.identities
            .push((DeviceRole::Indenter, self.inner.identity()));
        log.settings.push((DeviceRole::Indenter, settings.clone()));
        Ok(settings)
    }
    fn arm(&mut self) -> Result<(), DeviceError> {
        self.inner.arm()
    }
    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.inner.command(target, speed_mm_s)?;
        let command = MotionCommand {
            target: self.skin_from_robot.apply(target),
            speed_mm_s,
        };
        let t = self.clock.now();
        self.log.lock().unwrap().commands.push_back((t, command));
        Ok(())
    }
    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        let from = samples.len();
        let answer = self.inner.poll(samples);
        let mut log = self.log.lock().unwrap();
        log.poses.extend(samples[from..].iter().map(|s| PoseSample {
            t: s.t,
            commanded: self.skin_from_robot.apply(s.commanded),
            measured: self.skin_from_robot.apply(s.measured),
            force_n: s.force_n,
        }));
        answer
    }
    fn hold(&mut self) -> Result<(), DeviceError> {
        self.inner.hold()
    }
    fn disarm(&mut self) -> Result<(), DeviceError> {
        self.inner.disarm()
    }
}

impl LoggedDevice<Box<dyn EventCamera>> {
    fn note(&mut self, chunks: &[RawChunk]) {
        let k = self.inner.camera().index();
        self.log.lock().unwrap().chunks[k].extend(chunks.iter().cloned());
    }
}

impl EventCamera for LoggedDevice<Box<dyn EventCamera>> {
    fn camera(&self) -> CameraId {
        self.inner.camera()
    }
    fn identity(&self) -> DeviceIdentity {
        self.inner.identity()
    }
    fn capabilities(&self) -> CameraCapabilities {
        self.inner.capabilities()
    }
    fn configure(&mut self, settings: &CameraSettings) -> Result<Vec<Setting>, DeviceError> {
        let read = self.inner.configure(settings)?;
        let role = DeviceRole::of_camera(self.inner.camera());
        let mut log = self.log.lock().unwrap();
        log.identities.push((role, self.inner.identity()));
        log.settings.push((role, read.clone()));
        Ok(read)
    }
    fn start(&mut self) -> Result<(), DeviceError> {
        self.inner.start()
    }
    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        let from = chunks.len();
        let answer = self.inner.poll(chunks);
        self.note(&chunks[from..]);
        answer
    }
    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        let from = chunks.len();
        let answer = self.inner.flush(chunks);
        self.note(&chunks[from..]);
        answer
    }
    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        let from = chunks.len();
        let answer = self.inner.stop(chunks);
        self.note(&chunks[from..]);
        answer
    }
}

impl TriggerBox for LoggedDevice<Box<dyn TriggerBox>> {
    fn identity(&self) -> DeviceIdentity {
        self.inner.identity()
    }
    fn capabilities(&self) -> TriggerCapabilities {
        self.inner.capabilities()
    }
    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        let sent = self.inner.send(mark)?;
        let mut log = self.log.lock().unwrap();
        log.identities
            .push((DeviceRole::TriggerBox, self.inner.identity()));
        log.marks.push_back(sent);
        Ok(sent)
    }

    fn poll(&mut self, reports: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        let from = reports.len();
        let answer = self.inner.poll(reports);
        let now = self.clock.now();
        let fresh = reports[from..].iter().map(|report| (now, *report));
        self.log.lock().unwrap().reports.extend(fresh);
        answer
    }
}

/// A clock with two owners.
#[derive(Clone)]
pub(crate) struct SharedClock(Arc<Mutex<Box<dyn Clock>>>);

impl SharedClock {
    pub(crate) fn new(clock: Box<dyn Clock>) -> Self {
        Self(Arc::new(Mutex::new(clock)))
    }
}

impl Clock for SharedClock {
    fn now(&self) -> HostTime {
        self.0.lock().unwrap().now()
    }
    fn wait_until(&mut self, t: HostTime) {
        self.0.lock().unwrap().wait_until(t);
    }
}

/// `rig` with all devices recording into the returned log.
pub(crate) fn with_log(rig: Rig) -> (Rig, Arc<Mutex<Log>>) {
    let log = Arc::new(Mutex::new(Log::default()));
    let clock = SharedClock::new(rig.clock);
    let place = rig.robot_from_skin;
    let own = || -> Box<dyn Clock> { Box::new(clock.clone()) };
    let rig = Rig {
        indenter: Box::new(LoggedDevice::new(rig.indenter, &log, own(), place)),
        cameras: rig.cameras.map(|c| -> Box<dyn EventCamera> {
            Box::new(LoggedDevice::new(c, &log, own(), place))
        }),
        trigger_box: rig
            .trigger_box
            .map(|t| -> Box<dyn TriggerBox> { Box::new(LoggedDevice::new(t, &log, own(), place)) }),
        clock: own(),
        ..rig
    };
    (rig, log)
}
