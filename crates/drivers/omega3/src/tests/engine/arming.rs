//! Settings and checks before the motors are live.

use super::*;

#[test]
fn keeps_the_contract() {
    let options = IndenterContract {
        limits: LIMITS,
        targets: [Point3::new(20.0, 0.0, -5.0), Point3::new(25.0, 8.0, 12.0)],
        outside: Point3::new(0.0, 31.0, 0.0),
        speed_mm_s: 30.0,
        tolerance_mm: 0.05,
        move_timeout: HostDuration::from_millis(2_000),
        rate_share: 0.9,
    };
    contract::indenter(
        &mut || {
            let bench = Bench::new();
            (Box::new(Handle(bench.clone())), Box::new(Handle(bench)))
        },
        &options,
    );
}

#[test]
fn a_start_that_resets_settings_is_configured_again_before_the_first_target() {
    let bench = Bench::armed();
    let log = bench.sdk.log();
    let start = log.iter().position(|c| c == "drdStart").unwrap();
    let target = log.iter().position(|c| c == "drdTrackPos").unwrap();
    for call in [
        "motor_ratio_max",
        "gain_i",
        "move_parameters",
        "track_parameters",
        "drdEnableFilter",
    ] {
        let last = log.iter().rposition(|c| c == call).unwrap();
        assert!(start < last && last < target, "{call} in {log:?}");
    }
    let limits = bench.sdk.with(|s| s.generator_limits[1]);
    assert!(limits.speed_m_s < 0.1, "not the library's 1 m/s: {limits}");
    let ratio = bench.sdk.with(|s| s.values["motor_ratio_max"]);
    assert!((ratio - 4.0 / 12.0).abs() < 1e-12, "{ratio}");
}

#[test]
fn a_setting_that_does_not_read_back_prevents_arming() {
    for (ignored, name) in [
        ("motor_ratio_max", "motor_ratio_max"),
        ("gain_i", "gain_i"),
        ("track_parameters", "track_parameters"),
        ("filter", "track_filter"),
    ] {
        let bench = Bench::new();
        bench.request(|e| e.configure(&LIMITS)).unwrap();
        bench.sdk.with(|s| {
            s.ignore.push(ignored);
            s.generator_limits[1].speed_m_s = 1.0;
            s.values.clear();
        });
        let error = bench.request(Engine::arm).unwrap_err();
        let DeviceError::ReadBack { name: found, .. } = &error else {
            panic!("{ignored}: {error}")
        };
        assert_eq!(found, name);
        assert!(!bench.sdk.with(|s| s.live), "{ignored}: left live");
    }
}

#[test]
fn an_arm_that_rests_on_something_cannot_be_armed() {
    let bench = Bench::new();
    bench.request(|e| e.configure(&LIMITS)).unwrap();
    bench.sdk.with(|s| s.force_n = [0.0, 0.0, -1.8]);
    let error = bench.request(Engine::arm).unwrap_err().to_string();
    assert!(error.contains("does not hang free"), "{error}");
    assert!(!bench.sdk.with(|s| s.live));
    // Reported once; the robot is disarmed.
    assert_eq!(bench.stream.failure(), None);
}

#[test]
fn a_force_off_cause_from_before_arming_is_not_reported_as_new() {
    for (cause, ended, word) in [
        (5, true, "regulation thread ended"),
        (1, true, "regulation thread ended"),
        (1, false, "without a new cause"),
    ] {
        let bench = Bench::new();
        bench.sdk.with(|s| s.cause = cause);
        bench.request(|e| e.configure(&LIMITS)).unwrap();
        bench.request(Engine::arm).unwrap();
        bench.sdk.with(|s| (s.running, s.live) = (!ended, false));
        bench.run_ms(30);
        let failure = bench.stream.failure().unwrap();
        assert!(matches!(failure, DeviceError::State { .. }), "{failure}");
        assert!(failure.to_string().contains(word), "{word}: {failure}");
    }
}

#[test]
fn values_read_back_are_recorded_as_separate_numbers() {
    let bench = Bench::new();
    let settings = bench.request(|e| e.configure(&LIMITS)).unwrap();
    let speed = settings
        .iter()
        .find(|s| s.name == "track_parameters_speed_m_s")
        .unwrap();
    assert_eq!((&*speed.requested, &*speed.read_back), ("0.08", "0.08"));
    let read_of = |name: &str| {
        let settings = bench.request(|e| e.configure(&LIMITS)).unwrap();
        let found = settings.into_iter().find(|s| s.name == name).unwrap();
        (found.requested, found.read_back)
    };
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    assert_eq!(read_of("initialised"), pair("true", "true"));
    bench.sdk.with(|s| s.initialised = false);
    assert_eq!(read_of("initialised"), pair("true", "false"));
}

#[test]
fn settings_accepted_only_while_regulating_are_no_difference() {
    let bench = Bench::new();
    bench
        .sdk
        .with(|s| s.needs_regulation.push("motor_ratio_max"));
    let settings = bench.request(|e| e.configure(&LIMITS)).unwrap();
    for s in &settings {
        let as_found = s.requested == Setting::AS_FOUND;
        assert!(as_found || s.requested == s.read_back, "{s:?}");
    }
    assert!(settings.iter().all(|s| s.name != "gain_i"));
    bench.request(Engine::arm).unwrap();
    bench.request(Engine::disarm).unwrap();
    let settings = bench.request(|e| e.configure(&LIMITS)).unwrap();
    assert!(settings.iter().any(|s| s.name == "gain_i"), "{settings:?}");
}

#[test]
fn a_watchdog_reset_by_a_start_is_set_again() {
    let bench = Bench::armed();
    assert_eq!(bench.sdk.with(|s| s.watchdog), 80);
    bench.request(Engine::disarm).unwrap();
    bench.sdk.with(|s| s.ignore.push("watchdog"));
    let error = bench.request(Engine::arm).unwrap_err();
    assert!(
        matches!(&error, DeviceError::ReadBack { name, .. } if name == "watchdog_125us"),
        "{error}"
    );
    assert!(!bench.sdk.with(|s| s.live));
}
