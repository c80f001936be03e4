//! A small deterministic rig: ideal straight motions, numbered device calls that can be made to fail.

use std::sync::{Arc, Mutex, MutexGuard};

use skinrig_controller::{ControlHandle, RecordSink, SinkFault};
use skinrig_device::{
    CameraCapabilities, CameraSettings, Clock, DeviceError, EventCamera, Indenter,
    IndenterCapabilities, MotionLimits, Rig, RobotSample, TriggerBox, TriggerCapabilities,
};
use skinrig_model::*;
use skinrig_protocol::area::Surroundings;
use skinrig_protocol::plan::{OnTrip, Plan, PressStep, RunLimits, Step};
use skinrig_protocol::{Retakes, Surface, Suspend};

pub const MS: i64 = 1_000_000;

/// How a numbered call fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// That call alone answers with an error.
    Once,
    /// That call, and every later one to the same device.
    Forever,
    /// That call panics.
    Panic,
}

/// What the operator remarks.
pub const NOTE: &str = "Ann: the lamp flickers";

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Press {
    Pause,
    PauseNow,
    Stop,
    Abort,
    Halt,
    /// A remark.
    Note,
}

/// What goes wrong with the feedback.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strike {
    /// A force of 9 N.
    Force,
    /// The tip sinks 0.05 mm every millisecond.
    Sink,
    /// The tip slides 0.3 mm every millisecond.
    Slide,
    /// A coordinate is no number.
    Nan,
    /// The same sample twice.
    Twice,
    /// No samples any more.
    Silence,
    /// The clock jumps by 1.5 s, and the samples come after it.
    Late,
}

/// What is wrong with the world.
#[derive(Debug, Clone, Default)]
pub struct Faults {
    pub at_call: Option<(u64, Failure)>,
    /// The tip cannot go below this height from this time on, ms.
    pub floor_mm: Option<(i64, f64, i64)>,
    /// The pose stream ends at this time, ms.
    pub poses_end_ms: Option<i64>,
    /// Bytes lost by a camera before its chunk with this number.
    pub loss: Option<(CameraId, u64, u64)>,
    /// Cameras tell their time. From this time on, ms, what camera 2 sends takes so long, ms.
    pub delay: Option<(i64, i64)>,
    /// Camera 2 loses bytes at this time, ms, and tells so with the data that follow.
    pub lost_at_ms: Option<i64>,
    /// Camera 1 tells its temperature: 70 °C in this time, ms, 30 °C otherwise.
    pub hot_ms: Option<std::ops::Range<i64>>,
    /// A camera that has something to say about its stream, once.
    pub remark: Option<(CameraId, String)>,
    /// What the trigger box has to say about the run, once.
    pub box_remark: Option<String>,
    /// The tip stays where it is sideways from this time on, ms.
    pub stuck_sideways_ms: Option<i64>,
    /// What goes wrong once the tip is 1 mm deep.
    pub strike: Option<Strike>,
    /// The operator's hand at this tick.
    pub operator: Option<(u64, Press)>,
    /// A halt this many ticks after it.
    pub halt_after: Option<u64>,
    /// N per mm of indentation.
    pub stiffness_n_mm: f64,
    pub train_ms: i64,
}

pub struct World {
    pub t: i64,
    pub calls: u64,
    pub ticks: u64,
    pub faults: Faults,
    pub control: ControlHandle,
    pub armed: bool,
    pub ever_armed: bool,
    /// A disarm was answered since the last arm.
    pub confirmed: bool,
    pub dead: Option<DeviceRole>,
    pub tip: [f64; 3],
    pub set_point: [f64; 3],
    pub target: [f64; 3],
    pub speed: f64,
    pub sampled_to: i64,
    pub violations: Vec<String>,
    pub commands: Vec<([f64; 3], f64, i64)>,
    pub limits: Option<MotionLimits>,
    pub streaming: [bool; 2],
    /// Cameras in the order in which they were started.
    pub started: Vec<CameraId>,
    pub seq: [u64; 2],
    /// How often each camera was asked for its temperature.
    pub asked_heat: [u32; 2],
    pub line_until: i64,
    pub clearance_mm: f64,
    /// When the strike began to break a limit.
    pub broken_at: Option<i64>,
    struck_for: i64,
    /// What the robot was told besides motions: when, `hold` or `disarm`.
    pub told: Vec<(i64, &'static str)>,
    samples: Vec<RobotSample>,
}

pub type Shared = Arc<Mutex<World>>;

pub fn lock(world: &Shared) -> MutexGuard<'_, World> {
    world.lock().unwrap_or_else(|e| e.into_inner())
}

