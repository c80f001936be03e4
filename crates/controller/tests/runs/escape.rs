//! Checks that no command escapes the guard: arbitrary commands, feedback and failures, with a robot that checks all commands.
//!
//! The robot keeps its own model of delivered samples and received commands, based on the limits and not on the guard's
//! code. `every_sequence` runs a bounded number of cases; `millions_of_sequences` the number in `SKINRIG_FUZZ_CASES`.

use std::sync::{Arc, Mutex, MutexGuard};

use proptest::prelude::*;
use proptest::test_runner::TestCaseResult;
use skinrig_controller::{ControllerSettings, GuardedIndenter, RunFault};
use skinrig_device::{
    Clock, DeviceError, Indenter, IndenterCapabilities, MotionLimits, RobotSample,
};
use skinrig_model::{DeviceIdentity, DeviceRole, HostTime, Point3, Robot, Setting};
use skinrig_protocol::plan::{RunLimits, TripReaction};

use crate::mock::{LIMITS, MS, robot_from_skin};

/// A command to the robot, or its next feedback.
#[derive(Debug, Clone)]
enum Act {
    Command([f64; 3], f64),
    /// Straight up or down from the last reported tip position, by this much, at this speed.
    Vertical(f64, f64),
    Arm,
    Disarm,
    Hold,
    /// Time passes, ms, with good samples.
    Good(u8),
    /// Time passes, ms, without polling.
    Blind(u16),
    /// A poll without new samples.
    Nothing,
    /// One sample with a coordinate replaced.
    Coordinate(usize, f64),
    /// One sample with this force.
    Force(f64),
    /// One sample this many ms off its time: repeated, reordered, or from the future.
    Shifted(i16),
    /// The next call to the robot fails.
    Fail,
}

fn number(low: f64, high: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => low..high,
        1 => prop::sample::select(vec![0.0, -0.0, 5.0, 4.95, -3.0, -3.000001, 40.0, 100.0]),
        1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, f64::MIN_POSITIVE]),
    ]
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        4 => (number(-60.0, 80.0), number(-60.0, 60.0), number(-5.0, 45.0), number(-20.0, 130.0))
            .prop_map(|(x, y, z, v)| Act::Command([x, y, z], v)),
        6 => (number(-9.0, 9.0), number(0.0, 100.0)).prop_map(|(dz, v)| Act::Vertical(dz, v)),
        3 => Just(Act::Arm),
        1 => Just(Act::Disarm),
        1 => Just(Act::Hold),
        10 => (1u8..60).prop_map(Act::Good),
        1 => (0u16..300).prop_map(Act::Blind),
        1 => Just(Act::Nothing),
        1 => (0usize..6, number(-80.0, 80.0)).prop_map(|(i, v)| Act::Coordinate(i, v)),
        1 => number(-20.0, 20.0).prop_map(Act::Force),
        1 => (-300i16..3000).prop_map(Act::Shifted),
        1 => Just(Act::Fail),
    ]
}

/// The robot's own model, skin frame.
#[derive(Default)]
struct RobotModel {
    now: i64,
    armed: bool,
    tip: [f64; 3],
    target: [f64; 3],
    speed: f64,
    moved_to: i64,
    fail_next: bool,
    /// Samples for the next poll.
    waiting: Vec<RobotSample>,
    /// Time and position of the newest well-formed sample that was delivered.
    newest: Option<(i64, [f64; 3])>,
    /// A delivered or stale sample forbids all motion but a rise; or, if blind, all motion.
    tripped: bool,
    blind: bool,
    on_trip: TripReaction,
    /// Commands since the last poll.
    received: Vec<&'static str>,
    commands: u32,
    escapes: Vec<String>,
}

type Shared = Arc<Mutex<RobotModel>>;

