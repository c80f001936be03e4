//! The cycle: the contract, every trip, the force limits, braking that is refused.

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
use crate::indenter::{capabilities, check_wanted};
use crate::open::open;
use crate::stream::Stream;

/// Time that passes only when someone waits.
#[derive(Clone, Default)]
struct Virtual(Arc<Mutex<i64>>);

impl Clock for Virtual {
    fn now(&self) -> HostTime {
        HostTime(*self.0.lock().unwrap())
    }

    fn wait_until(&mut self, t: HostTime) {
        let mut now = self.0.lock().unwrap();
        *now = t.0.max(*now);
    }
}

/// The engine in cycles of its own, as the owner thread runs it.
struct Bench {
    engine: Mutex<(Engine<Virtual>, HostTime)>,
    clock: Virtual,
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
        let clock = Virtual::default();
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

    /// Armed within `LIMITS`.
    fn armed() -> Arc<Self> {
        let bench = Self::new();
        bench.ask(|e| e.configure(&LIMITS)).unwrap();
        bench.ask(Engine::arm).unwrap();
        bench
    }

    fn ask<T>(&self, request: impl FnOnce(&mut Engine<Virtual>) -> T) -> T {
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
        self.ask(|e| e.go(Point3::new(x, y, z), speed))
    }

    fn poll(&self) -> (Vec<RobotSample>, u64) {
        let mut samples = Vec::new();
        let dropped = self.stream.take(&mut samples);
        (samples, dropped)
    }
}

/// The robot and the clock of a bench, for the contract.
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
        check_wanted("77", &self.0.config, limits)?;
        self.0.ask(|e| e.configure(limits))
    }
    fn arm(&mut self) -> Result<(), DeviceError> {
        self.0.ask(Engine::arm)
    }
    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.0.ask(|e| e.go(target, speed_mm_s))
    }
    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        self.0.stream.take(samples);
        self.0.stream.failure().map_or(Ok(()), Err)
    }
    fn hold(&mut self) -> Result<(), DeviceError> {
        self.0.ask(Engine::hold)
    }
    fn disarm(&mut self) -> Result<(), DeviceError> {
        self.0.ask(Engine::disarm)
    }
}

const LIMITS: MotionLimits = MotionLimits {
    min_mm: [-10.0, -30.0, -30.0],
    max_mm: [50.0, 30.0, 30.0],
    max_speed_mm_s: 40.0,
    max_acceleration_mm_s2: 200.0,
    max_force_n: 4.0,
};

#[test]
fn keeps_the_contract() {
    let options = IndenterContract {
        limits: LIMITS,
        targets: [Point3::new(20.0, 0.0, -5.0), Point3::new(25.0, 8.0, 12.0)],
        outside: Point3::new(0.0, 31.0, 0.0),
        speed_mm_s: 30.0,
        tolerance_mm: 0.05,
        patience: HostDuration::from_millis(2_000),
        rate_share: 0.9,
    };
    contract::indenter(
        &mut || {
            let bench = Bench::new();
            (Box::new(Handle(bench.clone())), Box::new(Handle(bench)))
        },
        &options,
    );
}

#[test]
fn a_start_that_forgets_everything_is_configured_again_before_the_first_target() {
    let bench = Bench::armed();
    let log = bench.sdk.log();
    let start = log.iter().position(|c| c == "drdStart").unwrap();
    let target = log.iter().position(|c| c == "drdTrackPos").unwrap();
    for call in [
        "motor_ratio_max",
        "gain_i",
        "move_parameters",
        "track_parameters",
        "drdEnableFilter",
    ] {
        let last = log.iter().rposition(|c| c == call).unwrap();
        assert!(start < last && last < target, "{call} in {log:?}");
    }
    let pace = bench.sdk.with(|s| s.paces[1]);
    assert!(pace.speed_m_s < 0.1, "never the library's 1 m/s: {pace}");
    let ratio = bench.sdk.with(|s| s.values["motor_ratio_max"]);
    assert!((ratio - 4.0 / 12.0).abs() < 1e-12, "{ratio}");
}

#[test]
fn what_does_not_read_back_is_not_armed() {
    for (ignored, name) in [
        ("motor_ratio_max", "motor_ratio_max"),
        ("gain_i", "gain_i"),
        ("track_parameters", "track_parameters"),
        ("filter", "track_filter"),
    ] {
        let bench = Bench::new();
        bench.ask(|e| e.configure(&LIMITS)).unwrap();
        bench.sdk.with(|s| {
            s.ignore.push(ignored);
            s.paces[1].speed_m_s = 1.0;
            s.values.clear();
        });
        let error = bench.ask(Engine::arm).unwrap_err();
        let DeviceError::ReadBack { name: found, .. } = &error else {
            panic!("{ignored}: {error}")
        };
        assert_eq!(found, name);
        assert!(!bench.sdk.with(|s| s.live), "{ignored}: left live");
    }
}