/// Where the mock's skin lies: a quarter turn and a shift, so that mixed-up frames are seen.
pub fn robot_from_skin() -> RigidTransform<Robot, Skin> {
    RigidTransform::new(
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        [5.0, -3.0, 12.0],
    )
}

impl World {
    pub fn shared(faults: Faults, start: [f64; 3]) -> Shared {
        Arc::new(Mutex::new(Self {
            t: 0,
            calls: 0,
            ticks: 0,
            faults,
            control: ControlHandle::new(),
            armed: false,
            ever_armed: false,
            confirmed: false,
            dead: None,
            tip: start,
            set_point: start,
            target: start,
            speed: 1.0,
            sampled_to: 0,
            violations: vec![],
            commands: vec![],
            limits: None,
            streaming: [false; 2],
            started: vec![],
            seq: [0; 2],
            asked_heat: [0; 2],
            line_until: 0,
            clearance_mm: 5.0,
            broken_at: None,
            struck_for: 0,
            told: vec![],
            samples: vec![],
        }))
    }

    /// Moves the robot, in the skin frame, up to the present in steps of 1 ms.
    fn advance(&mut self) {
        while self.sampled_to + MS <= self.t {
            self.sampled_to += MS;
            let ms = self.sampled_to / MS;
            if self.armed {
                let d: Vec<f64> = (0..3).map(|i| self.target[i] - self.set_point[i]).collect();
                let left = d.iter().map(|v| v * v).sum::<f64>().sqrt();
                let step = (self.speed * 1e-3).min(left);
                if left > 0.0 {
                    for (i, d) in d.iter().enumerate() {
                        self.set_point[i] += d / left * step;
                    }
                }
                if left <= self.speed * 1e-3 {
                    self.set_point = self.target;
                }
            }
            let mut tip = self.set_point;
            if let Some((from, floor, to)) = self.faults.floor_mm
                && (from..to).contains(&ms)
            {
                tip[2] = tip[2].max(floor);
            }
            if self.faults.stuck_sideways_ms.is_some_and(|from| ms >= from) {
                (tip[0], tip[1]) = (self.tip[0], self.tip[1]);
            }
            let lateral = (tip[0] - self.tip[0]).hypot(tip[1] - self.tip[1]);
            if lateral > 1e-6 && tip[2].min(self.tip[2]) < self.clearance_mm - 0.051 {
                self.violations
                    .push(format!("sideways at {:?} at {ms} ms", self.tip));
            }
            self.tip = tip;
            if self.faults.poses_end_ms.is_none_or(|end| ms < end) {
                let to_robot = |p: [f64; 3]| robot_from_skin().apply(Point3::new(p[0], p[1], p[2]));
                let sample = RobotSample {
                    t: HostTime(self.sampled_to),
                    commanded: to_robot(self.set_point),
                    measured: to_robot(tip),
                    force_n: (-tip[2]).max(0.0) * self.faults.stiffness_n_mm,
                };
                self.deliver(sample, tip);
            }
        }
    }

    /// Keeps a sample, changed by the strike while the arm is low.
    fn deliver(&mut self, mut sample: RobotSample, mut tip: [f64; 3]) {
        let begins = self.armed && tip[2] < -1.0;
        let Some(strike) = self.faults.strike.filter(|_| self.struck_for > 0 || begins) else {
            self.samples.push(sample);
            return;
        };
        self.struck_for += 1;
        let n = self.struck_for as f64;
        let mut broken = true;
        match strike {
            Strike::Force => sample.force_n = 9.0,
            Strike::Sink => {
                tip[2] -= 0.05 * n;
                broken = tip[2] < -3.05;
            }
            Strike::Slide => tip[0] += 0.3 * n,
            Strike::Nan => tip[1] = f64::NAN,
            Strike::Twice => self.samples.push(sample),
            Strike::Silence => {}
            Strike::Late => broken = false, // the clock tells
        }
        sample.measured = robot_from_skin().apply(Point3::new(tip[0], tip[1], tip[2]));
        if broken {
            self.broken_at.get_or_insert(self.sampled_to);
        }
        if strike != Strike::Silence {
            self.samples.push(sample);
        }
    }

    fn lost(role: DeviceRole) -> DeviceError {
        DeviceError::Lost {
            role,
            serial: "mock".into(),
            detail: "no answer".into(),
        }
    }
}

