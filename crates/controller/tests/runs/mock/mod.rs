//! A small deterministic rig: ideal straight motions, numbered device calls that can be made to fail.

mod devices;
mod plan;

use std::sync::{Arc, Mutex, MutexGuard};

use skinrig_controller::{ControlHandle, RecordSink, SinkFault};
use skinrig_device::{
    CameraCapabilities, CameraSettings, Clock, DeviceError, EventCamera, Indenter,
    IndenterCapabilities, MotionLimits, Rig, RobotSample, TriggerBox, TriggerCapabilities,
};
use skinrig_model::*;
use skinrig_protocol::area::Surroundings;
use skinrig_protocol::plan::{Plan, PressStep, RunLimits, Step, TripReaction};
use skinrig_protocol::{Retakes, Surface, Suspend};

pub(crate) use devices::*;
pub(crate) use plan::*;

pub(crate) const MS: i64 = 1_000_000;

/// How a numbered call fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Failure {
    /// That call alone fails.
    Once,
    /// That call, and every later one to the same device, fails.
    Forever,
    /// That call panics.
    Panic,
}

/// Text of the operator's note.
pub(crate) const NOTE: &str = "Ann: the lamp flickers";

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OperatorAction {
    Pause,
    PauseNow,
    Stop,
    Abort,
    Halt,
    /// A note.
    Note,
}

impl OperatorAction {
    /// Every request; a note is not a request.
    pub(crate) const REQUESTS: [Self; 5] = [
        Self::Pause,
        Self::PauseNow,
        Self::Stop,
        Self::Abort,
        Self::Halt,
    ];
}

/// Fault of the robot's feedback.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FeedbackFault {
    /// A force of 9 N.
    Force,
    /// The tip sinks 0.05 mm every millisecond.
    Sink,
    /// The tip slides 0.3 mm every millisecond.
    Slide,
    /// A coordinate is NaN.
    Nan,
    /// The same sample twice.
    Twice,
    /// No more samples.
    Silence,
    /// The clock jumps by 1.5 s, and the samples follow.
    Late,
}

/// Faults of the mock world.
#[derive(Debug, Clone, Default)]
pub(crate) struct Faults {
    pub at_call: Option<(u64, Failure)>,
    /// The tip cannot go below this height from this time on, ms.
    pub floor_mm: Option<(i64, f64, i64)>,
    /// The pose stream ends at this time, ms.
    pub poses_end_ms: Option<i64>,
    /// Bytes lost by a camera before its chunk with this number.
    pub loss: Option<(CameraId, u64, u64)>,
    /// Cameras report their time. From this time on, ms, data of camera 2 take so long, ms.
    pub delay: Option<(i64, i64)>,
    /// Camera 2 loses bytes at this time, ms, and reports this with the data that follow.
    pub lost_at_ms: Option<i64>,
    /// Camera 1 reports its temperature: 70 °C in this time, ms, 30 °C otherwise.
    pub hot_ms: Option<std::ops::Range<i64>>,
    /// A camera and a note from it, once.
    pub remark: Option<(CameraId, String)>,
    /// A note from the trigger box, once.
    pub box_remark: Option<String>,
    /// The tip is laterally stuck from this time on, ms.
    pub stuck_sideways_ms: Option<i64>,
    /// Feedback fault once the tip is 1 mm deep.
    pub strike: Option<FeedbackFault>,
    /// The operator's action at this tick.
    pub operator: Option<(u64, OperatorAction)>,
    /// A halt this many ticks after it.
    pub halt_after: Option<u64>,
    /// Encoder noise: seed, largest error in counts of 0.01 mm, and lateral offset of the resting tip, mm.
    pub encoders: Option<(u64, i64, f64)>,
    /// A braked tip in contact sinks this far when its brakes open, mm, until it has risen.
    pub sinks_mm: f64,
    /// N per mm of indentation.
    pub stiffness_n_mm: f64,
    pub train_ms: i64,
}

pub(crate) struct World {
    pub t: i64,
    pub calls: u64,
    pub ticks: u64,
    pub faults: Faults,
    pub control: ControlHandle,
    pub armed: bool,
    pub ever_armed: bool,
    /// A disarm succeeded since the last arm.
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
    /// Cameras in start order.
    pub started: Vec<CameraId>,
    pub seq: [u64; 2],
    /// Number of temperature reads per camera.
    pub temperature_reads: [u32; 2],
    pub line_until: i64,
    pub clearance_mm: f64,
    /// Time at which the feedback fault first broke a limit.
    pub broken_at: Option<i64>,
    struck_for: i64,
    /// Commands to the robot besides motions: time, `hold` or `disarm`.
    pub robot_calls: Vec<(i64, &'static str)>,
    samples: Vec<RobotSample>,
}

pub(crate) type Shared = Arc<Mutex<World>>;

pub(crate) fn lock(world: &Shared) -> MutexGuard<'_, World> {
    world.lock().unwrap_or_else(|e| e.into_inner())
}

