//! An arm, a driver for it, and waits that end.

use std::time::{Duration, Instant};

use emulated_libdrd::{ArmConfig, EmulatedArm};
use skinrig_device::{DeviceError, Indenter, MotionLimits, RealClock, RobotSample};
use skinrig_model::{Point3, Robot};
use skinrig_omega3::{Omega, OmegaConfig};

/// Longer than anything takes on a busy machine; only a hang waits for it.
pub const PATIENCE: Duration = Duration::from_secs(30);

pub const LIMITS: MotionLimits = MotionLimits {
    min_mm: [0.0, -15.0, 0.0],
    max_mm: [30.0, 15.0, 35.0],
    max_speed_mm_s: 40.0,
    max_acceleration_mm_s2: 200.0,
    max_force_n: 4.0,
};

/// Where the emulated arm starts, mm.
pub const START: [f64; 3] = [12.5, 0.0, 20.0];

pub fn point([x, y, z]: [f64; 3]) -> Point3<Robot> {
    Point3::new(x, y, z)
}

/// A configuration for this arm; what watches the machine's own speed is lenient, because a test shares its machine.
pub fn config(arm: &EmulatedArm) -> OmegaConfig {
    let mut config = OmegaConfig {
        library: Some(arm.library()),
        serial: Some(1234),
        ..OmegaConfig::default()
    };
    config.trips.min_control_khz = 0.05;
    config.trips.tare = Duration::from_millis(100);
    config.trips.max_silence = Duration::from_secs(5);
    config.trips.max_unwatched = PATIENCE;
    config.trips.max_jump_mm = 8.0;
    config.patience.brake_retry = Duration::from_millis(20);
    config.patience.reply = Duration::from_secs(10);
    config.patience.open = PATIENCE;
    config.patience.regulation = PATIENCE;
    config
}

pub fn arm() -> EmulatedArm {
    arm_like(&ArmConfig::default())
}

pub fn arm_like(config: &ArmConfig) -> EmulatedArm {
    EmulatedArm::spawn(config).expect("the emulated arm starts")
}

pub fn open(arm: &EmulatedArm) -> Omega {
    Omega::open(config(arm), RealClock::start()).expect("opens")
}

/// Open, within `LIMITS`, motors live.
pub fn armed(arm: &EmulatedArm) -> Omega {
    armed_with(config(arm))
}

pub fn armed_with(config: OmegaConfig) -> Omega {
    let mut omega = Omega::open(config, RealClock::start()).expect("opens");
    omega.configure(&LIMITS).expect("takes its limits");
    omega.arm().expect("arms");
    omega
}

/// Polls until the newest sample is as wanted; gives all samples.
pub fn poll_until(
    omega: &mut Omega,
    wanted: impl Fn(&RobotSample) -> bool,
) -> Result<Vec<RobotSample>, DeviceError> {
    let started = Instant::now();
    let mut samples = Vec::new();
    loop {
        omega.poll(&mut samples)?;
        if samples.last().is_some_and(&wanted) {
            return Ok(samples);
        }
        assert!(
            started.elapsed() < PATIENCE,
            "not as wanted: {:?}",
            samples.last()
        );
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The error with which polling ends.
pub fn failure(omega: &mut Omega) -> DeviceError {
    poll_until(omega, |_| false).expect_err("the fault is told")
}

/// Goes to `to` and waits until it is there.
pub fn go(omega: &mut Omega, to: [f64; 3], speed: f64) -> Vec<RobotSample> {
    omega.command(point(to), speed).expect("goes");
    poll_until(omega, |s| s.measured.distance_mm(point(to)) < 0.1).expect("arrives")
}

/// Runs every case on a thread and an arm of its own: they mostly wait.
pub fn each<T: Send>(cases: impl IntoIterator<Item = T>, test: impl Fn(T) + Sync) {
    std::thread::scope(|scope| {
        for case in cases {
            scope.spawn(|| test(case));
        }
    });
}
