//! Every fault of the emulated arm: reported to the operator, and the arm is braked.

use emulated_libdrd::{ArmConfig, DeviceConfig, EmulatedArm, Fault, Mode, Setting, When};
use skinrig_device::{DeviceError, Indenter, RealClock};
use skinrig_drd_abi::ErrorCode;
use skinrig_omega3::config::InitialiseRule;
use skinrig_omega3::{Omega, OmegaError, Remark};

use crate::support::*;

fn refused(arm: &EmulatedArm) -> OmegaError {
    match Omega::open(config(arm), RealClock::start()) {
        Ok(_) => panic!("it opened"),
        Err(e) => e,
    }
}

fn assert_words(error: impl ToString, words: &[&str]) {
    let text = error.to_string();
    for word in words {
        assert!(text.contains(word), "{word:?} is not in {text}");
    }
}

#[test]
fn faults_at_open_are_reported_without_motion() {
    let codes = |code: ErrorCode| Fault::Open(code.0);
    let cases: [(Fault, [&str; 2]); 10] = [
        (codes(ErrorCode::NO_DRIVER_FOUND), ["not permitted", "udev"]),
        (codes(ErrorCode::COM), ["connection", "cable"]),
        (Fault::Busy, ["busy", "other program"]),
        (Fault::DeviceType(60), ["type 33", "type 60"]),
        (Fault::NoSerial, ["serial 1234", "without a known serial"]),
        (Fault::Unsupported, ["control", "SDK"]),
        (Fault::ControllerMemory, ["memory", "contact"]),
        (
            Fault::SettingIgnored(Setting::Watchdog),
            ["watchdog_125us", "expected 80"],
        ),
        (
            Fault::SettingIgnored(Setting::DeviceAngle),
            ["device_angle_deg", "expected 30"],
        ),
        (Fault::StatusLength(10), ["", ""]),
    ];
    each(cases, |(fault, words)| {
        let arm = arm();
        arm.inject(When::Now, fault).expect("fault injected");
        let mut config = config(&arm);
        config.mount.device_angle_deg = 30.0;
        let opened = Omega::open(config, RealClock::start());
        if let Fault::StatusLength(_) = fault {
            // An older, shorter status vector is enough.
            assert!(opened.is_ok());
            return;
        }
        match opened {
            Ok(_) => panic!("{fault:?}: it opened"),
            Err(e) => assert_words(e, &words),
        }
        let journal = arm.journal().expect("journal");
        for forbidden in ["drdStart", "drdAutoInit", "drdTrackPos"] {
            assert_eq!(journal.first(forbidden), None, "{fault:?}");
        }
        assert!(
            !arm.state().expect("arm state").held,
            "{fault:?}: still open"
        );
    });
}

#[test]
fn another_robot_is_never_used() {
    let arm = arm_like(&ArmConfig {
        devices: vec![DeviceConfig {
            serial: 9,
            ..DeviceConfig::default()
        }],
        ..ArmConfig::default()
    });
    assert_words(refused(&arm), &["serial 1234", "serial 9", "rig file"]);
}

#[test]
fn an_uninitialised_arm_is_rejected_unless_the_sample_is_off() {
    let arm = arm_like(&ArmConfig {
        initialised: false,
        ..ArmConfig::default()
    });
    assert_words(refused(&arm), &["initialised", "sample_is_off"]);
    let still = arm.state().expect("arm state");
    assert_eq!((still.mode, still.initialised), (Mode::Reset, false));
    let mut config = config(&arm);
    config.initialise = InitialiseRule::SampleIsOff;
    let omega = Omega::open(config, RealClock::start()).expect("robot initialises and opens");
    let state = arm.state().expect("arm state");
    assert!(state.initialised && state.mode == Mode::Brake, "{state:?}");
    assert!(omega.remarks().contains(&Remark::InitialisedItself));
}

#[test]
fn a_hanging_initialisation_times_out_and_brakes() {
    let arm = arm_like(&ArmConfig {
        initialised: false,
        ..ArmConfig::default()
    });
    arm.inject(When::Now, Fault::AutoInitHangs)
        .expect("fault injected");
    let mut config = config(&arm);
    config.initialise = InitialiseRule::SampleIsOff;
    config.timeouts.open = std::time::Duration::from_secs(1);
    config.timeouts.initialise = std::time::Duration::from_secs(1);
    let error = match Omega::open(config, RealClock::start()) {
        Ok(_) => panic!("it opened"),
        Err(e) => e,
    };
    assert_words(error, &["opening the robot", "force button"]);
    arm.wait_until(TIMEOUT, |s| s.mode != Mode::Force)
        .expect("motors are off");
}

