//! Rejected calls, with their error and thread.

use std::ptr::null_mut;
use std::thread;

use drd::{ArmConfig, DeviceConfig, Mode};
use skinrig_drd_abi::{MOTOR_SATURATED, StatusField, StatusVector, TIMEGUARD};

use crate::support::{Bench, ID, WITHIN};

#[test]
fn each_misuse_has_its_error() {
    let bench = Bench::new(&ArmConfig {
        initialised: false,
        ..ArmConfig::default()
    });
    let sdk = &bench.sdk;
    let fails = |what: &str, result: i32, code: i32| {
        assert_eq!((result, bench.last_error()), (-1, code), "{what}");
    };
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        fails("before open", (sdk.drdStart)(ID), 5);
        fails("index", (sdk.drdOpenID)(7), 15);
        assert_eq!((sdk.drdOpenID)(0), 0);
        fails("another id", (sdk.drdHold)(3), 15);
        assert!(bench.status().is(StatusField::Reset));
        fails("start in reset", (sdk.drdStart)(ID), 12);
        fails(
            "move without regulation",
            bench.move_to([0.0, 0.0, 0.0]),
            22,
        );
        fails("hold without regulation", (sdk.drdHold)(ID), 22);
        fails(
            "track without regulation",
            (sdk.drdTrackPos)(0.0, 0.0, 0.0, ID),
            22,
        );
        fails(
            "watchdog without expert mode",
            (sdk.dhdSetWatchdog)(10, ID),
            9,
        );
        assert_eq!((sdk.dhdEnableExpertMode)(), 0);
        assert_eq!((sdk.dhdSetWatchdog)(10, ID), 0);
        assert_eq!((sdk.dhdDisableExpertMode)(), 0);
        fails(
            "watchdog after expert mode",
            (sdk.dhdGetWatchdog)(null_mut(), ID),
            9,
        );
        fails(
            "NULL",
            (sdk.dhdGetPosition)(null_mut(), null_mut(), null_mut(), ID),
            17,
        );
        fails("NULL status", (sdk.dhdGetStatus)(null_mut(), ID), 17);
        fails("ratio over 1", (sdk.drdSetMotRatioMax)(1.5, ID), 21);
        fails(
            "negative speed",
            (sdk.drdSetPosMoveParam)(1.0, -1.0, 1.0, ID),
            21,
        );
        fails("NaN", (sdk.dhdSetEffectorMass)(f64::NAN, ID), 21);

        assert_eq!((sdk.drdAutoInit)(ID), 0);
        assert!((sdk.drdIsRunning)(ID) != 0 && (sdk.drdIsInitialized)(ID) != 0);
        fails("out of reach", bench.move_to([0.5, 0.0, 0.0]), 8);
        fails("NaN target", bench.move_to([f64::NAN, 0.0, 0.0]), 21);
        assert_eq!((sdk.drdStop)(false, ID), 0);
        fails("move after stop", bench.move_to([0.0, 0.0, 0.0]), 22);
        assert_eq!((sdk.drdClose)(ID), 0);
        fails("after close", (sdk.drdStart)(ID), 5);
    }
}

#[test]
fn an_error_belongs_to_the_thread_that_caused_it() {
    let bench = Bench::new(&ArmConfig::default());
    // SAFETY: a function of the table.
    assert_eq!(unsafe { (bench.sdk.drdStart)(ID) }, -1);
    let elsewhere = thread::scope(|s| s.spawn(|| bench.last_error()).join().unwrap());
    assert_eq!((bench.last_error(), elsewhere), (5, 0));
    assert_eq!(bench.arm.journal().unwrap().owners().len(), 1);
}

#[test]
fn cached_readings_and_saturated_motors_are_successes_other_than_zero() {
    let bench = Bench::started(&ArmConfig::default());
    // A busy computer may let the arm advance between two readings, but not every time.
    let readings: Vec<i32> = (0..1000).map(|_| bench.position().0).collect();
    assert!(readings.contains(&TIMEGUARD) && readings.iter().all(|rc| *rc >= 0));
    // Less than the arm's weight: the motors saturate, and the arm sinks despite the regulation.
    // SAFETY: a function of the table.
    assert_eq!(unsafe { (bench.sdk.drdSetMotRatioMax)(0.05, ID) }, 0);
    let before = bench.arm.wait_until(WITHIN, |s| s.saturated).unwrap();
    assert_eq!(bench.move_to([0.02, 0.0, 0.03]), MOTOR_SATURATED);
    bench
        .arm
        .wait_until(WITHIN, |s| s.position_m[2] < before.position_m[2] - 0.002)
        .unwrap();
}

#[test]
fn the_status_vector_has_the_length_of_the_version() {
    for (sdk, length) in [
        ([3, 5, 1], 15),
        ([3, 7, 1], 16),
        ([3, 10, 0], 16),
        ([3, 17, 5], 17),
    ] {
        let bench = Bench::new(&ArmConfig {
            sdk,
            ..ArmConfig::default()
        });
        // SAFETY: a function of the table.
        assert_eq!(unsafe { (bench.sdk.drdOpenID)(0) }, 0);
        let status: StatusVector = bench.status();
        assert_eq!(status.words().len(), length, "{sdk:?}");
    }
}

#[test]
fn only_the_device_of_the_right_serial_has_an_arm() {
    let serials = [77, 1234, 78];
    let device = |serial| DeviceConfig {
        serial,
        ..DeviceConfig::default()
    };
    let devices = serials.map(device).to_vec();
    let bench = Bench::new(&ArmConfig {
        devices,
        arm_index: 1,
        ..ArmConfig::default()
    });
    let sdk = &bench.sdk;
    let mut found = Vec::new();
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        assert_eq!((sdk.dhdGetDeviceCount)(), 3);
        for id in 0..3 {
            assert_eq!((sdk.drdOpenID)(id), i32::from(id));
            let mut serial = 0;
            assert_eq!((sdk.dhdGetSerialNumber)(&raw mut serial, id), 0);
            found.push(serial);
            assert_eq!(((sdk.drdStart)(id) == 0), id == 1);
            assert_eq!((sdk.drdClose)(id), 0);
        }
    }
    assert_eq!(found, serials);
}

#[test]
fn the_brake_is_viscous_and_the_arm_rests_on_the_sample_below() {
    let contact = Some(drd::Contact::horizontal(0.017));
    let bench = Bench::started(&ArmConfig {
        contact,
        ..ArmConfig::default()
    });
    // SAFETY: a function of the table.
    assert_eq!(unsafe { (bench.sdk.dhdStop)(ID) }, 0);
    let sinking = bench
        .arm
        .wait_until(WITHIN, |s| s.velocity_m_s[2] < -0.001)
        .unwrap();
    assert!(
        sinking.mode == Mode::Brake && sinking.velocity_m_s[2] > -0.02,
        "{sinking:?}"
    );
    let resting = bench
        .arm
        .wait_until(WITHIN, |s| s.contact_force_n[2] > 1.0)
        .unwrap();
    assert_eq!(resting.mode, Mode::Brake);
}