/// Counts a call; fails it when it is its turn.
fn call(world: &Shared, role: DeviceRole) -> Result<(), DeviceError> {
    let mut w = lock(world);
    w.calls += 1;
    if w.dead == Some(role) {
        return Err(World::lost(role));
    }
    match w.faults.at_call {
        Some((k, failure)) if k == w.calls => match failure {
            Failure::Once => Err(World::lost(role)),
            Failure::Forever => {
                w.dead = Some(role);
                Err(World::lost(role))
            }
            Failure::Panic => {
                drop(w);
                std::panic::panic_any(format!("mock {role:?} panics"));
            }
        },
        _ => Ok(()),
    }
}

fn identity(model: &str) -> DeviceIdentity {
    DeviceIdentity {
        model: model.into(),
        serial: "mock".into(),
        firmware: "0".into(),
    }
}

pub struct MockClock(pub Shared);

impl Clock for MockClock {
    fn now(&self) -> HostTime {
        HostTime(lock(&self.0).t)
    }
    fn wait_until(&mut self, t: HostTime) {
        let mut w = lock(&self.0);
        w.t = w.t.max(t.0);
        w.ticks += 1;
        if w.faults.strike == Some(Strike::Late) && w.tip[2] < -1.0 && w.broken_at.is_none() {
            w.t += 1500 * MS;
            w.broken_at = Some(w.t);
        }
        if let Some((tick, press)) = w.faults.operator {
            if tick == w.ticks {
                match press {
                    Press::Pause => w.control.pause(),
                    Press::PauseNow => w.control.pause_now(),
                    Press::Stop => w.control.stop(),
                    Press::Abort => w.control.abort(),
                    Press::Halt => w.control.halt(),
                    Press::Note => assert_eq!(w.control.note(NOTE.into()), Ok(1)),
                }
            } else if matches!(press, Press::Pause | Press::PauseNow) && w.ticks == tick + 200 {
                w.control.resume();
            }
            if w.faults.halt_after.is_some_and(|n| tick + n == w.ticks) {
                w.control.halt();
            }
        }
    }
}

/// What a scripted robot can do.
pub fn can() -> IndenterCapabilities {
    IndenterCapabilities {
        workspace_min_mm: [-100.0; 3],
        workspace_max_mm: [100.0; 3],
        max_speed_mm_s: 200.0,
        max_acceleration_mm_s2: 500.0,
        max_force_n: 12.0,
        pose_rate_hz: 1000.0,
        reports_force: true,
    }
}

pub struct MockIndenter(pub Shared);

impl Indenter for MockIndenter {
    fn identity(&self) -> DeviceIdentity {
        identity("mock indenter")
    }
    fn capabilities(&self) -> IndenterCapabilities {
        can()
    }
    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        lock(&self.0).limits = Some(*limits);
        Ok(vec![Setting {
            name: "max_speed_mm_s".into(),
            requested: limits.max_speed_mm_s.to_string(),
            read_back: limits.max_speed_mm_s.to_string(),
        }])
    }
    fn arm(&mut self) -> Result<(), DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        let mut w = lock(&self.0);
        w.advance();
        (w.armed, w.ever_armed, w.confirmed) = (true, true, false);
        w.target = w.tip;
        w.set_point = w.tip;
        Ok(())
    }
    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        let mut w = lock(&self.0);
        w.advance();
        if !w.armed {
            w.violations.push("command while disarmed".into());
        }
        let target = robot_from_skin().inverse().apply(target).to_array();
        let t = w.t;
        w.commands.push((target, speed_mm_s, t));
        w.target = target;
        w.speed = speed_mm_s;
        Ok(())
    }
    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        let answer = call(&self.0, DeviceRole::Indenter);
        let mut w = lock(&self.0);
        w.advance();
        if w.dead != Some(DeviceRole::Indenter) {
            samples.append(&mut w.samples);
        }
        answer
    }
    fn hold(&mut self) -> Result<(), DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        let mut w = lock(&self.0);
        w.advance();
        w.target = w.set_point;
        let t = w.t;
        w.told.push((t, "hold"));
        Ok(())
    }
    fn disarm(&mut self) -> Result<(), DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        let mut w = lock(&self.0);
        w.advance();
        (w.armed, w.confirmed) = (false, true);
        let t = w.t;
        w.told.push((t, "disarm"));
        Ok(())
    }
}

struct MockCamera(Shared, CameraId);

