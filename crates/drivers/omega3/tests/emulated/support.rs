//! An emulated arm, a driver for it, and waits with a time limit.

use std::time::{Duration, Instant};

use emulated_libdrd::{ArmConfig, EmulatedArm};
use skinrig_device::{DeviceError, Indenter, MotionLimits, RealClock, RobotSample};
use skinrig_model::{Point3, Robot};
use skinrig_omega3::{Omega, OmegaConfig};

/// Longer than anything takes on a busy machine.
pub const TIMEOUT: Duration = Duration::from_secs(30);

pub const LIMITS: MotionLimits = MotionLimits {
    min_mm: [0.0, -15.0, 0.0],
    max_mm: [30.0, 15.0, 35.0],
    max_speed_mm_s: 40.0,
    max_acceleration_mm_s2: 200.0,
    max_force_n: 4.0,
};

/// Initial position of the emulated arm, mm.
pub const START: [f64; 3] = [12.5, 0.0, 20.0];

pub fn point([x, y, z]: [f64; 3]) -> Point3<Robot> {
    Point3::new(x, y, z)
}

/// Configuration for this arm, lenient about timing because tests share the machine.
pub fn config(arm: &EmulatedArm) -> OmegaConfig {
    let mut config = OmegaConfig {
        library: Some(arm.library()),
        serial: Some(1234),
        ..OmegaConfig::default()
    };
    config.trips.min_control_khz = 0.05;
    config.trips.tare = Duration::from_millis(100);
    config.trips.max_silence = Duration::from_secs(5);
    config.trips.max_unwatched = TIMEOUT;
    config.trips.max_jump_mm = 8.0;
    config.timeouts.brake_retry = Duration::from_millis(20);
    config.timeouts.reply = Duration::from_secs(10);
    config.timeouts.open = TIMEOUT;
    config.timeouts.regulation = TIMEOUT;
    config
}

pub fn arm() -> EmulatedArm {
    arm_like(&ArmConfig::default())
}

pub fn arm_like(config: &ArmConfig) -> EmulatedArm {
    EmulatedArm::spawn(config).expect("emulated arm starts")
}

pub fn open(arm: &EmulatedArm) -> Omega {
    Omega::open(config(arm), RealClock::start()).expect("robot opens")
}

/// An armed robot with `LIMITS`.
pub fn armed(arm: &EmulatedArm) -> Omega {
    armed_with(config(arm))
}

pub fn armed_with(config: OmegaConfig) -> Omega {
    let mut omega = Omega::open(config, RealClock::start()).expect("robot opens");
    omega.configure(&LIMITS).expect("limits are accepted");
    omega.arm().expect("robot arms");
    omega
}

/// Polls until the newest sample satisfies `condition`; returns all samples.
pub fn poll_until(
    omega: &mut Omega,
    condition: impl Fn(&RobotSample) -> bool,
) -> Result<Vec<RobotSample>, DeviceError> {
    let started = Instant::now();
    let mut samples = Vec::new();
    loop {
        omega.poll(&mut samples)?;
        if samples.last().is_some_and(&condition) {
            return Ok(samples);
        }
        assert!(
            started.elapsed() < TIMEOUT,
            "timed out: {:?}",
            samples.last()
        );
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The error that ends polling.
pub fn failure(omega: &mut Omega) -> DeviceError {
    poll_until(omega, |_| false).expect_err("a fault")
}

/// Moves to `to` and waits until the tip is there.
pub fn go(omega: &mut Omega, to: [f64; 3], speed: f64) -> Vec<RobotSample> {
    omega
        .command(point(to), speed)
        .expect("command is accepted");
    poll_until(omega, |s| s.measured.distance_mm(point(to)) < 0.1).expect("tip arrives")
}

/// Runs every case on its own thread with its own arm, because the cases mostly wait.
pub fn each<T: Send>(cases: impl IntoIterator<Item = T>, test: impl Fn(T) + Sync) {
    std::thread::scope(|scope| {
        for case in cases {
            scope.spawn(|| test(case));
        }
    });
}
