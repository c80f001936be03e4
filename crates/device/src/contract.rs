//! The contract suite: what every implementation of a device trait must do, simulated, replayed or real.
//!
//! Each function drives fresh devices through one trait's promises and panics with a clear message at the first
//! broken one. Call them from tests. They work on any clock and touch nothing but the devices they are given.
//!
//! Positions are in the robot frame; whoever runs [`indenter`] on a real robot clears the space between the
//! targets first.

use skinrig_model::{HostDuration, HostTime, Mark, Point3, RawChunk, Robot};

use crate::{
    CameraSettings, Clock, DeviceError, EventCamera, Indenter, MotionLimits, RobotSample, Roi,
    TriggerBox,
};

/// What [`indenter`] may do with the robot.
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
    /// How close to its target a move must come, mm.
    pub tolerance_mm: f64,
    /// Time after which every move has ended.
    pub patience: HostDuration,
}

/// Asserts that `answer` is an error of the kind named by `pattern`.
macro_rules! expect_error {
    ($answer:expr, $pattern:pat, $what:expr) => {
        match $answer {
            Err($pattern) => {}
            other => panic!("{}: found {:?}", $what, other.map(|_| "success")),
        }
    };
}

/// A step of waiting; short against everything that a robot does.
const TICK: HostDuration = HostDuration::from_millis(5);

/// Lets `span` pass on `clock`, looking in between.
fn pass(clock: &mut dyn Clock, span: HostDuration, mut look: impl FnMut()) {
    let end = clock.now() + span;
    while clock.now() < end {
        let next = clock.now() + TICK;
        clock.wait_until(if next < end { next } else { end });
        look();
    }
}

/// Asserts that the samples are finite, in time order without duplicates, after `after`, and none is later
/// than `now`.
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

/// The promises of [`Clock`]: never back, and a wait reaches its end.
pub fn clock(clock: &mut dyn Clock) {
    let start = clock.now();
    clock.wait_until(HostTime(start.0 - 1_000_000));
    assert!(
        clock.now() >= start,
        "clock: went back after a wait for the past"
    );
    let end = start + HostDuration::from_millis(20);
    let mut last = start;
    // A replayed clock may end a wait early; waiting again goes on.
    for _ in 0..1_000_000 {
        clock.wait_until(end);
        let now = clock.now();
        assert!(now >= last, "clock: went back from {last} to {now}");
        last = now;
        if now >= end {
            return;
        }
    }
    panic!(
        "clock: waited again and again for {end}, still at {}",
        clock.now()
    );
}