impl MockCamera {
    fn role(&self) -> DeviceRole {
        DeviceRole::of_camera(self.1)
    }
    fn chunk(&self, chunks: &mut Vec<RawChunk>) {
        let mut w = lock(&self.0);
        let i = self.1.index();
        let seq = w.seq[i];
        w.seq[i] += 1;
        let mut lost_before = match w.faults.loss {
            Some((camera, at, bytes)) if camera == self.1 && at == seq => bytes,
            _ => 0,
        };
        // What comes now was sent earlier, and in order.
        let sent_ms = match w.faults.delay {
            Some((from_ms, by_ms)) if self.1 == CameraId::Two => {
                (w.t / MS).min(from_ms).max(w.t / MS - by_ms)
            }
            _ => w.t / MS,
        };
        let lost_now = |at: &mut i64| self.1 == CameraId::Two && *at <= sent_ms;
        if w.faults.lost_at_ms.take_if(lost_now).is_some() {
            lost_before = 8;
        }
        let time_us = (w.faults.delay.is_some()).then_some(sent_ms as u64 * 1_000);
        chunks.push(RawChunk {
            camera: self.1,
            seq,
            host_time: HostTime(w.t),
            lost_before,
            lost_from_us: None,
            bytes: vec![0; 8],
            facts: ChunkFacts {
                cd_events: 100,
                first_us: time_us,
                last_us: time_us,
                ..ChunkFacts::default()
            },
            triggers: vec![],
        });
    }
}

impl EventCamera for MockCamera {
    fn camera(&self) -> CameraId {
        self.1
    }
    fn identity(&self) -> DeviceIdentity {
        identity("mock camera")
    }
    fn capabilities(&self) -> CameraCapabilities {
        CameraCapabilities {
            width: 640,
            height: 480,
            format: StreamFormat::Evt2,
            trigger_channels: vec![0],
            biases: vec![],
        }
    }
    fn configure(&mut self, _: &CameraSettings) -> Result<Vec<Setting>, DeviceError> {
        call(&self.0, self.role())?;
        Ok(vec![])
    }
    fn start(&mut self) -> Result<(), DeviceError> {
        call(&self.0, self.role())?;
        let mut w = lock(&self.0);
        w.streaming[self.1.index()] = true;
        w.started.push(self.1);
        Ok(())
    }
    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        call(&self.0, self.role())?;
        let due = {
            let w = lock(&self.0);
            w.streaming[self.1.index()] && w.t / (100 * MS) >= w.seq[self.1.index()] as i64
        };
        if due {
            self.chunk(chunks);
        }
        Ok(())
    }
    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        call(&self.0, self.role())?;
        self.chunk(chunks);
        Ok(())
    }
    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        let answer = call(&self.0, self.role());
        lock(&self.0).streaming[self.1.index()] = false;
        answer?;
        self.chunk(chunks);
        Ok(())
    }
    fn take_notes(&mut self, notes: &mut Vec<String>) {
        let mine = |of: &mut (CameraId, String)| of.0 == self.1;
        notes.extend(lock(&self.0).faults.remark.take_if(mine).map(|r| r.1));
    }
    fn temperature_c(&mut self) -> Result<Option<f64>, DeviceError> {
        call(&self.0, self.role())?;
        let mut w = lock(&self.0);
        w.asked_heat[self.1.index()] += 1;
        let hot_ms = w.faults.hot_ms.clone().filter(|_| self.1 == CameraId::One);
        let ms = w.t / MS;
        Ok(hot_ms.map(|hot| if hot.contains(&ms) { 70.0 } else { 30.0 }))
    }
}

struct MockTriggerBox(Shared);

impl TriggerBox for MockTriggerBox {
    fn identity(&self) -> DeviceIdentity {
        identity("mock trigger box")
    }
    fn capabilities(&self) -> TriggerCapabilities {
        TriggerCapabilities {
            train_duration: HostDuration::from_millis(lock(&self.0).faults.train_ms),
        }
    }
    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        call(&self.0, DeviceRole::TriggerBox)?;
        let mut w = lock(&self.0);
        if w.t < w.line_until {
            w.violations.push("mark on a busy line".into());
        }
        w.line_until = w.t + w.faults.train_ms * MS;
        Ok(SentMark {
            mark,
            t: HostTime(w.t),
            uncertainty_ns: 1000,
        })
    }

    fn poll(&mut self, _reports: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        Ok(())
    }

    fn take_notes(&mut self) -> Vec<String> {
        Vec::from_iter(lock(&self.0).faults.box_remark.take())
    }
}

pub fn rig(world: &Shared) -> Rig {
    Rig {
        kind: "simulated".into(),
        name: "mock".into(),
        indenter: Box::new(MockIndenter(world.clone())),
        cameras: [
            Box::new(MockCamera(world.clone(), CameraId::One)),
            Box::new(MockCamera(world.clone(), CameraId::Two)),
        ],
        camera_settings: [CameraSettings::default(), CameraSettings::default()],
        trigger_box: Some(Box::new(MockTriggerBox(world.clone()))),
        clock: Box::new(MockClock(world.clone())),
        robot_from_skin: robot_from_skin(),
        geometry: RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: Some(0),
        },
        description_json: "{}".into(),
    }
}