fn lock(model: &Shared) -> MutexGuard<'_, RobotModel> {
    model
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl RobotModel {
    fn call(&mut self, what: &'static str) -> Result<(), DeviceError> {
        self.received.push(what);
        if std::mem::take(&mut self.fail_next) {
            return Err(DeviceError::Lost {
                role: DeviceRole::Indenter,
                serial: "model".into(),
                detail: "no answer".into(),
            });
        }
        Ok(())
    }

    fn sample(&self, t: i64, at: [f64; 3], force_n: f64) -> RobotSample {
        let place = robot_from_skin().apply(Point3::new(at[0], at[1], at[2]));
        RobotSample {
            t: HostTime(t),
            commanded: place,
            measured: place,
            force_n,
        }
    }

    /// Ideal motion, a sample every 8 ms.
    fn advance(&mut self, ms: i64, sampled: bool) {
        let end = self.now + ms * MS;
        while self.moved_to + 8 * MS <= end {
            self.moved_to += 8 * MS;
            let way: [f64; 3] = std::array::from_fn(|i| self.target[i] - self.tip[i]);
            let left = way.iter().map(|v| v * v).sum::<f64>().sqrt();
            let step = (self.speed * 8e-3).min(left);
            if self.armed && left > 0.0 {
                self.tip = std::array::from_fn(|i| self.tip[i] + way[i] / left * step);
            }
            if sampled {
                let force_n = (-self.tip[2]).max(0.0);
                let s = self.sample(self.moved_to, self.tip, force_n);
                self.waiting.push(s);
            }
        }
        self.now = end;
    }

    fn escape(&mut self, what: String) {
        let t = self.now;
        self.escapes.push(format!("{what}, at {t} ns"));
    }

    /// Invariants of every motion that reaches the robot.
    fn check(&mut self, target: [f64; 3], speed: f64) {
        let tolerance = LIMITS.position_tolerance_mm;
        let near = 1e-6; // rounding of the frame transforms
        if !self.armed {
            self.escape("a motion while disarmed".to_owned());
        }
        let sound = speed > 0.0 && speed <= LIMITS.max_speed_mm_s;
        if !sound || !target.iter().all(|v| v.is_finite()) {
            self.escape(format!("{target:?} at {speed} mm/s"));
        }
        for i in 0..3 {
            let (low, high) = (LIMITS.workspace_min_mm[i], LIMITS.workspace_max_mm[i]);
            if target[i] < low - near || target[i] > high + near {
                self.escape(format!("{target:?} outside the workspace"));
            }
        }
        if -target[2] > LIMITS.max_depth_mm + near {
            self.escape(format!("{target:?} too deep"));
        }
        let Some((t, at)) = self.newest else {
            self.escape("a motion from nowhere".to_owned());
            return;
        };
        if self.now - t > 100 * MS {
            self.escape(format!("a motion led by a pose of {t} ns"));
        }
        let sideways = libm::hypot(target[0] - at[0], target[1] - at[1]);
        let low = target[2].min(at[2]) < LIMITS.clearance_mm - tolerance - near;
        if sideways > tolerance + near && low {
            self.escape(format!("{sideways} mm sideways, low, to {target:?}"));
        }
        let rises = sideways <= tolerance + near && target[2] >= at[2] - near;
        if self.tripped && !rises {
            self.escape(format!("after a trip, to {target:?} from {at:?}"));
        }
        if self.blind {
            self.escape("a motion after the feedback was wrong".to_owned());
        }
    }

    /// Delivers the waiting samples, and records their effect on the limits.
    fn deliver(&mut self, out: &mut Vec<RobotSample>) {
        let mut sound = true;
        for s in std::mem::take(&mut self.waiting) {
            out.push(s);
            let at = robot_from_skin().inverse().apply(s.measured).to_array();
            let finite = at.iter().all(|v| v.is_finite()) && s.commanded.is_finite();
            if !finite || self.newest.is_some_and(|(t, _)| s.t.0 <= t) {
                self.blind |= self.armed;
                sound = false;
            }
            if !sound {
                continue; // later samples are discarded
            }
            self.tripped |= self.armed && s.force_n > LIMITS.max_force_n;
            self.newest = Some((s.t.0, at));
        }
        let age = self.newest.map(|(t, _)| self.now - t);
        self.blind |= self.armed && age.is_some_and(|age| !(0..=100 * MS).contains(&age));
    }
}

