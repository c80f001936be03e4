//! The watchdog, alone and in a run: every cause trips within two ticks of rig time, and nothing else trips it.

use proptest::prelude::*;
use skinrig_controller::{ControllerSettings, WatchLimits, Watchdog, WatchdogTrip};
use skinrig_model::{HostTime, Point3, PoseSample, Record, RunEnd};
use skinrig_protocol::plan::TripReaction;

use crate::course::{START, faults, run_plan};
use crate::mock::*;

fn limits() -> WatchLimits {
    let settings = ControllerSettings::default();
    WatchLimits::of(&LIMITS, &settings)
}

fn sample(ms: i64, at: [f64; 3], force_n: f64) -> PoseSample {
    let at = Point3::new(at[0], at[1], at[2]);
    PoseSample {
        t: HostTime(ms * MS),
        commanded: at,
        measured: at,
        force_n,
    }
}

/// The trip of samples 1 ms apart, checked after each.
fn trip_of(samples: impl IntoIterator<Item = ([f64; 3], f64)>) -> Option<(i64, WatchdogTrip)> {
    let mut watchdog = Watchdog::new(limits());
    watchdog.start();
    for (i, (at, force_n)) in samples.into_iter().enumerate() {
        let ms = i as i64 + 1;
        let observed = watchdog.check_sample(&sample(ms, at, force_n));
        if let Err(trip) = observed.and_then(|()| watchdog.check_poll(HostTime(ms * MS))) {
            return Some((ms, trip));
        }
    }
    None
}

/// Largest change of position within the 5 ms over which speed is measured, plus the sample before them.
const JUMP_MM: f64 = 1.25 * LIMITS.max_speed_mm_s * 6e-3 + LIMITS.position_tolerance_mm;

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    /// Motions within the limits, with noise far below the tolerance, never trip.
    #[test]
    fn samples_within_the_limits_never_trip(
        speed in 0.0..=100.0f64, way in prop::array::uniform3(-1.0..1.0f64),
        noise in prop::collection::vec(prop::array::uniform3(-0.01..0.01f64), 1..200), force in 0.0..=8.0f64,
    ) {
        let length = way.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-3);
        let samples = noise.iter().enumerate().map(|(i, noise)| {
            let at = std::array::from_fn(|k| way[k] / length * speed * 1e-3 * i as f64 + noise[k]);
            (at, if i % 7 == 0 { f64::NAN } else { force })
        });
        // The floor is 3 mm down; another test covers positions below it.
        let kept: Vec<_> = samples.take_while(|(at, _): &([f64; 3], f64)| at[2] > -3.0).collect();
        prop_assert_eq!(trip_of(kept), None);
    }

    /// A violated limit trips at its sample, after any earlier samples.
    #[test]
    fn a_violated_limit_trips_immediately(calm in 6usize..60, which in 0..3, by in 1.001..50.0f64) {
        let bad = match which {
            0 => ([0.0; 3], 8.0 * by),
            1 => ([0.0, 0.0, -0.12 * by - 3.0], 0.0),
            _ => ([0.0, JUMP_MM * by, 0.0], 0.0),
        };
        let before = ([0.0, 0.0, if which == 1 { -3.0 } else { 0.0 }], 1.0);
        let samples = std::iter::repeat_n(before, calm).chain([bad]);
        let found = trip_of(samples);
        let at = found.as_ref().map(|(ms, _)| *ms);
        prop_assert_eq!(at, Some(calm as i64 + 1), "{:?}", found);
        let right = match found.map(|(_, trip)| trip) {
            Some(WatchdogTrip::Force { .. }) => which == 0,
            Some(WatchdogTrip::Depth { .. }) => which == 1,
            Some(WatchdogTrip::Speed { .. }) => which == 2,
            _ => false,
        };
        prop_assert!(right);
    }
}

#[test]
fn only_sustained_motion_counts_as_speed() {
    // 180 mm/s: each step is within the tolerance of two samples, five of them are not.
    let creep = |step_mm: f64| trip_of((0..50).map(|i| ([step_mm * f64::from(i), 0.0, 10.0], 0.0)));
    assert_eq!(creep(0.1), None);
    assert!(matches!(creep(0.16), Some((_, WatchdogTrip::Speed { .. }))));
}

