//! Contract of robots.

use skinrig_model::{HostDuration, HostTime, Point3, Robot};

use super::{TICK, pass};
use crate::{Clock, DeviceError, Indenter, MotionLimits, RobotSample};

/// Test parameters of [`indenter`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IndenterContract {
    /// Limits within the robot's capabilities.
    pub limits: MotionLimits,
    /// Two reachable targets within the limits.
    pub targets: [Point3<Robot>; 2],
    /// A point outside the limits.
    pub outside: Point3<Robot>,
    /// Speed of all moves, mm/s.
    pub speed_mm_s: f64,
    /// Distance to the target that counts as arrived, mm.
    pub tolerance_mm: f64,
    /// Time within which every move ends.
    pub move_timeout: HostDuration,
    /// Share of the promised samples that must arrive: close to 1 on a simulated clock, less on a real clock with a busy machine.
    pub rate_share: f64,
}

/// Asserts that the samples are finite, later than `after`, not later than `now`, in time order and without duplicates.
fn check_samples(samples: &[RobotSample], after: Option<HostTime>, now: HostTime) {
    let mut last = after;
    for s in samples {
        assert!(
            last.is_none_or(|l| l < s.t),
            "pose stream: expected a sample after {last:?}, found {}",
            s.t
        );
        assert!(s.t <= now, "pose stream: sample of {} at {now}", s.t);
        assert!(
            s.measured.is_finite() && s.commanded.is_finite(),
            "pose stream: expected finite coordinates, found {s:?}"
        );
        last = Some(s.t);
    }
}

/// Verifies the contract of [`Indenter`]. `make` returns a new, disarmed robot and its clock.
pub fn indenter(
    make: &mut dyn FnMut() -> (Box<dyn Indenter>, Box<dyn Clock>),
    options: &IndenterContract,
) {
    indenter_states(make, options);
    indenter_refusals(make, options);
    indenter_moves(make, options);
    indenter_hold_and_disarm(make, options);
}

fn ready(
    make: &mut dyn FnMut() -> (Box<dyn Indenter>, Box<dyn Clock>),
    options: &IndenterContract,
) -> (Box<dyn Indenter>, Box<dyn Clock>) {
    let (mut robot, clock) = make();
    robot
        .configure(&options.limits)
        .expect("indenter: limits within the capabilities must be accepted");
    robot.arm().expect("indenter: a configured robot must arm");
    (robot, clock)
}

fn indenter_states(
    make: &mut dyn FnMut() -> (Box<dyn Indenter>, Box<dyn Clock>),
    options: &IndenterContract,
) {
    let (mut robot, _clock) = make();
    assert!(
        !robot.identity().model.is_empty(),
        "indenter: expected a model name"
    );
    let can = robot.capabilities();
    assert!(
        can.pose_rate_hz >= 1000.0,
        "indenter: expected a pose stream of 1 kHz or more, found {} Hz",
        can.pose_rate_hz
    );
    robot
        .disarm()
        .expect("indenter: disarm must be allowed before everything");
    expect_error!(
        robot.arm(),
        DeviceError::State { .. },
        "indenter: arm before configure must be a State error"
    );
    let [target, _] = options.targets;
    expect_error!(
        robot.command(target, options.speed_mm_s),
        DeviceError::State { .. },
        "indenter: command while disarmed must be a State error"
    );
    let settings = robot
        .configure(&options.limits)
        .expect("indenter: limits within the capabilities must be accepted");
    assert!(
        !settings.is_empty(),
        "indenter: expected the limits as read back"
    );
    expect_error!(
        robot.command(target, options.speed_mm_s),
        DeviceError::State { .. },
        "indenter: command before arm must be a State error"
    );
    robot.arm().expect("indenter: a configured robot must arm");
    robot
        .arm()
        .expect("indenter: arming an armed robot must change nothing");
    robot.disarm().expect("indenter: disarm after arm");
    robot.disarm().expect("indenter: disarm twice");
    expect_error!(
        robot.command(target, options.speed_mm_s),
        DeviceError::State { .. },
        "indenter: command after disarm must be a State error"
    );
}