/// Pose of the mock's skin: rotated by 90 degrees and shifted, to detect mixed-up frames.
pub(crate) fn robot_from_skin() -> RigidTransform<Robot, Skin> {
    RigidTransform::new(
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        [5.0, -3.0, 12.0],
    )
}

impl World {
    pub(crate) fn shared(faults: Faults, start: [f64; 3]) -> Shared {
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
            temperature_reads: [0; 2],
            line_until: 0,
            clearance_mm: 5.0,
            broken_at: None,
            struck_for: 0,
            robot_calls: vec![],
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
            if self.armed && self.faults.sinks_mm > 0.0 {
                // Lateral motion and sinking alternate.
                tip[2] -= if ms % 8 >= 4 {
                    self.faults.sinks_mm
                } else {
                    0.0
                };
                if tip[2] > 0.0 {
                    self.faults.sinks_mm = 0.0;
                }
            }
            if self.faults.stuck_sideways_ms.is_some_and(|from| ms >= from) {
                (tip[0], tip[1]) = (self.tip[0], self.tip[1]);
            }
            let lateral = libm::hypot(tip[0] - self.tip[0], tip[1] - self.tip[1]);
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
                    measured: to_robot(self.reading(tip)),
                    force_n: (-tip[2]).max(0.0) * self.faults.stiffness_n_mm,
                };
                self.deliver(sample, tip);
            }
        }
    }

    /// Encoder reading of a tip position: whole counts, each with a random error.
    fn reading(&mut self, tip: [f64; 3]) -> [f64; 3] {
        const COUNT_MM: f64 = 0.01;
        let Some((random, counts, aside_mm)) = &mut self.faults.encoders else {
            return tip;
        };
        let mut draw = || {
            // xorshift64: Marsaglia, "Xorshift RNGs", J. Stat. Softw. 8 (2003).
            *random ^= *random << 13;
            *random ^= *random >> 7;
            *random ^= *random << 17;
            *random
        };
        // Occasionally a jolt in free air, beyond the tolerance.
        let jolted = tip[2] > self.clearance_mm - COUNT_MM && draw() % 200 == 0;
        let jolt_mm = if jolted { 6.0 * COUNT_MM } else { 0.0 };
        [tip[0] + *aside_mm + jolt_mm, tip[1], tip[2]].map(|mm| {
            let off = (draw() % (2 * counts.unsigned_abs() + 1)) as i64 - *counts;
            ((mm / COUNT_MM).round() + off as f64) * COUNT_MM
        })
    }

    /// Stores a sample, changed by the feedback fault while the arm is low.
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
            FeedbackFault::Force => sample.force_n = 9.0,
            FeedbackFault::Sink => {
                tip[2] -= 0.05 * n;
                broken = tip[2] < -3.05;
            }
            FeedbackFault::Slide => tip[0] += 0.3 * n,
            FeedbackFault::Nan => tip[1] = f64::NAN,
            FeedbackFault::Twice => self.samples.push(sample),
            FeedbackFault::Silence => {}
            FeedbackFault::Late => broken = false, // the clock shows it
        }
        sample.measured = robot_from_skin().apply(Point3::new(tip[0], tip[1], tip[2]));
        if broken {
            self.broken_at.get_or_insert(self.sampled_to);
        }
        if strike != FeedbackFault::Silence {
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

pub(crate) fn rig(world: &Shared) -> Rig {
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
            trigger_delay_us: [0; 2],
        },
        description_json: "{}".into(),
    }
}

pub(crate) const LIMITS: RunLimits = RunLimits {
    workspace_min_mm: [-40.0, -50.0, -3.0],
    workspace_max_mm: [60.0, 55.0, 40.0],
    clearance_mm: 5.0,
    max_depth_mm: 3.0,
    max_speed_mm_s: 100.0,
    max_force_n: 8.0,
    position_tolerance_mm: 0.05,
    settle_time: HostDuration::from_millis(20),
    max_acceleration_mm_s2: None,
    on_trip: TripReaction::Retract,
};