#[test]
fn ages_gaps_and_forms() {
    let mut watchdog = Watchdog::new(limits());
    watchdog.start();
    let at = |z| [0.0, 0.0, z];
    let ms = |t: i64| HostTime(t * MS);
    assert_eq!(watchdog.check_poll(ms(5000)), Ok(())); // no sample yet
    assert_eq!(watchdog.check_sample(&sample(5001, at(-2.0), 0.0)), Ok(()));
    assert_eq!(watchdog.check_poll(ms(5101)), Ok(()));
    assert!(matches!(
        watchdog.check_poll(ms(5102)),
        Err(WatchdogTrip::Stale { .. })
    ));
    // Upward motion stays allowed, except with unreliable feedback.
    assert_eq!(watchdog.check_sample(&sample(5103, at(-2.0), 99.0)), Ok(()));
    assert_eq!(watchdog.check_poll(ms(5104)), Ok(()));
    assert!(matches!(
        watchdog.check_sample(&sample(5103, at(1.0), 0.0)),
        Err(WatchdogTrip::Feedback { .. })
    ));
    let mut bad = sample(5200, at(1.0), 0.0);
    bad.commanded = Point3::new(f64::NAN, 0.0, 0.0);
    assert!(matches!(
        watchdog.check_sample(&bad),
        Err(WatchdogTrip::Feedback { .. })
    ));
    assert_eq!(watchdog.last().map(|s| s.t), Some(ms(5103)));

    watchdog.start();
    assert_eq!(watchdog.check_sample(&sample(6000, at(-2.0), 0.0)), Ok(()));
    assert_eq!(watchdog.check_poll(ms(6000)), Ok(()));
    assert_eq!(watchdog.check_sample(&sample(7001, at(-2.0), 0.0)), Ok(()));
    assert!(matches!(
        watchdog.check_poll(ms(7001)),
        Err(WatchdogTrip::Late { .. })
    ));
    // At clearance height there is no danger.
    watchdog.start();
    assert_eq!(watchdog.check_sample(&sample(8000, at(5.0), 0.0)), Ok(()));
    assert_eq!(watchdog.check_poll(ms(8000)), Ok(()));
    assert_eq!(watchdog.check_sample(&sample(9900, at(5.0), 0.0)), Ok(()));
    assert_eq!(watchdog.check_poll(ms(9900)), Ok(()));
    // A sample from the future would never become stale.
    assert_eq!(
        watchdog.check_sample(&sample(9_999_999, at(5.0), 0.0)),
        Ok(())
    );
    assert!(matches!(
        watchdog.check_poll(ms(10_000)),
        Err(WatchdogTrip::Feedback { .. })
    ));
}

#[test]
fn too_deep_from_the_start_may_rise() {
    let rise = (0..60).map(|i| ([0.0, 0.0, -6.0 + 0.08 * f64::from(i)], 0.0));
    assert_eq!(trip_of(rise), None);
}

/// Every cause, in the middle of a press, with either reaction.
#[test]
fn every_cause_ends_the_press_within_two_ticks() {
    let causes = [
        (FeedbackFault::Force, "force: expected at most 8 N"),
        (FeedbackFault::Sink, "depth: expected at most 3.05 mm"),
        (FeedbackFault::Slide, "speed: expected at most 100 mm/s"),
        (
            FeedbackFault::Nan,
            "pose stream: expected finite coordinates",
        ),
        (FeedbackFault::Twice, "pose stream: expected a sample after"),
        (
            FeedbackFault::Silence,
            "pose stream: expected a pose sample no older",
        ),
        (
            FeedbackFault::Late,
            "loop: expected a poll of the robot at least every",
        ),
    ];
    for (strike, words) in causes {
        for on_trip in [TripReaction::Retract, TripReaction::Brake] {
            let case = format!("{strike:?}, {on_trip:?}");
            let mut plan = plan();
            plan.limits.on_trip = on_trip;
            let broken = Faults {
                strike: Some(strike),
                ..faults()
            };
            let result = run_plan(&plan, broken, START, Sink::default());
            let RunEnd::Faulted(causes) = &result.report.end else {
                panic!("{case}: {:?}", result.report);
            };
            let reason = causes.to_string();
            assert!(reason.starts_with(words), "{case}: {reason}");
            assert!(result.report.disarmed, "{case}");
            let verdicts = result.records.iter().filter_map(|r| match r {
                Record::Outcome(o) => {
                    Some((o.verdict.name(), o.verdict.reason().unwrap_or_default()))
                }
                _ => None,
            });
            let verdicts = verdicts.collect::<Vec<_>>();
            assert_eq!(verdicts.len(), 1, "{case}");
            assert!(
                verdicts[0].0 == "invalid"
                    && verdicts[0].1.starts_with(&format!("cut off: {words}")),
                "{case}: {verdicts:?}"
            );

            let w = lock(&result.world);
            let settings = ControllerSettings::default();
            let grace = if strike == FeedbackFault::Silence {
                settings.stale_after.0
            } else {
                0
            };
            let broken_at = w.broken_at.unwrap_or(i64::MAX).saturating_add(grace);
            let in_time = broken_at.saturating_add(2 * settings.tick.0);
            let within = |t: i64| t >= broken_at && t <= in_time;
            let blind = matches!(
                strike,
                FeedbackFault::Nan | FeedbackFault::Twice | FeedbackFault::Silence
            );
            let brakes = blind || on_trip == TripReaction::Brake;
            let first = w.robot_calls.iter().find(|(t, _)| *t >= broken_at);
            let expected = if brakes { "disarm" } else { "hold" };
            assert!(
                first.is_some_and(|(t, what)| within(*t) && *what == expected),
                "{case}: {first:?} after {broken_at}"
            );
            let after: Vec<_> = w
                .commands
                .iter()
                .filter(|(_, _, t)| *t >= broken_at)
                .collect();
            if brakes {
                assert!(after.is_empty(), "{case}: {after:?}");
            } else {
                let (target, _, t) = after[0];
                assert!(
                    within(*t) && (target[2] - 5.0).abs() < 1e-9,
                    "{case}: {after:?}"
                );
            }
        }
    }
}