struct CheckedRobot(Shared);

impl Indenter for CheckedRobot {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            model: "model".into(),
            serial: "model".into(),
            firmware: "0".into(),
        }
    }
    fn capabilities(&self) -> IndenterCapabilities {
        crate::mock::capabilities()
    }
    fn configure(&mut self, _: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        Ok(vec![])
    }
    fn arm(&mut self) -> Result<(), DeviceError> {
        let mut b = lock(&self.0);
        b.call("arm")?;
        (b.armed, b.tripped, b.blind) = (true, false, false);
        b.target = b.tip;
        Ok(())
    }
    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        let mut b = lock(&self.0);
        let target = robot_from_skin().inverse().apply(target).to_array();
        b.check(target, speed_mm_s);
        b.call("command")?;
        b.commands += 1;
        (b.target, b.speed) = (target, speed_mm_s);
        Ok(())
    }
    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        let mut b = lock(&self.0);
        let answer = b.call("poll");
        b.received.clear();
        b.deliver(samples);
        answer
    }
    fn hold(&mut self) -> Result<(), DeviceError> {
        let mut b = lock(&self.0);
        b.call("hold")?;
        b.target = b.tip;
        Ok(())
    }
    fn disarm(&mut self) -> Result<(), DeviceError> {
        let mut b = lock(&self.0);
        b.call("disarm")?;
        b.armed = false;
        Ok(())
    }
}

struct ModelClock(Shared);

impl Clock for ModelClock {
    fn now(&self) -> HostTime {
        HostTime(lock(&self.0).now)
    }
    fn wait_until(&mut self, t: HostTime) {
        let mut b = lock(&self.0);
        b.now = b.now.max(t.0);
    }
}

/// Runs one case. Returns the number of motions that reached the robot, to detect a guard that rejects all.
fn play(acts: &[Act], on_trip: TripReaction) -> Result<u32, TestCaseError> {
    let limits = RunLimits { on_trip, ..LIMITS };
    let model: Shared = Arc::new(Mutex::new(RobotModel {
        tip: [0.0, 0.0, 10.0],
        target: [0.0, 0.0, 10.0],
        on_trip,
        ..RobotModel::default()
    }));
    let clock = ModelClock(model.clone());
    let settings = ControllerSettings::default();
    let inner = Box::new(CheckedRobot(model.clone()));
    let mut guard = GuardedIndenter::new(inner, robot_from_skin(), limits, &settings);
    let mut poses = Vec::new();
    for act in acts {
        step(act, &mut guard, &model, &clock, &mut poses)?;
        let b = lock(&model);
        prop_assert!(b.escapes.is_empty(), "{:?}: {:?}", act, b.escapes);
        prop_assert!(
            b.armed || !guard.is_armed(),
            "{:?}: thought to be armed",
            act
        );
    }
    prop_assert!(poses.is_sorted_by(|a, b| a.t < b.t));
    let b = lock(&model);
    Ok(b.commands)
}

