//! Tests of each fault as the driver observes it.

use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use drd::{ArmConfig, ArmState, Contact, Fault, Mode, Setting, When};
use skinrig_drd_abi::{ForceOffCause, StatusField};

use crate::support::{Bench, ID, WITHIN};

/// A bench with the arm well above the sample, at rest and regulated.
fn high_up() -> Bench {
    Bench::started(&ArmConfig {
        start_m: [0.0125, 0.0, 0.05],
        ..ArmConfig::default()
    })
}

fn inject(bench: &Bench, when: When, fault: Fault) {
    bench.arm.inject(when, fault).unwrap();
}

#[test]
fn an_open_fails_with_the_injected_error_until_it_is_cleared() {
    let bench = Bench::new(&ArmConfig::default());
    // SAFETY: a function of the table.
    let open = || (unsafe { (bench.sdk.drdOpenID)(0) }, bench.last_error());
    for code in [5, 20, 4, 2] {
        inject(&bench, When::Now, Fault::Open(code));
        assert_eq!(open(), (-1, code));
        bench.arm.clear_faults().unwrap();
    }
    inject(&bench, When::Now, Fault::Busy);
    // SAFETY: a function of the table.
    assert_eq!(unsafe { (bench.sdk.dhdGetAvailableCount)() }, 0);
    assert_eq!(open(), (-1, 20));
    bench.arm.clear_faults().unwrap();
    assert_eq!(open().0, 0);
}

#[test]
fn a_device_can_have_another_type_or_damaged_memory() {
    let bench = Bench::new(&ArmConfig::default());
    let sdk = &bench.sdk;
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        assert_eq!((sdk.drdOpenID)(0), 0);
        inject(&bench, When::Now, Fault::DeviceType(63));
        inject(&bench, When::Now, Fault::NoSerial);
        inject(&bench, When::Now, Fault::ControllerMemory);
        inject(&bench, When::Now, Fault::Unsupported);
        assert_eq!((sdk.dhdGetSystemType)(ID), 63);
        let mut serial = 0;
        assert_eq!((sdk.dhdGetSerialNumber)(&raw mut serial, ID), -1);
        // The only failure with a positive result.
        assert_eq!((sdk.dhdCheckControllerMemory.unwrap())(ID), 14);
        assert_eq!((sdk.drdIsSupported)(ID), 0);
    }
}

#[test]
fn calibration_and_start_fail_or_hang() {
    let bench = Bench::new(&ArmConfig {
        initialised: false,
        ..ArmConfig::default()
    });
    let sdk = bench.sdk;
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        assert_eq!((sdk.drdOpenID)(0), 0);
        inject(&bench, When::Now, Fault::AutoInitFails(7));
        assert_eq!(((sdk.drdAutoInit)(ID), bench.last_error()), (-1, 7));
        bench.arm.clear_faults().unwrap();

        inject(&bench, When::Now, Fault::AutoInitHangs);
        let (done, result) = mpsc::channel();
        thread::spawn(move || done.send((sdk.drdAutoInit)(ID)));
        bench.arm.wait_until(WITHIN, |s| s.initialising).unwrap();
        assert!(
            result.recv_timeout(Duration::from_millis(300)).is_err(),
            "expected the call to hang, found that it returned"
        );
        // Another thread can still make calls, and the power goes off.
        assert_eq!((sdk.dhdStop)(ID), 0);
        assert_eq!(bench.arm.state().unwrap().mode, Mode::Reset);
        assert_eq!((sdk.drdStop)(false, ID), 0);
        assert_eq!(result.recv_timeout(WITHIN), Ok(-1));
        bench.arm.clear_faults().unwrap();

        assert_eq!((sdk.drdAutoInit)(ID), 0);
        assert_eq!((sdk.drdStop)(false, ID), 0);
        inject(&bench, When::Now, Fault::StartFails(12));
        assert_eq!(((sdk.drdStart)(ID), bench.last_error()), (-1, 12));
    }
}

#[test]
fn a_regulation_that_ends_during_a_move_brakes_the_arm() {
    let bench = high_up();
    inject(&bench, When::IntoMove(0.1), Fault::RegulationDies);
    assert!(bench.move_to([0.0125, 0.0, -0.02]) >= 0);
    let dead = bench.arm.wait_until(WITHIN, |s| !s.regulating).unwrap();
    assert!(dead.mode == Mode::Brake && dead.position_m[2] < 0.05 && dead.position_m[2] > 0.04);
    // SAFETY: a function of the table.
    assert_eq!(unsafe { (bench.sdk.drdIsRunning)(ID) }, 0);
    assert_eq!(
        (bench.move_to([0.0125, 0.0, 0.0]), bench.last_error()),
        (-1, 22)
    );
}