fn indenter_refusals(
    make: &mut dyn FnMut() -> (Box<dyn Indenter>, Box<dyn Clock>),
    options: &IndenterContract,
) {
    let (mut robot, mut clock) = ready(make, options);
    let can = robot.capabilities();
    let base = options.limits;
    let mut wide = base;
    wide.max_mm[0] = can.workspace_max_mm[0] + 1.0;
    let mut empty = base;
    empty.min_mm[1] = empty.max_mm[1] + 1.0;
    let mut nan = base;
    nan.min_mm[2] = f64::NAN;
    let fast = MotionLimits {
        max_speed_mm_s: can.max_speed_mm_s * 2.0,
        ..base
    };
    let no_speed = MotionLimits {
        max_speed_mm_s: f64::NAN,
        ..base
    };
    let jerky = MotionLimits {
        max_acceleration_mm_s2: can.max_acceleration_mm_s2 * 2.0,
        ..base
    };
    let strong = MotionLimits {
        max_force_n: can.max_force_n * 2.0,
        ..base
    };
    for (limits, what) in [
        (wide, "wider than the workspace"),
        (empty, "empty"),
        (nan, "not a number"),
        (fast, "faster than the robot"),
        (no_speed, "without a speed"),
        (jerky, "with more acceleration than the robot's"),
        (strong, "stronger than the robot"),
    ] {
        expect_error!(
            robot.configure(&limits),
            DeviceError::Refused { .. },
            format!("indenter: limits {what} must be refused")
        );
    }

    // A rejected command does not affect the current motion.
    let [target, other] = options.targets;
    let speed = options.speed_mm_s;
    robot
        .command(target, speed)
        .expect("indenter: a good command");
    let mut samples = Vec::new();
    pass(clock.as_mut(), HostDuration::from_millis(50), || {});
    let [x, y, z] = other.to_array();
    let bad = [
        (Point3::new(f64::NAN, y, z), speed, "NaN target"),
        (Point3::new(x, f64::INFINITY, z), speed, "infinite target"),
        (options.outside, speed, "target outside the limits"),
        (other, f64::NAN, "NaN speed"),
        (other, 0.0, "no speed"),
        (other, -speed, "negative speed"),
        (
            other,
            options.limits.max_speed_mm_s * 1.01,
            "speed above the limit",
        ),
    ];
    for (to, at, what) in bad {
        expect_error!(
            robot.command(to, at),
            DeviceError::Refused { .. },
            format!("indenter: {what} must be refused")
        );
    }
    pass(clock.as_mut(), options.move_timeout, || {});
    robot.poll(&mut samples).expect("indenter: poll");
    let last = samples.last().expect("indenter: expected pose samples");
    let off = last.measured.distance_mm(target);
    assert!(
        off <= options.tolerance_mm,
        "indenter: refused commands must leave the motion unchanged, ended {off} mm from its target"
    );
}

fn indenter_moves(
    make: &mut dyn FnMut() -> (Box<dyn Indenter>, Box<dyn Clock>),
    options: &IndenterContract,
) {
    let (mut robot, mut clock) = ready(make, options);
    let mut last = None;
    let rate = robot.capabilities().pose_rate_hz;
    for target in options.targets {
        robot
            .command(target, options.speed_mm_s)
            .expect("indenter: a good command");
        let mut samples = Vec::new();
        let mut fresh = Vec::new();
        let end = clock.now() + options.move_timeout;
        let mut polled_at = clock.now();
        while clock.now() < end {
            let next = clock.now() + TICK;
            clock.wait_until(next);
            fresh.clear();
            polled_at = clock.now();
            robot.poll(&mut fresh).expect("indenter: poll");
            check_samples(&fresh, last, clock.now());
            last = fresh.last().map(|s| s.t).or(last);
            samples.append(&mut fresh);
        }
        robot.poll(&mut fresh).expect("indenter: poll again");
        check_samples(&fresh, last, clock.now());
        // On a real clock time passes between the two polls.
        assert!(
            fresh.is_empty() || clock.now() > polled_at,
            "indenter: a second poll at the same time must be empty"
        );
        last = fresh.last().map(|s| s.t).or(last);
        let seconds = options.move_timeout.as_secs_f64();
        assert!(
            samples.len() as f64 >= options.rate_share * seconds * rate,
            "indenter: expected {} samples or more in {seconds} s, found {}",
            options.rate_share * seconds * rate,
            samples.len()
        );
        let end = samples.last().expect("indenter: expected pose samples");
        assert!(
            end.commanded.distance_mm(target) <= 1e-6,
            "indenter: the set point must end at {target:?}, found {:?}",
            end.commanded
        );
        let off = end.measured.distance_mm(target);
        assert!(
            off <= options.tolerance_mm,
            "indenter: expected to arrive within {} mm, found {off} mm",
            options.tolerance_mm
        );
    }
    robot.disarm().expect("indenter: disarm");
}

fn indenter_hold_and_disarm(
    make: &mut dyn FnMut() -> (Box<dyn Indenter>, Box<dyn Clock>),
    options: &IndenterContract,
) {
    let (mut robot, mut clock) = ready(make, options);
    let [target, _] = options.targets;
    robot
        .command(target, options.speed_mm_s)
        .expect("indenter: a good command");
    pass(clock.as_mut(), HostDuration::from_millis(50), || {});
    robot.hold().expect("indenter: hold while moving");
    robot.hold().expect("indenter: hold while holding");
    let mut samples = Vec::new();
    robot.disarm().expect("indenter: disarm while holding");
    robot.disarm().expect("indenter: disarm twice");
    pass(clock.as_mut(), HostDuration::from_millis(50), || {});
    robot
        .poll(&mut samples)
        .expect("indenter: a disarmed robot is still read");
    check_samples(&samples, None, clock.now());
    robot.arm().expect("indenter: arm again");
    robot.disarm().expect("indenter: disarm again");
}