fn step(
    act: &Act,
    guard: &mut GuardedIndenter<'_>,
    model: &Shared,
    clock: &ModelClock,
    poses: &mut Vec<skinrig_model::PoseSample>,
) -> TestCaseResult {
    let now = clock.now();
    match *act {
        Act::Command([x, y, z], speed) => {
            let _ = guard.command(Point3::new(x, y, z), speed, now);
        }
        Act::Vertical(dz, speed) => {
            let Some(at) = guard.position().map(|p| p.measured) else {
                return Ok(());
            };
            let _ = guard.command(at.plane().at_height(at.z_mm + dz), speed, now);
        }
        Act::Arm => drop(guard.arm()),
        Act::Disarm => drop(guard.disarm()),
        Act::Hold => drop(guard.hold()),
        Act::Blind(ms) => lock(model).advance(i64::from(ms), true),
        Act::Fail => lock(model).fail_next = true,
        Act::Good(ms) => lock(model).advance(i64::from(ms), true),
        Act::Nothing => lock(model).advance(7, false),
        Act::Coordinate(i, v) => {
            let mut b = lock(model);
            b.advance(9, true);
            let mut s = b.sample(b.now, b.tip, 0.0);
            let wrong = if i < 3 {
                &mut s.measured
            } else {
                &mut s.commanded
            };
            let mut at = wrong.to_array();
            at[i % 3] = v;
            *wrong = Point3::new(at[0], at[1], at[2]);
            b.waiting.push(s);
        }
        Act::Force(force_n) => {
            let mut b = lock(model);
            b.advance(9, true);
            let s = b.sample(b.now, b.tip, force_n);
            b.waiting.push(s);
        }
        Act::Shifted(ms) => {
            let mut b = lock(model);
            b.advance(9, true);
            let s = b.sample(b.now + i64::from(ms) * MS, b.tip, 0.0);
            b.waiting.push(s);
        }
    }
    let looks = matches!(
        act,
        Act::Good(_) | Act::Nothing | Act::Coordinate(..) | Act::Force(_) | Act::Shifted(_)
    );
    if !looks {
        return Ok(());
    }
    let (was_armed, before) = (guard.is_armed(), lock(model).tripped);
    let answer = guard.poll(clock, poses);
    let b = lock(model);
    let is_held = b.received.contains(&"hold") || b.received.contains(&"disarm");
    if was_armed && answer.is_err() {
        prop_assert!(
            is_held,
            "{:?}: {:?}, and the robot received {:?}",
            act,
            answer,
            b.received
        );
    }
    if was_armed && b.blind {
        prop_assert!(
            matches!(answer, Err(RunFault::Watchdog(_))),
            "{:?}: {:?}",
            act,
            answer
        );
        prop_assert!(
            b.received.contains(&"disarm") && !guard.is_armed(),
            "{:?}: {:?}",
            act,
            b.received
        );
    }
    if was_armed && b.tripped && !before {
        prop_assert!(
            matches!(answer, Err(RunFault::Watchdog(_))),
            "{:?}: {:?}",
            act,
            answer
        );
        let brake = b.on_trip == TripReaction::Brake;
        prop_assert!(
            !brake || b.received.contains(&"disarm"),
            "{:?}: {:?}",
            act,
            b.received
        );
    }
    // The watchdog trips on more than the model covers (speed, depth): only the way up is open then, too.
    drop(b);
    if matches!(answer, Err(RunFault::Watchdog(_))) && was_armed {
        lock(model).tripped = true;
    }
    Ok(())
}

fn cases(count: u32) {
    let config = ProptestConfig {
        cases: count,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let moved = std::cell::Cell::new(0u64);
    let acts = (prop::collection::vec(act(), 1..40), any::<bool>());
    let mut runner = proptest::test_runner::TestRunner::new(config);
    let answer = runner.run(&acts, |(acts, brake)| {
        let on_trip = if brake {
            TripReaction::Brake
        } else {
            TripReaction::Retract
        };
        moved.set(moved.get() + u64::from(play(&acts, on_trip)?));
        Ok(())
    });
    assert!(
        answer.is_ok(),
        "{}",
        answer.map_or_else(|e| e.to_string(), |()| String::new())
    );
    // A guard that rejects everything would pass as well.
    assert!(
        moved.get() > u64::from(count) / 4,
        "{} motions in {count} cases",
        moved.get()
    );
}

#[test]
fn every_sequence() {
    cases(20_000);
}

#[test]
#[ignore = "takes minutes: SKINRIG_FUZZ_CASES=3000000 cargo test -p skinrig-controller --test runs -- --ignored millions"]
fn millions_of_sequences() {
    let count = std::env::var("SKINRIG_FUZZ_CASES");
    cases(count.ok().and_then(|n| n.parse().ok()).unwrap_or(1_000_000));
}