#[test]
fn faults_when_arming_are_reported_and_leave_the_arm_braked() {
    let cases = [
        (
            Fault::StartFails(ErrorCode::DEVICE_NOT_READY.0),
            "not initialised",
        ),
        (
            Fault::SettingIgnored(Setting::MotorRatio),
            "motor_ratio_max",
        ),
        (
            Fault::SettingIgnored(Setting::TrackParam),
            "track_parameters",
        ),
        (Fault::SettingIgnored(Setting::Filter), "track_filter"),
        (Fault::PositionNan, "position"),
        (Fault::ForceOffset([0.0, 0.0, -2.0]), "does not hang free"),
        (Fault::LoopRate(0.2), "kHz"),
        (Fault::Button, "force button"),
    ];
    each(cases, |(fault, word)| {
        let arm = arm();
        let mut config = config(&arm);
        if let Fault::LoopRate(_) | Fault::Button = fault {
            config.trips.min_control_khz = 0.5;
            config.timeouts.regulation = std::time::Duration::from_secs(2);
        }
        let mut omega = Omega::open(config, RealClock::start()).expect("robot opens");
        let configured = match fault {
            // Already detected when the limits are written.
            Fault::SettingIgnored(Setting::MotorRatio | Setting::TrackParam) => {
                omega.configure(&LIMITS).expect("limits are accepted");
                let mut other = LIMITS;
                other.max_force_n = 3.0;
                other.max_speed_mm_s = 20.0;
                arm.inject(When::Now, fault).expect("fault injected");
                omega.configure(&other)
            }
            _ => {
                let answer = omega.configure(&LIMITS);
                arm.inject(When::Now, fault).expect("fault injected");
                answer
            }
        };
        let error = configured.and_then(|_| omega.arm()).expect_err("an error");
        assert_words(error, &[word]);
        let state = arm.state().expect("arm state");
        assert_eq!(state.mode, Mode::Brake, "{fault:?}");
        assert!(!state.regulating, "{fault:?}: still regulates");
    });
}

#[test]
fn faults_in_motion_are_reported_and_brake_at_once() {
    let cases = [
        (Fault::RegulationDies, "regulation thread ended"),
        (Fault::Button, "force button"),
        (Fault::VelocityTrip, "velocity"),
        (Fault::WatchdogTrip, "watchdog"),
        (Fault::PositionNan, "finite"),
        (Fault::PositionOffset([0.03, 0.0, 0.0]), "the tip"),
        (Fault::ForceOffset([0.0, 0.0, -9.0]), "force"),
        (Fault::LoopRate(0.2), "loop is slow"),
        (Fault::RegulationHangs, "watchdog"),
    ];
    each(cases, |(fault, word)| {
        let arm = arm();
        let mut config = config(&arm);
        if let Fault::LoopRate(_) = fault {
            config.trips.min_control_khz = 0.5;
        }
        let mut omega = armed_with(config);
        arm.inject(When::IntoMove(0.05), fault)
            .expect("fault injected");
        omega
            .command(point([20.0, 0.0, 10.0]), 10.0)
            .expect("command is accepted");
        let error = failure(&mut omega);
        assert!(
            matches!(error, DeviceError::State { .. }),
            "{fault:?}: {error:?}"
        );
        assert_words(&error, &[word]);
        let state = arm
            .wait_until(TIMEOUT, |s| s.mode == Mode::Brake && !s.regulating)
            .expect("arm is braked");
        assert!(state.held, "the pose is still read");
        assert!(omega.command(point(START), 10.0).is_err());
        // After a repair and a disarm it works again.
        arm.clear_faults().expect("faults cleared");
        if fault == Fault::Button {
            arm.inject(When::Now, Fault::Button)
                .expect("button pressed again");
        }
        omega.disarm().expect("robot disarms");
        omega.arm().expect("robot arms again");
    });
}

#[test]
fn an_unplugged_robot_is_lost_and_does_not_resume_by_itself() {
    each([Fault::Lost, Fault::PowerLost], |fault| {
        let arm = arm();
        let mut omega = armed(&arm);
        arm.inject(When::IntoMove(0.05), fault)
            .expect("fault injected");
        omega
            .command(point([20.0, 0.0, 10.0]), 10.0)
            .expect("command is accepted");
        let error = failure(&mut omega);
        assert!(
            matches!(error, DeviceError::Lost { .. }),
            "{fault:?}: {error:?}"
        );
        assert_words(&error, &["connection", "cable"]);
        arm.clear_faults().expect("faults cleared");
        for answer in [omega.arm(), omega.hold(), omega.disarm()] {
            assert!(
                matches!(answer, Err(DeviceError::Lost { .. })),
                "{answer:?}"
            );
        }
        assert_ne!(arm.state().expect("arm state").mode, Mode::Force);
        drop(omega);
        if fault == Fault::Lost {
            // After reconnection it can be opened again.
            let mut omega = armed(&arm);
            go(&mut omega, START, 20.0);
        }
    });
}

#[test]
fn a_failing_stop_is_retried_until_it_works() {
    let arm = arm();
    let mut omega = armed(&arm);
    arm.inject(When::Now, Fault::StopFails(7))
        .expect("fault injected");
    omega.disarm().expect("robot disarms");
    assert_eq!(arm.state().expect("arm state").mode, Mode::Brake);
}

#[test]
fn a_stalled_arm_is_not_pulled_beyond_the_lead() {
    let arm = arm();
    let mut omega = armed(&arm);
    arm.inject(When::Now, Fault::Stalled)
        .expect("fault injected");
    omega
        .command(point([12.5, 0.0, 5.0]), 20.0)
        .expect("command is accepted");
    let samples =
        poll_until(&mut omega, |s| s.commanded.distance_mm(s.measured) > 1.9).expect("no trip");
    let lead = samples
        .iter()
        .map(|s| s.commanded.distance_mm(s.measured))
        .fold(0.0, f64::max);
    assert!(lead <= 2.0 + 1e-9, "{lead} mm");
    let force = arm.state().expect("arm state").motor_force_n;
    assert!(force[2].abs() <= LIMITS.max_force_n + 1e-6, "{force:?}");
}