/// The promises of [`Indenter`]. `make` gives a fresh, disarmed robot and its clock.
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
        (strong, "stronger than the robot"),
    ] {
        expect_error!(
            robot.configure(&limits),
            DeviceError::Refused { .. },
            format!("indenter: limits {what} must be refused")
        );
    }

    // A refused command leaves the present motion as it is.
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
    pass(clock.as_mut(), options.patience, || {});
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
        let end = clock.now() + options.patience;
        while clock.now() < end {
            let next = clock.now() + TICK;
            clock.wait_until(next);
            fresh.clear();
            robot.poll(&mut fresh).expect("indenter: poll");
            check_samples(&fresh, last, clock.now());
            last = fresh.last().map(|s| s.t).or(last);
            samples.append(&mut fresh);
        }
        robot.poll(&mut fresh).expect("indenter: poll again");
        assert!(
            fresh.is_empty(),
            "indenter: a second poll at the same time must be empty"
        );
        let seconds = options.patience.as_secs_f64();
        assert!(
            samples.len() as f64 >= 0.9 * seconds * rate,
            "indenter: expected about {} samples in {seconds} s, found {}",
            seconds * rate,
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

/// The promises of [`EventCamera`]. `make` gives a fresh, stopped camera and its clock; `settings` are what
/// the rig writes to it.
pub fn event_camera(
    make: &mut dyn FnMut() -> (Box<dyn EventCamera>, Box<dyn Clock>),
    settings: &CameraSettings,
) {
    camera_states(make, settings);
    camera_stream(make, settings);
}

fn camera_states(
    make: &mut dyn FnMut() -> (Box<dyn EventCamera>, Box<dyn Clock>),
    settings: &CameraSettings,
) {
    let (mut camera, _clock) = make();
    let mut chunks = Vec::new();
    assert!(
        !camera.identity().model.is_empty(),
        "camera: expected a model name"
    );
    let can = camera.capabilities();
    camera
        .stop(&mut chunks)
        .expect("camera: stop must be allowed before everything");
    let mut bias = settings.clone();
    bias.biases.insert("bias_of_no_camera".to_owned(), 1);
    let mut channel = settings.clone();
    channel.trigger_channels.push(31);
    let mut region = settings.clone();
    region.roi = Some(Roi {
        x: can.width - 1,
        y: 0,
        width: 2,
        height: 1,
    });
    let mut none = settings.clone();
    none.roi = Some(Roi {
        x: 0,
        y: 0,
        width: 0,
        height: 1,
    });
    for (bad, what) in [
        (bias, "an unknown bias"),
        (channel, "an unknown trigger channel"),
        (region, "a region outside the sensor"),
        (none, "an empty region"),
    ] {
        expect_error!(
            camera.configure(&bad),
            DeviceError::Refused { .. },
            format!("camera: {what} must be refused")
        );
    }
    camera
        .configure(settings)
        .expect("camera: the rig's settings must be accepted");
    camera.start().expect("camera: a stopped camera must start");
    expect_error!(
        camera.start(),
        DeviceError::State { .. },
        "camera: start while streaming must be a State error"
    );
    expect_error!(
        camera.configure(settings),
        DeviceError::State { .. },
        "camera: configure while streaming must be a State error"
    );
    camera.stop(&mut chunks).expect("camera: stop");
    camera.stop(&mut chunks).expect("camera: stop twice");
    camera
        .configure(settings)
        .expect("camera: configure after stop");
}

fn camera_stream(
    make: &mut dyn FnMut() -> (Box<dyn EventCamera>, Box<dyn Clock>),
    settings: &CameraSettings,
) {
    let (mut camera, mut clock) = make();
    camera
        .configure(settings)
        .expect("camera: the rig's settings must be accepted");
    let mut all: Vec<RawChunk> = Vec::new();
    camera.poll(&mut all).expect("camera: poll while stopped");
    assert!(all.is_empty(), "camera: a stopped camera sends nothing");
    for round in 0..2 {
        camera.start().expect("camera: start");
        let before = all.len();
        pass(clock.as_mut(), HostDuration::from_millis(300), || {
            camera.poll(&mut all).expect("camera: poll");
        });
        camera.flush(&mut all).expect("camera: flush");
        let after = all.len();
        camera.flush(&mut all).expect("camera: flush again");
        assert_eq!(
            all.len(),
            after,
            "camera: a second flush at the same time must be empty (round {round})"
        );
        pass(clock.as_mut(), HostDuration::from_millis(20), || {});
        camera.stop(&mut all).expect("camera: stop");
        let stopped = all.len();
        camera.poll(&mut all).expect("camera: poll after stop");
        camera.flush(&mut all).expect("camera: flush after stop");
        assert_eq!(all.len(), stopped, "camera: a stopped camera sends nothing");
        if round == 0 {
            let bytes: usize = all[before..].iter().map(|c| c.bytes.len()).sum();
            assert!(bytes > 0, "camera: expected bytes after 0.3 s, found none");
        }
    }
    check_chunks(camera.as_ref(), &all, clock.now());
}

fn check_chunks(camera: &dyn EventCamera, chunks: &[RawChunk], now: HostTime) {
    let mut last = HostTime(i64::MIN);
    let mut camera_us = None;
    for (n, c) in chunks.iter().enumerate() {
        assert_eq!(
            c.camera,
            camera.camera(),
            "camera: chunk {n} of another camera"
        );
        assert_eq!(
            c.seq, n as u64,
            "camera: chunk numbers must run 0, 1, 2 through stop and start"
        );
        assert!(
            last <= c.host_time && c.host_time <= now,
            "camera: chunk {n}: host time {} out of order",
            c.host_time
        );
        last = c.host_time;
        assert!(
            !c.bytes.is_empty() || c.lost_before > 0,
            "camera: chunk {n} says nothing"
        );
        assert_eq!(
            c.facts.trigger_edges,
            c.triggers.len() as u64,
            "camera: chunk {n}: trigger edges and facts differ"
        );
        assert!(
            c.facts.on_events <= c.facts.cd_events,
            "camera: chunk {n}: impossible facts"
        );
        assert_eq!(
            c.facts.first_us.is_some(),
            c.facts.last_us.is_some(),
            "camera: chunk {n}: first and last time go together"
        );
        if let (Some(before), Some(first)) = (camera_us, c.facts.first_us) {
            assert!(
                before <= first,
                "camera: chunk {n}: camera time ran backwards"
            );
        }
        camera_us = c.facts.last_us.or(camera_us);
    }
}

/// The promises of [`TriggerBox`]. `make` gives a fresh box and its clock; `marks` are at least two different
/// marks in the order in which they are sent.
pub fn trigger_box(
    make: &mut dyn FnMut() -> (Box<dyn TriggerBox>, Box<dyn Clock>),
    marks: &[Mark],
) {
    assert!(marks.len() >= 2, "trigger box: give at least two marks");
    let (mut device, mut clock) = make();
    assert!(
        !device.identity().model.is_empty(),
        "trigger box: expected a model name"
    );
    let train = device.capabilities().train_duration;
    assert!(
        train > HostDuration::ZERO,
        "trigger box: a train takes time"
    );
    let mut impossible = marks[0];
    impossible.press.0 = skinrig_model::pulse::MAX_MARKED_PRESS + 1;
    expect_error!(
        device.send(impossible),
        DeviceError::Refused { .. },
        "trigger box: a press id that does not fit must be refused"
    );
    let mut last: Option<HostTime> = None;
    for &mark in marks {
        let before = clock.now();
        let sent = device.send(mark).expect("trigger box: a good mark");
        assert_eq!(sent.mark, mark, "trigger box: sent another mark");
        assert!(
            sent.uncertainty_ns >= 0,
            "trigger box: negative uncertainty"
        );
        assert!(
            sent.t + HostDuration(sent.uncertainty_ns) >= before,
            "trigger box: the edge rose at {} before it was asked for at {before}",
            sent.t
        );
        assert!(
            last.is_none_or(|l| l < sent.t),
            "trigger box: instants out of order"
        );
        last = Some(sent.t);
        expect_error!(
            device.send(mark),
            DeviceError::State { .. },
            "trigger box: a mark during a train must be a State error"
        );
        let free = sent.t + train;
        let wait = free - clock.now() + TICK;
        pass(clock.as_mut(), wait, || {});
    }
}
