//! Motion within its limits, and its samples.

use super::*;

#[test]
fn at_the_force_limit_the_tip_stops_and_may_only_rise() {
    let bench = Bench::armed();
    bench.go([20.0, 0.0, 0.0], 20.0).unwrap();
    bench.run_ms(100);
    // 4.2 N above the tare of 0.2 N; the limit is 4 N.
    bench.sdk.with(|s| s.force_n = [0.0, 0.0, 0.2 - 4.1]);
    bench.run_ms(1);
    bench.poll();
    bench.run_ms(50);
    let (samples, _) = bench.poll();
    let set_points: Vec<_> = samples.iter().map(|s| s.commanded).collect();
    assert!(
        set_points.windows(2).all(|w| w[0] == w[1]),
        "the motion continued"
    );
    assert!((samples[0].force_n - 4.1).abs() < 1e-9, "{:?}", samples[0]);
    assert_eq!(bench.stream.failure(), None);
    let deeper = bench.go([20.0, 0.0, 0.0], 20.0);
    assert!(
        matches!(deeper, Err(DeviceError::Refused { .. })),
        "{deeper:?}"
    );
    bench.sdk.with(|s| s.force_n = [0.0, 0.0, 0.2]);
    bench.run_ms(1);
    let still = bench.go([20.0, 0.0, 0.0], 20.0);
    assert!(still.is_err(), "only a rise releases it");
    bench.go([20.0, 0.0, 12.0], 20.0).unwrap();
    bench.run_ms(1000);
    bench.go([20.0, 0.0, 0.0], 20.0).unwrap();
}

#[test]
fn a_sideways_path_is_not_a_rise_however_far_the_arm_sags() {
    let bench = Bench::armed();
    // The arm hangs 1 mm below its set point.
    bench
        .sdk
        .with(|s| (s.follows, s.position_m[2]) = (false, 0.009));
    bench.go([25.0, 0.0, 10.0], 20.0).unwrap();
    bench.run_ms(100);
    bench.sdk.with(|s| s.force_n = [0.0, 0.0, 0.2 - 4.1]);
    bench.run_ms(1);
    let stopped = bench.sdk.with(|s| s.target_m);
    bench.run_ms(50);
    assert_eq!(
        bench.sdk.with(|s| s.target_m),
        stopped,
        "the motion continued"
    );
    let [x, y, _] = stopped.map(|m| m * 1e3);
    for (to, allowed) in [
        ([x, y, 10.0], false),
        ([x + 5.0, y, 10.5], false),
        ([x + 5.0, y, 20.0], true),
        ([x, y, 20.0], true),
    ] {
        assert_eq!(bench.go(to, 20.0).is_ok(), allowed, "{to:?}");
    }
}

#[test]
fn a_stuck_arm_is_not_pulled_beyond_the_lead() {
    let bench = Bench::armed();
    bench.sdk.with(|s| s.follows = false);
    bench.go([20.0, 0.0, -20.0], 20.0).unwrap();
    for _ in 0..200 {
        bench.run_ms(5);
        let (lead, live) = bench.sdk.with(|s| {
            let d: f64 = (0..3)
                .map(|i| (s.target_m[i] - s.position_m[i]).powi(2))
                .sum();
            (d.sqrt() * 1e3, s.live)
        });
        assert!(
            live && lead <= bench.config.motion.max_lead_mm + 1e-9,
            "{lead} mm"
        );
    }
}

#[test]
fn a_robot_that_presses_forward_has_a_rotated_robot_frame() {
    let mut config = OmegaConfig::default();
    // Robot z, away from the sample, is device -x.
    config.mount.axes = Axes::new([Axis::PlusZ, Axis::PlusY, Axis::MinusX]).unwrap();
    config.envelope.min_mm = [-40.0; 3];
    config.envelope.max_mm = [40.0; 3];
    let bench = Bench::with(config);
    let limits = MotionLimits {
        min_mm: [-30.0; 3],
        max_mm: [30.0; 3],
        ..LIMITS
    };
    bench.request(|e| e.configure(&limits)).unwrap();
    bench.sdk.with(|s| s.force_n = [0.0; 3]);
    bench.request(Engine::arm).unwrap();
    bench.go([5.0, -3.0, -25.0], 20.0).unwrap();
    bench.run_ms(1900);
    bench.poll();
    let at = bench.sdk.with(|s| s.position_m);
    let off: f64 = (0..3)
        .map(|i| (at[i] - [0.025, -0.003, 0.005][i]).abs())
        .sum();
    assert!(off < 1e-6, "{at:?}");
    // The motors push along +x into the sample, so the sample pushes along robot +z.
    bench.sdk.with(|s| s.force_n = [1.5, 0.0, 0.0]);
    bench.run_ms(2);
    let (samples, _) = bench.poll();
    let last = samples.last().unwrap();
    assert!((last.force_n - 1.5).abs() < 1e-9, "{last:?}");
}

#[test]
fn an_unread_stream_is_bounded_and_counts_dropped_samples() {
    let bench = Bench::armed();
    for _ in 0..10 {
        // The program commands the robot but never takes samples.
        bench.request(Engine::hold).unwrap();
        bench.run_ms(1000);
    }
    let (samples, dropped) = bench.poll();
    assert_eq!(samples.len(), crate::stream::CAPACITY);
    assert!(dropped > 3_000, "{dropped}");
    let (_, repeated) = bench.poll();
    assert_eq!(repeated, 0);
}

#[test]
fn late_cycles_delay_the_motion_and_never_lengthen_a_step() {
    let bench = Bench::armed();
    bench.go([20.0, 0.0, -20.0], 40.0).unwrap();
    let mut clock = bench.clock.clone();
    let mut last = bench.sdk.with(|s| s.target_m);
    for _ in 0..100 {
        let later = clock.now() + HostDuration::from_millis(50);
        clock.wait_until(later);
        bench.poll();
        bench.request(Engine::tick);
        let now = bench.sdk.with(|s| s.target_m);
        let step = (now[2] - last[2]).abs() * 1e3;
        assert!(step <= bench.config.motion.max_step_mm + 1e-9, "{step} mm");
        last = now;
    }
    assert!(last[2] < 0.009, "it still moves: {last:?}");
}
