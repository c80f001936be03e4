//! Opening: each obstacle is reported with the next step, nothing moves, and the device is closed again.

use skinrig_drd_abi::ErrorCode;

use super::scripted::Scripted;
use crate::OmegaConfig;
use crate::Remark;
use crate::config::{InitialiseRule, RedundantEncoders, SupervisorCommand, Timeouts, Watchdog};
use crate::enumerate;
use crate::open::open;
use crate::supervisor::brake_all;

/// An obstacle, and phrases that the error must contain.
type Obstacle = (fn(&Scripted), &'static [&'static str]);

#[test]
fn every_obstacle_is_reported_and_leaves_a_braked_closed_robot() {
    let obstacles: [Obstacle; 14] = [
        (|s| s.with(|s| s.devices = 0), &["no device", "connect"]),
        (
            |s| s.fail("drdOpenID", ErrorCode::DEVICE_IN_USE),
            &["busy", "end the other program"],
        ),
        (
            |s| s.fail("drdOpenID", ErrorCode::NO_DRIVER_FOUND),
            &["not permitted", "udev"],
        ),
        (|s| s.with(|s| s.serial = 78), &["serial 77", "serial 78"]),
        (|s| s.with(|s| s.type_number = 60), &["type 33", "type 60"]),
        (
            |s| s.with(|s| s.type_number = 110),
            &["type 110", "refused"],
        ),
        (
            |s| s.fail("dhdCheckControllerMemory", ErrorCode::CONFIGURATION),
            &["configuration is damaged", "contact"],
        ),
        (|s| s.with(|s| s.supported = false), &["can control"]),
        (
            |s| s.with(|s| _ = s.status.insert(0, 0)),
            &["power", "switch the robot on"],
        ),
        (
            |s| s.with(|s| _ = s.status.insert(9, 1)),
            &["a fault reported"],
        ),
        (
            |s| s.with(|s| s.ignore.push("device_angle_deg")),
            &["device_angle_deg", "found 0.5"],
        ),
        (
            |s| s.with(|s| s.ignore.push("watchdog")),
            &["watchdog_125us", "expected 80", "found 3"],
        ),
        (
            |s| s.fail("dhdSetWatchdog", ErrorCode::NOT_AVAILABLE),
            &["watchdog", "supervisor"],
        ),
        (
            |s| s.with(|s| s.initialised = false),
            &["initialised since power-up", "sample_is_off"],
        ),
    ];
    let config = OmegaConfig {
        serial: Some(77),
        ..OmegaConfig::default()
    };
    for (spoil, words) in obstacles {
        let sdk = Scripted::default();
        spoil(&sdk);
        let error = open(&sdk, &config, |_| Ok(())).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "{word} is not in {error}");
        }
        let log = sdk.log();
        for forbidden in ["drdStart", "drdAutoInit", "drdTrackPos"] {
            assert!(!log.iter().any(|c| c == forbidden), "{log:?}");
        }
        let opened = log.iter().filter(|c| *c == "drdOpenID").count();
        let closed = log.iter().filter(|c| *c == "drdClose").count();
        let refused = usize::from(error.contains("busy") || error.contains("not permitted"));
        assert_eq!(opened, closed + refused, "{log:?}");
    }
}

#[test]
fn the_robot_is_selected_by_its_serial_number_and_the_others_are_closed() {
    let sdk = Scripted::default();
    sdk.with(|s| s.devices = 3);
    let config = OmegaConfig {
        serial: Some(78),
        ..OmegaConfig::default()
    };
    let opened = open(&sdk, &config, |_| Ok(())).unwrap();
    assert_eq!((opened.id, opened.serial.as_str()), (1, "78"));
    assert_eq!(sdk.log()[..3], ["drdOpenID", "drdClose", "drdOpenID"]);
    // With several robots the serial number is required.
    let error = open(&sdk, &OmegaConfig::default(), |_| Ok(()))
        .unwrap_err()
        .to_string();
    assert!(error.contains("add the serial number"), "{error}");
}

#[test]
fn initialisation_requires_that_the_sample_is_off_and_ends_braked() {
    let sdk = Scripted::default();
    sdk.with(|s| s.initialised = false);
    let config = OmegaConfig {
        initialise: InitialiseRule::SampleIsOff,
        ..OmegaConfig::default()
    };
    let mut before = None;
    let opened = open(&sdk, &config, |serial| {
        before = Some((serial, sdk.log().contains(&"drdAutoInit".to_owned())));
        Ok(())
    })
    .unwrap();
    assert_eq!(before, Some((Some(77), false)), "guarded before any motion");
    let log = sdk.log();
    assert_eq!(log[log.len() - 2..], ["drdAutoInit", "drdStop"]);
    assert!(opened.remarks.contains(&Remark::InitialisedItself));
}

