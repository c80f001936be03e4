//! A robot that was braked in contact rises first, straight up and no deeper, whatever its pose.

use skinrig_controller::{ControllerSettings, RunFault, WatchLimits, Watchdog, WatchdogTrip};
use skinrig_model::{HostTime, Point3, PoseSample, RunEnd};
use skinrig_protocol::plan::TripReaction;

use crate::course::{RunResult, faults, run_plan};
use crate::mock::*;

/// A run that starts with this tip position, on a robot that sinks this far when its brakes open.
fn from(start: [f64; 3], sinks_mm: f64, on_trip: TripReaction) -> RunResult {
    let mut plan = plan();
    plan.limits.on_trip = on_trip;
    let faults = Faults {
        sinks_mm,
        stiffness_n_mm: 0.1,
        ..faults()
    };
    run_plan(&plan, faults, start, Sink::default())
}

/// In contact, at the depth limit (3.05 mm with its tolerance), below it, away from the plan, and at the workspace's edge.
#[test]
fn a_braked_arm_in_contact_rises_before_anything_else() {
    let starts = [
        [10.0, 2.0, -2.0],
        [10.0, 2.0, -3.04],
        [10.0, 2.0, -3.06],
        [10.0, 2.0, -3.4],
        [55.0, 50.0, -3.04],
        [60.03, 2.0, -3.04],
        [-40.03, -50.02, -1.0],
    ];
    for start in starts {
        for on_trip in [TripReaction::Retract, TripReaction::Brake] {
            let result = from(start, 0.03, on_trip);
            let case = format!("{start:?} {on_trip:?}: {:?}", result.report.end);
            assert_eq!(result.report.end, RunEnd::Completed, "{case}");
            let w = lock(&result.world);
            let at_edge = start[0] > 60.0 || start[0] < -40.0;
            assert!(at_edge || w.violations.is_empty(), "{case}");
            let (first, ..) = w.commands[0];
            assert_eq!(first[2], LIMITS.clearance_mm, "straight up: {case}");
            let aside = libm::hypot(first[0] - start[0], first[1] - start[1]);
            assert!(aside <= LIMITS.position_tolerance_mm, "{case}");
        }
    }
}

/// Beyond the tolerance a tip in contact that sinks further still trips the watchdog.
#[test]
fn a_tip_that_sinks_below_its_start_trips() {
    for start_mm in [-3.04, -3.4] {
        let result = from([10.0, 2.0, start_mm], 0.08, TripReaction::Retract);
        let depth = |e: &RunFault| matches!(e, RunFault::Watchdog(WatchdogTrip::Depth { .. }));
        assert!(
            result.report.end.faults().iter().any(depth),
            "{:?}",
            result.report.end
        );
        assert!(result.report.retracted && result.report.disarmed);
    }
}

/// Once the tip was clear, the normal depth limit applies.
#[test]
fn the_slack_ends_at_clearance_height() {
    let mut watchdog = Watchdog::new(WatchLimits::of(&LIMITS, &ControllerSettings::default()));
    watchdog.start();
    let mut see = |s: i64, z_mm: f64| {
        let at = Point3::new(10.0, 2.0, z_mm);
        watchdog.check_sample(&PoseSample {
            t: HostTime(s * 1000 * MS),
            commanded: at,
            measured: at,
            force_n: 0.0,
        })
    };
    for (s, z_mm) in [(1, -3.4), (2, -3.44), (3, 4.0), (4, -3.44), (5, 5.0)] {
        assert_eq!(see(s, z_mm), Ok(()), "at {s} s");
    }
    let limit = match see(6, -3.06) {
        Err(WatchdogTrip::Depth { limit_mm, .. }) => limit_mm,
        other => panic!("{other:?}"),
    };
    assert_eq!(limit, 3.05);
}
