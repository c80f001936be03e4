//! Tests of the engine: contract, trips, force limits, and failing brakes.

mod arming;
mod faults;
mod motion;

use std::sync::{Arc, Mutex};

use skinrig_device::contract::{self, IndenterContract};
use skinrig_device::{
    Clock, DeviceError, Indenter, IndenterCapabilities, MotionLimits, RobotSample,
};
use skinrig_drd_abi::ErrorCode;
use skinrig_model::{DeviceIdentity, HostDuration, HostTime, Point3, Robot, Setting};

use super::scripted::Scripted;
use crate::OmegaConfig;
use crate::axes::{Axes, Axis};
use crate::engine::Engine;
use crate::indenter::{capabilities, check_limits_of_run};
use crate::open::open;
use crate::stream::Stream;

/// Virtual time that advances only during waits.
#[derive(Clone, Default)]
struct VirtualClock(Arc<Mutex<i64>>);

impl Clock for VirtualClock {
    fn now(&self) -> HostTime {
        HostTime(*self.0.lock().unwrap())
    }

    fn wait_until(&mut self, t: HostTime) {
        let mut now = self.0.lock().unwrap();
        *now = t.0.max(*now);
    }
}

/// Runs the engine cycle by cycle like the owner thread.
struct Bench {
    engine: Mutex<(Engine<VirtualClock>, HostTime)>,
    clock: VirtualClock,
    stream: Arc<Stream>,
    sdk: Arc<Scripted>,
    config: OmegaConfig,
}

impl Bench {
    fn new() -> Arc<Self> {
        Self::with(OmegaConfig::default())
    }

    fn with(config: OmegaConfig) -> Arc<Self> {
        let sdk = Arc::new(Scripted::default());
        let clock = VirtualClock::default();
        let stream = Arc::new(Stream::default());
        let opened = open(&*sdk, &config, |_| Ok(())).unwrap();
        let engine = Engine::new(
            sdk.clone(),
            Arc::new(config.clone()),
            opened,
            clock.clone(),
            stream.clone(),
            None,
        );
        Arc::new(Self {
            engine: Mutex::new((engine, HostTime::ZERO)),
            clock,
            stream,
            sdk,
            config,
        })
    }

    /// An armed bench with `LIMITS`.
    fn armed() -> Arc<Self> {
        let bench = Self::new();
        bench.request(|e| e.configure(&LIMITS)).unwrap();
        bench.request(Engine::arm).unwrap();
        bench
    }

    fn request<T>(&self, request: impl FnOnce(&mut Engine<VirtualClock>) -> T) -> T {
        request(&mut self.engine.lock().unwrap().0)
    }

    fn run_until(&self, t: HostTime) {
        let (engine, next) = &mut *self.engine.lock().unwrap();
        let mut clock = self.clock.clone();
        while *next <= t {
            clock.wait_until(*next);
            engine.tick();
            *next = (*next + engine.period()).max(clock.now());
        }
        clock.wait_until(t);
    }

    fn run_ms(&self, ms: i64) {
        self.run_until(self.clock.now() + HostDuration::from_millis(ms));
    }

    fn go(&self, to: [f64; 3], speed: f64) -> Result<(), DeviceError> {
        let [x, y, z] = to;
        self.request(|e| e.go(Point3::new(x, y, z), speed))
    }

    fn poll(&self) -> (Vec<RobotSample>, u64) {
        let mut samples = Vec::new();
        let dropped = self.stream.take(&mut samples);
        (samples, dropped)
    }
}

/// Robot and clock of a bench, for the contract tests.
struct Handle(Arc<Bench>);

impl Clock for Handle {
    fn now(&self) -> HostTime {
        self.0.clock.now()
    }

    fn wait_until(&mut self, t: HostTime) {
        self.0.run_until(t);
    }
}

impl Indenter for Handle {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            model: "scripted omega.3".to_owned(),
            serial: "77".to_owned(),
            firmware: String::new(),
        }
    }
    fn capabilities(&self) -> IndenterCapabilities {
        capabilities(&self.0.config)
    }
    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        check_limits_of_run("77", &self.0.config, limits)?;
        self.0.request(|e| e.configure(limits))
    }
    fn arm(&mut self) -> Result<(), DeviceError> {
        self.0.request(Engine::arm)
    }
    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.0.request(|e| e.go(target, speed_mm_s))
    }
    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        self.0.stream.take(samples);
        self.0.stream.failure().map_or(Ok(()), Err)
    }
    fn hold(&mut self) -> Result<(), DeviceError> {
        self.0.request(Engine::hold)
    }
    fn disarm(&mut self) -> Result<(), DeviceError> {
        self.0.request(Engine::disarm)
    }
}

const LIMITS: MotionLimits = MotionLimits {
    min_mm: [-10.0, -30.0, -30.0],
    max_mm: [50.0, 30.0, 30.0],
    max_speed_mm_s: 40.0,
    max_acceleration_mm_s2: 200.0,
    max_force_n: 4.0,
};

/// A fault, and a phrase that the error must contain.
type FaultCase = (fn(&Scripted), &'static str);