#[test]
fn redundant_encoders_are_reported_and_required_only_if_configured() {
    use RedundantEncoders::{Reported, Required};
    // Status word 13; missing in SDKs that write fewer words.
    for (word, expected, opens, remarked) in [
        (Some(1), Reported, true, false),
        (Some(0), Reported, true, true),
        (Some(-1), Reported, true, false),
        (Some(1), Required, true, false),
        (Some(0), Required, false, false),
        (Some(-1), Required, false, false),
    ] {
        let sdk = Scripted::default();
        sdk.with(|s| s.status.extend(word.map(|w| (13, w))));
        let config = OmegaConfig {
            redundant_encoders: expected,
            ..OmegaConfig::default()
        };
        match open(&sdk, &config, |_| Ok(())) {
            Ok(opened) => {
                assert!(opens, "{word:?} {expected:?}");
                let is_remarked = opened.remarks.contains(&Remark::NoRedundantEncoders);
                assert_eq!(is_remarked, remarked, "{word:?} {expected:?}");
                let recorded = opened.settings.iter().any(|s| {
                    s.name == "redundant_encoders"
                        && Some(&s.read_back) == word.map(|w| w.to_string()).as_ref()
                });
                assert!(recorded, "{:?}", opened.settings);
            }
            Err(e) => {
                assert!(!opens, "{word:?} {expected:?}: {e}");
                assert!(
                    e.to_string().contains("redundant_encoders: reported"),
                    "{e}"
                );
            }
        }
    }
}

#[test]
fn a_supervisor_substitutes_for_a_missing_watchdog() {
    let sdk = Scripted::default();
    sdk.fail("dhdSetWatchdog", ErrorCode::NOT_IMPLEMENTED);
    let config = OmegaConfig {
        watchdog: Watchdog::ArmMilliseconds(5.0),
        supervisor: Some(SupervisorCommand {
            program: "supervisor".into(),
            arguments: Vec::new(),
        }),
        ..OmegaConfig::default()
    };
    let opened = open(&sdk, &config, |_| Ok(())).unwrap();
    assert!(opened.remarks.contains(&Remark::NoWatchdog));
}

#[test]
fn a_list_shows_devices_that_are_busy_or_not_permitted_and_touches_no_motor() {
    let sdk = Scripted::default();
    sdk.with(|s| s.devices = 2);
    let all = enumerate::list(&sdk).unwrap();
    assert_eq!(all[1].to_string(), "scripted, serial 78: free");
    assert_eq!(all[1].next_step(), None);
    sdk.with(|s| s.type_number = 110);
    let all = enumerate::list(&sdk).unwrap();
    assert!(all[0].to_string().contains("not an omega.3"), "{}", all[0]);
    for (code, word) in [
        (ErrorCode::DEVICE_IN_USE, "busy"),
        (ErrorCode::NO_DRIVER_FOUND, "not permitted"),
    ] {
        sdk.fail("drdOpenID", code);
        let all = enumerate::list(&sdk).unwrap();
        assert!(all[0].to_string().contains(word), "{}", all[0]);
        assert!(all[0].next_step().is_some());
    }
    let log = sdk.log();
    assert!(
        log.iter().all(|c| c == "drdOpenID" || c == "drdClose"),
        "{log:?}"
    );
}

#[test]
fn motors_left_live_by_a_dead_program_are_braked_first() {
    let sdk = Scripted::default();
    sdk.with(|s| s.live = true);
    let opened = open(&sdk, &OmegaConfig::default(), |_| Ok(())).unwrap();
    assert!(!sdk.with(|s| s.live));
    assert!(opened.remarks.contains(&Remark::MotorsWereLive));
}

#[test]
fn a_stop_without_effect_is_followed_by_direct_stops() {
    let sdk = Scripted::default();
    sdk.with(|s| (s.live, s.stop_needs_regulation) = (true, true));
    open(&sdk, &OmegaConfig::default(), |_| Ok(())).unwrap();
    assert!(!sdk.with(|s| s.live));
    let log = sdk.log();
    let at = log.iter().position(|c| c == "drdStop").unwrap();
    assert_eq!(log[at..at + 3], ["drdStop", "dhdStop", "dhdEnableForce"]);
}

#[test]
fn brake_all_brakes_every_robot_that_may_be_the_one_and_no_other() {
    let once = Timeouts {
        brake_attempts: 1,
        ..Timeouts::default()
    };
    // Indices 0 to 2 have the serial numbers 77 to 79.
    for (expected, without_serial, opened, braked) in [
        (Some(78), vec![], 2, 1),
        (Some(78), vec![0], 2, 2),
        (Some(78), vec![1], 3, 1),
        (None, vec![], 3, 3),
    ] {
        let sdk = Scripted::default();
        sdk.with(|s| (s.devices, s.without_serial) = (3, without_serial));
        brake_all(&sdk, expected, &once).unwrap();
        let count = |call| sdk.log().iter().filter(|c| *c == call).count();
        assert_eq!((count("drdOpenID"), count("drdStop")), (opened, braked));
        assert_eq!(count("drdClose"), opened);
    }
    let sdk = Scripted::default();
    assert!(brake_all(&sdk, Some(80), &once).is_err());
    sdk.fail("drdOpenID", ErrorCode::DEVICE_IN_USE);
    assert!(brake_all(&sdk, Some(77), &once).is_err(), "not free yet");
}
