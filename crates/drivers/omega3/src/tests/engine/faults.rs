//! Faults brake the arm, are reported, and remain until it is disarmed.

use super::*;

#[test]
fn every_fault_brakes_and_is_reported_until_disarmed() {
    let mishaps: [FaultCase; 12] = [
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
            bench.request(Engine::arm).is_err(),
            "{word}: armed after a fault"
        );
        // After a repair and a disarm the robot works again.
        bench.sdk.with(|s| {
            *s = super::super::scripted::Script {
                log: Vec::new(),
                ..Scripted::default().script.into_inner().unwrap()
            }
        });
        bench.request(Engine::disarm).unwrap();
        bench.request(Engine::arm).unwrap();
        assert_eq!(bench.stream.failure(), None, "{word}");
    }
}

#[test]
fn a_disconnected_robot_stays_lost() {
    for armed in [true, false] {
        let bench = Bench::armed();
        if !armed {
            bench.request(Engine::disarm).unwrap();
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
        assert!(words.contains("connection to the device failed"), "{words}");
        for answer in [
            bench.request(Engine::disarm),
            bench.request(Engine::arm),
            bench.request(Engine::hold),
        ] {
            assert!(
                matches!(answer, Err(DeviceError::Lost { .. })),
                "{answer:?}"
            );
        }
    }
}

#[test]
fn a_failing_brake_is_retried_in_every_way_and_reported() {
    let bench = Bench::armed();
    bench.sdk.with(|s| s.fail.insert("drdStop", (22, 3)));
    bench.sdk.with(|s| s.fail.insert("dhdStop", (1, 3)));
    let before = bench.clock.now();
    bench.request(Engine::disarm).unwrap();
    let tries = bench.sdk.log().iter().filter(|c| *c == "drdStop").count();
    assert_eq!(tries, 4);
    assert_eq!(bench.clock.now() - before, HostDuration::from_millis(300));

    bench.request(Engine::arm).unwrap();
    bench.sdk.fail("drdStop", ErrorCode::NO_REGULATION);
    bench.sdk.fail("dhdStop", ErrorCode::COM);
    let error = bench.request(Engine::disarm).unwrap_err().to_string();
    for word in ["may be live", "20 attempts", "mains"] {
        assert!(error.contains(word), "{word} is not in {error}");
    }
}

#[test]
fn a_brake_without_effect_is_not_accepted() {
    let bench = Bench::armed();
    bench.sdk.with(|s| s.status.insert(5, 1));
    let error = bench.request(Engine::disarm).unwrap_err().to_string();
    assert!(error.contains("motors are live"), "{error}");
}

#[test]
fn an_arm_that_is_not_polled_is_braked_and_one_that_is_polled_is_not() {
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
        failure.contains("the live arm was not polled for 2s"),
        "{failure}"
    );
    // A braked arm need not be polled.
    bench.request(Engine::disarm).unwrap();
    bench.run_ms(10_000);
    assert_eq!(bench.stream.failure(), None);
}

#[test]
fn unreadable_forces_trip_even_if_positions_are_readable() {
    let bench = Bench::armed();
    bench.sdk.fail("dhdGetForce", ErrorCode::TIMEOUT);
    bench.run_ms(20);
    let failure = bench.stream.failure().unwrap().to_string();
    assert!(failure.contains("dhdGetForce"), "{failure}");
    assert!(!bench.sdk.with(|s| s.live));
}

#[test]
fn slowly_failing_readings_count_as_silence() {
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
        bench.request(Engine::tick);
    }
    let failure = bench.stream.failure().unwrap().to_string();
    assert!(failure.contains("no new position"), "{failure}");
}

#[test]
fn a_failed_brake_ends_the_motion_and_is_retried() {
    let bench = Bench::armed();
    bench.go([20.0, 0.0, -20.0], 20.0).unwrap();
    bench.run_ms(50);
    for call in ["drdStop", "dhdStop", "dhdEnableForce"] {
        bench.sdk.fail(call, ErrorCode::DHC_BUSY);
    }
    let error = bench.request(Engine::disarm).unwrap_err();
    assert_eq!(bench.stream.failure(), Some(error));
    let target = bench.sdk.with(|s| s.target_m);
    bench.run_ms(100);
    assert_eq!(
        bench.sdk.with(|s| s.target_m),
        target,
        "the motion continues"
    );
    assert!(bench.go([20.0, 0.0, 20.0], 20.0).is_err());
    bench.sdk.with(|s| s.fail.clear());
    bench.request(Engine::disarm).unwrap();
    assert!(!bench.sdk.with(|s| s.live));
    bench.request(Engine::arm).unwrap();
    assert_eq!(bench.stream.failure(), None);
}

#[test]
fn dropping_the_owner_brakes_and_closes() {
    let bench = Bench::armed();
    let sdk = bench.sdk.clone();
    drop(bench);
    let log = sdk.log();
    let [.., stop, close] = log.as_slice() else {
        panic!("{log:?}")
    };
    assert_eq!((stop.as_str(), close.as_str()), ("drdStop", "drdClose"));
}