pub const LIMITS: RunLimits = RunLimits {
    workspace_min_mm: [-40.0, -50.0, -3.0],
    workspace_max_mm: [60.0, 55.0, 40.0],
    clearance_mm: 5.0,
    max_depth_mm: 3.0,
    max_speed_mm_s: 100.0,
    max_force_n: 8.0,
    position_tolerance_mm: 0.05,
    settle_time: HostDuration::from_millis(20),
    max_acceleration_mm_s2: None,
    on_trip: OnTrip::Retract,
};

/// Three presses at two places.
pub fn plan() -> Plan {
    let places = [(10.0, 2.0), (10.0, 2.0), (14.0, -6.0)];
    let presses: Vec<PlannedPress> = places
        .iter()
        .enumerate()
        .map(|(i, (x, y))| PlannedPress {
            id: PressId(i as u32),
            role: PressRole::Score,
            repetition: 0,
            location: i as u32,
            at: Point2::new(*x, *y),
            depth_mm: 2.0,
        })
        .collect();
    let mut steps = vec![Step::Begin {
        repetition: Some(0),
    }];
    for (i, p) in presses.iter().enumerate() {
        steps.push(Step::Travel {
            to: p.at.at_height(5.0),
            speed_mm_s: 100.0,
            deadline: HostDuration::from_millis(2000),
        });
        steps.push(Step::Press(PressStep {
            press: p.id,
            at: p.at,
            depth_mm: 2.0,
            surface: Surface::Known,
            start_after_begin: Some(HostDuration::from_millis(300 + 503 * i as i64)),
            approach_speed_mm_s: 50.0,
            indent_speed_mm_s: 20.0,
            hold: HostDuration::from_millis(30),
            retract_speed_mm_s: 70.0,
            marks: vec![MarkKind::Contact, MarkKind::AtDepth, MarkKind::Release],
            deadline: HostDuration::from_millis(1000),
        }));
    }
    steps.push(Step::Pause {
        duration: HostDuration::from_millis(52),
    });
    Plan {
        version: 1,
        name: "mock".into(),
        seed: 1,
        limits: LIMITS,
        surroundings: Some(Surroundings::of(SkinOutline::PAPER)),
        retakes: Retakes::NONE,
        max_consecutive_invalid: 0,
        surface_check: None,
        suspend: Suspend::default(),
        presses,
        steps,
    }
}

pub fn header(plan: &Plan) -> RunHeader {
    RunHeader {
        protocol_text: String::new(),
        protocol_name: "mock".into(),
        protocol_sha256: String::new(),
        overrides: vec![],
        plan_json: "{}".into(),
        plan_sha256: String::new(),
        seed: 1,
        rig_kind: "simulated".into(),
        rig_name: "mock".into(),
        rig_json: "{}".into(),
        robot_from_skin: robot_from_skin(),
        stream_formats: [StreamFormat::Evt2; 2],
        prototype: "p".into(),
        operator: "o".into(),
        started_at: String::new(),
        host: String::new(),
        software: String::new(),
        command_line: String::new(),
        presses: plan.presses.clone(),
    }
}

/// How a sink fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SinkFailure {
    Once,
    Forever,
    Panic,
}

/// Keeps records; fails at the record with this number (from 0) when asked to.
#[derive(Default)]
pub struct Sink {
    pub records: Vec<Record>,
    pub fail: Option<(usize, SinkFailure)>,
    pub offered: usize,
    /// Takes this long for every record but poses, ms of the rig's clock.
    pub slow: Option<(Shared, i64)>,
}

impl RecordSink for Sink {
    fn accept(&mut self, record: Record) -> Result<(), SinkFault> {
        let n = self.offered;
        self.offered += 1;
        if let Some((world, ms)) = &self.slow
            && !matches!(record, Record::Poses(_))
        {
            lock(world).t += ms * MS;
        }
        match self.fail {
            Some((k, SinkFailure::Once)) if n == k => Err(SinkFault("disk full".into())),
            Some((k, SinkFailure::Forever)) if n >= k => Err(SinkFault("disk full".into())),
            Some((k, SinkFailure::Panic)) if n == k => {
                std::panic::panic_any("sink panics".to_owned())
            }
            _ => {
                self.records.push(record);
                Ok(())
            }
        }
    }
}