/// What happens, and a word that the error must hold.
type Mishap = (fn(&Scripted), &'static str);

#[test]
fn every_fault_brakes_and_is_named_until_disarmed() {
    let mishaps: [Mishap; 12] = [
        (|s| s.with(|s| s.cached = true), "no new position"),
        (|s| s.with(|s| s.running = false), "regulation thread ended"),
        (|s| s.with(|s| s.khz = 0.5), "regulation loop is slow"),
        (
            |s| s.with(|s| (s.live, s.cause) = (false, 1)),
            "force button",
        ),
        (|s| s.with(|s| (s.live, s.cause) = (false, 2)), "velocity"),
        (|s| s.with(|s| (s.live, s.cause) = (false, 3)), "watchdog"),
        (|s| s.with(|s| s.position_m[1] = f64::NAN), "finite"),
        (|s| s.with(|s| s.position_m[1] += 0.02), "jumped"),
        (|s| s.with(|s| s.force_n[0] = f64::NAN), "finite"),
        (|s| s.with(|s| s.force_n[2] = -6.5), "at most 6.00 N"),
        (
            |s| s.fail("drdTrackPos", ErrorCode::GEOMETRY),
            "out of reach",
        ),
        (
            |s| s.fail("drdGetPositionAndOrientation", ErrorCode::DHC_BUSY),
            "busy",
        ),
    ];
    for (happens, word) in mishaps {
        let bench = Bench::armed();
        bench.go([20.0, 0.0, -5.0], 20.0).unwrap();
        bench.run_ms(30);
        happens(&bench.sdk);
        bench.run_ms(220);
        let failure = bench.stream.failure();
        let Some(DeviceError::State { found, .. }) = &failure else {
            panic!("{word}: {failure:?}")
        };
        assert!(found.contains(word), "{word} is not in {found}");
        assert!(!bench.sdk.with(|s| s.live), "{word}: left live");
        let refused = bench.go([20.0, 0.0, 5.0], 20.0);
        assert!(matches!(refused, Err(DeviceError::State { .. })), "{word}");
        assert!(
            bench.ask(Engine::arm).is_err(),
            "{word}: armed after a fault"
        );
        // Repaired and disarmed by the operator, it serves again.
        bench.sdk.with(|s| {
            *s = super::scripted::Script {
                log: Vec::new(),
                ..Scripted::default().script.into_inner().unwrap()
            }
        });
        bench.ask(Engine::disarm).unwrap();
        bench.ask(Engine::arm).unwrap();
        assert_eq!(bench.stream.failure(), None, "{word}");
    }
}

#[test]
fn a_robot_that_is_gone_stays_gone() {
    for armed in [true, false] {
        let bench = Bench::armed();
        if !armed {
            bench.ask(Engine::disarm).unwrap();
        }
        for call in [
            "drdGetPositionAndOrientation",
            "dhdGetPosition",
            "drdStop",
            "dhdStop",
            "dhdGetStatus",
        ] {
            bench.sdk.fail(call, ErrorCode::COM);
        }
        bench.run_ms(50);
        let failure = bench.stream.failure().unwrap();
        assert!(matches!(failure, DeviceError::Lost { .. }), "{failure}");
        let words = failure.to_string();
        assert!(words.contains("link to the device broke"), "{words}");
        for answer in [
            bench.ask(Engine::disarm),
            bench.ask(Engine::arm),
            bench.ask(Engine::hold),
        ] {
            assert!(
                matches!(answer, Err(DeviceError::Lost { .. })),
                "{answer:?}"
            );
        }
    }
}

#[test]
fn a_refused_brake_is_tried_in_every_way_and_told_loudly() {
    let bench = Bench::armed();
    bench.sdk.with(|s| s.fail.insert("drdStop", (22, 3)));
    bench.sdk.with(|s| s.fail.insert("dhdStop", (1, 3)));
    let before = bench.clock.now();
    bench.ask(Engine::disarm).unwrap();
    let tries = bench.sdk.log().iter().filter(|c| *c == "drdStop").count();
    assert_eq!(tries, 4);
    assert_eq!(bench.clock.now() - before, HostDuration::from_millis(300));

    bench.ask(Engine::arm).unwrap();
    bench.sdk.fail("drdStop", ErrorCode::NO_REGULATION);
    bench.sdk.fail("dhdStop", ErrorCode::COM);
    let error = bench.ask(Engine::disarm).unwrap_err().to_string();
    for word in ["may be live", "20 attempts", "mains"] {
        assert!(error.contains(word), "{word} is not in {error}");
    }
}

#[test]
fn a_brake_that_only_claims_to_work_is_not_believed() {
    let bench = Bench::armed();
    bench.sdk.with(|s| s.status.insert(5, 1));
    let error = bench.ask(Engine::disarm).unwrap_err().to_string();
    assert!(error.contains("motors are live"), "{error}");
}

#[test]
fn at_the_force_limit_the_tip_stops_and_may_only_rise() {
    let bench = Bench::armed();
    bench.go([20.0, 0.0, 0.0], 20.0).unwrap();
    bench.run_ms(100);
    // 4.2 N above the 0.2 N at which it hung still: the limit is 4 N.
    bench.sdk.with(|s| s.force_n = [0.0, 0.0, 0.2 - 4.1]);
    bench.run_ms(1);
    bench.poll();
    bench.run_ms(50);
    let (samples, _) = bench.poll();
    let set_points: Vec<_> = samples.iter().map(|s| s.commanded).collect();
    assert!(set_points.windows(2).all(|w| w[0] == w[1]), "it went on");
    assert!((samples[0].force_n - 4.1).abs() < 1e-9, "{:?}", samples[0]);
    assert_eq!(bench.stream.failure(), None);
    let deeper = bench.go([20.0, 0.0, 0.0], 20.0);
    assert!(
        matches!(deeper, Err(DeviceError::Refused { .. })),
        "{deeper:?}"
    );
    bench.sdk.with(|s| s.force_n = [0.0, 0.0, 0.2]);
    bench.run_ms(1);
    let still = bench.go([20.0, 0.0, 0.0], 20.0);
    assert!(still.is_err(), "only a rise releases it");
    bench.go([20.0, 0.0, 12.0], 20.0).unwrap();
    bench.run_ms(1000);
    bench.go([20.0, 0.0, 0.0], 20.0).unwrap();
}

#[test]
fn an_arm_that_rests_on_something_is_not_armed() {
    let bench = Bench::new();
    bench.ask(|e| e.configure(&LIMITS)).unwrap();
    bench.sdk.with(|s| s.force_n = [0.0, 0.0, -1.8]);
    let error = bench.ask(Engine::arm).unwrap_err().to_string();
    assert!(error.contains("does not hang free"), "{error}");
    assert!(!bench.sdk.with(|s| s.live));
    // Told once; the robot is disarmed.
    assert_eq!(bench.stream.failure(), None);
}

#[test]
fn an_arm_that_nobody_looks_at_is_braked_and_one_that_is_polled_is_not() {
    let bench = Bench::armed();
    bench.go([20.0, 0.0, 5.0], 20.0).unwrap();
    for _ in 0..5 {
        bench.run_ms(1900);
        bench.poll();
    }
    bench.run_ms(1990);
    assert_eq!(bench.stream.failure(), None);
    assert!(bench.sdk.with(|s| s.live));
    bench.run_ms(20);
    assert!(!bench.sdk.with(|s| s.live));
    let failure = bench.stream.failure().unwrap().to_string();
    assert!(
        failure.contains("nobody looked at the live arm for 2s"),
        "{failure}"
    );
    // Braked, it may be left alone.
    bench.ask(Engine::disarm).unwrap();
    bench.run_ms(10_000);
    assert_eq!(bench.stream.failure(), None);
}

#[test]
fn a_way_aside_is_no_rise_however_far_the_arm_sags() {
    let bench = Bench::armed();
    // It hangs 1 mm below its set point.
    bench
        .sdk
        .with(|s| (s.follows, s.position_m[2]) = (false, 0.009));
    bench.go([25.0, 0.0, 10.0], 20.0).unwrap();
    bench.run_ms(100);
    bench.sdk.with(|s| s.force_n = [0.0, 0.0, 0.2 - 4.1]);
    bench.run_ms(1);
    let stopped = bench.sdk.with(|s| s.target_m);
    bench.run_ms(50);
    assert_eq!(bench.sdk.with(|s| s.target_m), stopped, "it went on");
    let [x, y, _] = stopped.map(|m| m * 1e3);
    for (to, allowed) in [
        ([x, y, 10.0], false),
        ([x + 5.0, y, 10.5], false),
        ([x + 5.0, y, 20.0], true),
        ([x, y, 20.0], true),
    ] {
        assert_eq!(bench.go(to, 20.0).is_ok(), allowed, "{to:?}");
    }
}

#[test]
fn forces_that_cannot_be_read_trip_though_positions_can() {
    let bench = Bench::armed();
    bench.sdk.fail("dhdGetForce", ErrorCode::TIMEOUT);
    bench.run_ms(20);
    let failure = bench.stream.failure().unwrap().to_string();
    assert!(failure.contains("dhdGetForce"), "{failure}");
    assert!(!bench.sdk.with(|s| s.live));
}

#[test]
fn readings_that_fail_slowly_are_a_silence() {
    let bench = Bench::armed();
    bench.go([20.0, 0.0, 0.0], 5.0).unwrap();
    bench
        .sdk
        .with(|s| s.fail.insert("dhdGetForce", (ErrorCode::TIMEOUT.0, 5)));
    let mut clock = bench.clock.clone();
    for _ in 0..4 {
        // Each call takes 100 ms to fail.
        let later = clock.now() + HostDuration::from_millis(100);
        clock.wait_until(later);
        bench.ask(Engine::tick);
    }
    let failure = bench.stream.failure().unwrap().to_string();
    assert!(failure.contains("no new position"), "{failure}");
}

#[test]
fn a_brake_that_fails_ends_the_motion_and_is_tried_again() {
    let bench = Bench::armed();
    bench.go([20.0, 0.0, -20.0], 20.0).unwrap();
    bench.run_ms(50);
    for call in ["drdStop", "dhdStop", "dhdEnableForce"] {
        bench.sdk.fail(call, ErrorCode::DHC_BUSY);
    }
    let error = bench.ask(Engine::disarm).unwrap_err();
    assert_eq!(bench.stream.failure(), Some(error));
    let target = bench.sdk.with(|s| s.target_m);
    bench.run_ms(100);
    assert_eq!(bench.sdk.with(|s| s.target_m), target, "it moves on");
    assert!(bench.go([20.0, 0.0, 20.0], 20.0).is_err());
    bench.sdk.with(|s| s.fail.clear());
    bench.ask(Engine::disarm).unwrap();
    assert!(!bench.sdk.with(|s| s.live));
    bench.ask(Engine::arm).unwrap();
    assert_eq!(bench.stream.failure(), None);
}

#[test]
fn a_cause_from_before_arming_is_not_taken_for_a_new_one() {
    for (cause, ended, word) in [
        (5, true, "regulation thread ended"),
        (1, true, "regulation thread ended"),
        (1, false, "without a new cause"),
    ] {
        let bench = Bench::new();
        bench.sdk.with(|s| s.cause = cause);
        bench.ask(|e| e.configure(&LIMITS)).unwrap();
        bench.ask(Engine::arm).unwrap();
        bench.sdk.with(|s| (s.running, s.live) = (!ended, false));
        bench.run_ms(30);
        let failure = bench.stream.failure().unwrap();
        assert!(matches!(failure, DeviceError::State { .. }), "{failure}");
        assert!(failure.to_string().contains(word), "{word}: {failure}");
    }
}

#[test]
fn what_the_device_answered_is_recorded_number_by_number() {
    let bench = Bench::new();
    let settings = bench.ask(|e| e.configure(&LIMITS)).unwrap();
    let speed = settings
        .iter()
        .find(|s| s.name == "track_parameters_speed_m_s")
        .unwrap();
    assert_eq!((&*speed.requested, &*speed.read_back), ("0.08", "0.08"));
    let read_of = |name: &str| {
        let settings = bench.ask(|e| e.configure(&LIMITS)).unwrap();
        let found = settings.into_iter().find(|s| s.name == name).unwrap();
        (found.requested, found.read_back)
    };
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    assert_eq!(read_of("initialised"), pair("true", "true"));
    bench.sdk.with(|s| s.initialised = false);
    assert_eq!(read_of("initialised"), pair("true", "false"));
}

#[test]
fn a_library_that_takes_settings_only_while_regulating_is_no_difference() {
    let bench = Bench::new();
    bench
        .sdk
        .with(|s| s.needs_regulation.push("motor_ratio_max"));
    let settings = bench.ask(|e| e.configure(&LIMITS)).unwrap();
    for s in &settings {
        let as_found = s.requested == Setting::AS_FOUND;
        assert!(as_found || s.requested == s.read_back, "{s:?}");
    }
    assert!(settings.iter().all(|s| s.name != "gain_i"));
    bench.ask(Engine::arm).unwrap();
    bench.ask(Engine::disarm).unwrap();
    let settings = bench.ask(|e| e.configure(&LIMITS)).unwrap();
    assert!(settings.iter().any(|s| s.name == "gain_i"), "{settings:?}");
}

#[test]
fn a_watchdog_that_a_start_forgets_is_set_again() {
    let bench = Bench::armed();
    assert_eq!(bench.sdk.with(|s| s.watchdog), 80);
    bench.ask(Engine::disarm).unwrap();
    bench.sdk.with(|s| s.ignore.push("watchdog"));
    let error = bench.ask(Engine::arm).unwrap_err();
    assert!(
        matches!(&error, DeviceError::ReadBack { name, .. } if name == "watchdog_125us"),
        "{error}"
    );
    assert!(!bench.sdk.with(|s| s.live));
}

#[test]
fn a_stuck_arm_pulls_no_further_than_the_lead() {
    let bench = Bench::armed();
    bench.sdk.with(|s| s.follows = false);
    bench.go([20.0, 0.0, -20.0], 20.0).unwrap();
    for _ in 0..200 {
        bench.run_ms(5);
        let (lead, live) = bench.sdk.with(|s| {
            let d: f64 = (0..3)
                .map(|i| (s.target_m[i] - s.position_m[i]).powi(2))
                .sum();
            (d.sqrt() * 1e3, s.live)
        });
        assert!(
            live && lead <= bench.config.motion.max_lead_mm + 1e-9,
            "{lead} mm"
        );
    }
}

#[test]
fn a_robot_that_presses_to_its_front_has_the_robot_frame_turned() {
    let mut config = OmegaConfig::default();
    // Robot z, away from the sample, is the device's -x.
    config.mount.axes = Axes::new([Axis::PlusZ, Axis::PlusY, Axis::MinusX]).unwrap();
    config.envelope.min_mm = [-40.0; 3];
    config.envelope.max_mm = [40.0; 3];
    let bench = Bench::with(config);
    let limits = MotionLimits {
        min_mm: [-30.0; 3],
        max_mm: [30.0; 3],
        ..LIMITS
    };
    bench.ask(|e| e.configure(&limits)).unwrap();
    bench.sdk.with(|s| s.force_n = [0.0; 3]);
    bench.ask(Engine::arm).unwrap();
    bench.go([5.0, -3.0, -25.0], 20.0).unwrap();
    bench.run_ms(1900);
    bench.poll();
    let at = bench.sdk.with(|s| s.position_m);
    let off: f64 = (0..3)
        .map(|i| (at[i] - [0.025, -0.003, 0.005][i]).abs())
        .sum();
    assert!(off < 1e-6, "{at:?}");
    // The motors push along +x, into the sample: it pushes back along robot +z.
    bench.sdk.with(|s| s.force_n = [1.5, 0.0, 0.0]);
    bench.run_ms(2);
    let (samples, _) = bench.poll();
    let last = samples.last().unwrap();
    assert!((last.force_n - 1.5).abs() < 1e-9, "{last:?}");
}

#[test]
fn an_unread_stream_is_bounded_and_counts_what_it_lost() {
    let bench = Bench::armed();
    for _ in 0..10 {
        // Somebody is there, and takes no samples.
        bench.ask(Engine::hold).unwrap();
        bench.run_ms(1000);
    }
    let (samples, dropped) = bench.poll();
    assert_eq!(samples.len(), crate::stream::CAPACITY);
    assert!(dropped > 3_000, "{dropped}");
    let (_, again) = bench.poll();
    assert_eq!(again, 0);
}

#[test]
fn late_cycles_slow_the_motion_and_never_lengthen_a_step() {
    let bench = Bench::armed();
    bench.go([20.0, 0.0, -20.0], 40.0).unwrap();
    let mut clock = bench.clock.clone();
    let mut last = bench.sdk.with(|s| s.target_m);
    for _ in 0..100 {
        let later = clock.now() + HostDuration::from_millis(50);
        clock.wait_until(later);
        bench.poll();
        bench.ask(Engine::tick);
        let now = bench.sdk.with(|s| s.target_m);
        let step = (now[2] - last[2]).abs() * 1e3;
        assert!(step <= bench.config.motion.max_step_mm + 1e-9, "{step} mm");
        last = now;
    }
    assert!(last[2] < 0.009, "it still moves: {last:?}");
}

#[test]
fn however_the_owner_ends_the_arm_is_braked_and_closed() {
    let bench = Bench::armed();
    let sdk = bench.sdk.clone();
    drop(bench);
    let log = sdk.log();
    let [.., stop, close] = log.as_slice() else {
        panic!("{log:?}")
    };
    assert_eq!((stop.as_str(), close.as_str()), ("drdStop", "drdClose"));
}