#[test]
fn only_the_watchdog_detects_a_hanging_regulation_thread() {
    let bench = high_up();
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        assert_eq!((bench.sdk.dhdEnableExpertMode)(), 0);
        assert_eq!((bench.sdk.dhdSetWatchdog)(255, ID), 0);
    }
    inject(&bench, When::Below(0.03), Fault::RegulationHangs);
    assert!(bench.move_to([0.0125, 0.0, 0.0]) >= 0);
    let tripped = bench
        .arm
        .wait_until(WITHIN, |s| s.watchdog_trips == 1)
        .unwrap();
    assert!(
        tripped.regulating && tripped.mode == Mode::Brake,
        "{tripped:?}"
    );
    assert_eq!(
        bench.status().force_off_cause(),
        Some(ForceOffCause::Watchdog)
    );
}

#[test]
fn unplugging_fails_every_call_until_the_next_open() {
    let bench = high_up();
    let sdk = &bench.sdk;
    inject(&bench, When::Below(0.04), Fault::Lost);
    assert!(bench.move_to([0.0125, 0.0, 0.0]) >= 0);
    let disconnected = bench.arm.wait_until(WITHIN, |s| !s.connected).unwrap();
    assert!(
        disconnected.mode == Mode::Brake && disconnected.force_off_cause == 5,
        "{disconnected:?}"
    );
    let lost = |result: i32| assert_eq!((result, bench.last_error()), (-1, 2));
    lost(bench.move_to([0.0125, 0.0, 0.0]));
    lost(bench.position().0);
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        lost((sdk.drdStop)(false, ID));
        assert_eq!((sdk.drdOpenID)(0), -1);
        assert_eq!((sdk.dhdGetDeviceCount)(), 0);
        bench.arm.clear_faults().unwrap();
        lost((sdk.drdHold)(ID));
        assert_eq!((sdk.drdOpenID)(0), 0);
        assert!((sdk.drdIsInitialized)(ID) != 0);
        inject(&bench, When::Now, Fault::PowerLost);
        lost((sdk.drdHold)(ID));
        assert_eq!((sdk.drdOpenID)(0), 0);
        assert_eq!((sdk.drdIsInitialized)(ID), 0);
    }
}

#[test]
fn a_trip_leaves_regulation_running_without_power() {
    for (fault, cause) in [
        (Fault::Button, ForceOffCause::Button),
        (Fault::VelocityTrip, ForceOffCause::Velocity),
        (Fault::WatchdogTrip, ForceOffCause::Watchdog),
    ] {
        let bench = high_up();
        inject(&bench, When::Now, fault);
        let status = bench.status();
        assert_eq!(status.force_off_cause(), Some(cause));
        assert!(status.is(StatusField::Brake) && !status.is(StatusField::Force));
        // SAFETY: functions of the table, called with their signatures.
        unsafe {
            assert!((bench.sdk.drdIsRunning)(ID) != 0);
            assert_eq!((bench.sdk.drdStop)(false, ID), 0);
            assert_eq!((bench.sdk.drdStart)(ID), 0);
        }
        // The button on the base has priority: only another press restores the power.
        assert_eq!(
            bench.status().is(StatusField::Force),
            fault != Fault::Button
        );
    }
}

#[test]
fn a_move_that_is_too_fast_trips_the_controller() {
    let bench = high_up();
    // SAFETY: a function of the table.
    let set = unsafe { (bench.sdk.drdSetPosMoveParam)(50.0, 2.0, 5000.0, ID) };
    assert_eq!(set, 0);
    assert!(bench.move_to([0.0125, 0.0, -0.02]) >= 0);
    bench
        .arm
        .wait_until(WITHIN, |s| s.velocity_trips == 1)
        .unwrap();
    assert_eq!(
        bench.status().force_off_cause(),
        Some(ForceOffCause::Velocity)
    );
}

#[test]
fn a_stalled_arm_stays_in_place_while_its_set_point_moves() {
    let bench = high_up();
    inject(&bench, When::Now, Fault::Stalled);
    let start = bench.arm.state().unwrap().position_m;
    inject(&bench, When::Now, Fault::MovingForever);
    assert!(bench.move_to([0.0125, 0.0, 0.04]) >= 0);
    let moved = bench
        .arm
        .wait_until(WITHIN, |s| (s.reference_m[2] - 0.04).abs() < 1e-9)
        .unwrap();
    assert_eq!(moved.position_m, start);
    assert!(moved.saturated, "{moved:?}");
    // SAFETY: a function of the table.
    assert!(unsafe { (bench.sdk.drdIsMoving)(ID) } != 0);
}

#[test]
fn an_arm_with_high_friction_arrives_late() {
    let bench = high_up();
    inject(&bench, When::Now, Fault::Friction(800.0));
    assert!(bench.move_to([0.0125, 0.0, 0.04]) >= 0);
    let sent = |s: &ArmState| (s.reference_m[2] - 0.04).abs() < 1e-9;
    let late = bench.arm.wait_until(WITHIN, sent).unwrap();
    assert!(late.position_m[2] > 0.041, "{late:?}");
    let there = |s: &ArmState| (s.position_m[2] - 0.04).abs() < 1e-4;
    bench.arm.wait_until(WITHIN, there).unwrap();
}

#[test]
fn reported_poses_and_forces_are_falsified() {
    let bench = high_up();
    let (_, real) = bench.position();
    inject(&bench, When::Now, Fault::PositionOffset([0.0, 0.001, 0.0]));
    assert!((bench.position().1[1] - real[1] - 0.001).abs() < 5e-5);
    bench.arm.clear_faults().unwrap();

    inject(&bench, When::Now, Fault::PositionNan);
    assert!(bench.position().1.iter().all(|x| x.is_nan()));
    bench.arm.clear_faults().unwrap();

    inject(&bench, When::Now, Fault::PositionStale);
    let frozen = bench.arm.state().unwrap();
    assert!(bench.move_to([0.0125, 0.0, 0.04]) >= 0);
    let later = bench.arm.wait_until(WITHIN, |s| !s.moving).unwrap();
    assert!(later.position_m[2] < 0.041);
    assert_eq!(
        (later.reported_position_m, later.tick),
        (frozen.reported_position_m, frozen.tick)
    );
    bench.arm.clear_faults().unwrap();

    let [_, _, tare] = bench.force();
    inject(&bench, When::Now, Fault::ForceOffset([0.0, 0.0, -1.0]));
    assert!((bench.force()[2] - tare + 1.0).abs() < 0.05);
    inject(&bench, When::Now, Fault::ForceDrift(-5.0));
    bench
        .arm
        .wait_until(WITHIN, |s| s.reported_force_n[2] < tare - 2.0)
        .unwrap();
    bench.arm.clear_faults().unwrap();
    inject(&bench, When::Now, Fault::ForceNoise(0.5));
    bench
        .arm
        .wait_until(WITHIN, |s| {
            (s.reported_force_n[0] - s.reported_force_n[1]).abs() > 0.2
        })
        .unwrap();
}

#[test]
fn an_ignored_setting_reports_success_and_reads_back_unchanged() {
    let bench = Bench::started(&ArmConfig::default());
    inject(
        &bench,
        When::Now,
        Fault::SettingIgnored(Setting::MotorRatio),
    );
    // SAFETY: functions of the table, called with their signatures.
    let (set, get) = unsafe {
        (
            (bench.sdk.drdSetMotRatioMax)(0.2, ID),
            (bench.sdk.drdGetMotRatioMax)(ID),
        )
    };
    assert_eq!((set, get), (0, 1.0));
}

#[test]
fn stops_and_closes_fail_a_given_number_of_times() {
    let bench = Bench::started(&ArmConfig::default());
    inject(&bench, When::Now, Fault::StopFails(2));
    inject(&bench, When::Now, Fault::CloseFails(1));
    // SAFETY: functions of the table, called with their signatures.
    let results = unsafe {
        let (stop, brake, close) = (bench.sdk.drdStop, bench.sdk.dhdStop, bench.sdk.drdClose);
        [
            stop(false, ID),
            brake(ID),
            stop(false, ID),
            close(ID),
            close(ID),
        ]
    };
    assert_eq!(results, [-1, -1, 0, -1, 0]);
}

#[test]
fn a_short_status_vector_and_a_slow_loop() {
    let bench = Bench::started(&ArmConfig::default());
    inject(&bench, When::Now, Fault::StatusLength(14));
    assert_eq!(bench.status().force_off_cause(), None);
    // SAFETY: a function of the table.
    let rate_khz = || unsafe { (bench.sdk.drdGetCtrlFreq)(ID) };
    let wait = |ns: u64| {
        let now = bench.arm.state().unwrap().t_ns;
        bench.arm.wait_until(WITHIN, |s| s.t_ns > now + ns).unwrap();
    };
    rate_khz();
    wait(200_000_000);
    assert!((rate_khz() - 4.0).abs() < 0.1);
    inject(&bench, When::Now, Fault::LoopRate(0.5));
    rate_khz();
    wait(200_000_000);
    assert!((rate_khz() - 0.5).abs() < 0.1);
}

#[test]
fn a_fault_can_start_at_contact() {
    let bench = high_up();
    bench
        .arm
        .set_contact(Some(Contact::horizontal(0.03)))
        .unwrap();
    inject(&bench, When::Contact, Fault::RegulationDies);
    inject(&bench, When::After(3600.0), Fault::Lost);
    assert!(bench.move_to([0.0125, 0.0, 0.02]) >= 0);
    let dead = bench.arm.wait_until(WITHIN, |s| !s.regulating).unwrap();
    assert!(
        dead.connected && (dead.position_m[2] - 0.03).abs() < 0.005,
        "{dead:?}"
    );
}
