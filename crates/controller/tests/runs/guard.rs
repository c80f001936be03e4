//! Arbitrary commands: no forbidden motion reaches the robot, and every allowed one does.

use proptest::prelude::*;
use skinrig_controller::{ControllerSettings, GuardError, GuardedIndenter, RunFault, WatchdogTrip};
use skinrig_model::{HostDuration, HostTime, Point2, Point3, SkinOutline};
use skinrig_protocol::area::{Area, KeepOut, Surroundings};

use crate::mock::*;

#[derive(Debug, Clone)]
enum Act {
    Command([f64; 3], f64),
    /// Rig time passes, ms, and the pose stream is read.
    Look(i64),
    /// Rig time passes, ms, without polling.
    Blind(i64),
    Hold,
    Arm,
    Disarm,
}

/// A post of 4 mm about (30, 0), 10 mm high, with a margin of 1 mm.
fn around() -> Surroundings {
    Surroundings {
        keep_outs: vec![KeepOut {
            name: "post".into(),
            area: Area::Circle {
                centre: Point2::new(30.0, 0.0),
                radius_mm: 4.0,
            },
            margin_mm: 1.0,
            height_mm: Some(10.0),
        }],
        ..Surroundings::of(SkinOutline::PAPER)
    }
}

/// A robot at (0, 0, 10), and its guard.
fn guarded() -> (Shared, GuardedIndenter<'static>) {
    let world = World::shared(Faults::default(), [0.0, 0.0, 10.0]);
    let robot = Box::new(MockIndenter(world.clone()));
    let settings = ControllerSettings::default();
    let guard = GuardedIndenter::new(robot, robot_from_skin(), LIMITS, &settings);
    (world, guard)
}

/// Whether the surroundings allow a motion, checked independently by points on its path.
fn allows(from: [f64; 3], to: [f64; 3]) -> bool {
    let sideways = libm::hypot(from[0] - to[0], from[1] - to[1]);
    if sideways <= 0.05 && to[2] - from[2] >= sideways {
        return true;
    }
    if to[2] < 4.95 && SkinOutline::PAPER.clearance_mm(Point2::new(to[0], to[1])) < -0.05 {
        return false;
    }
    let free = (0..=4000).all(|i| {
        let s = f64::from(i) / 4000.0;
        let at = |k: usize| from[k] + s * (to[k] - from[k]);
        libm::hypot(at(0) - 30.0, at(1)) > 4.95
    });
    free || from[2].min(to[2]) >= 10.95
}

fn number(low: f64, high: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => low..high,
        2 => prop::sample::select(vec![0.0, 5.0, 4.9, -2.0, -3.0, -3.001, 10.0]),
        1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300]),
    ]
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        6 => (number(-60.0, 80.0), number(-60.0, 60.0), number(-5.0, 45.0), number(-20.0, 130.0))
            .prop_map(|(x, y, z, v)| Act::Command([x, y, z], v)),
        // Straight up and down, as a press does.
        4 => (number(-4.0, 8.0), 1.0..100.0).prop_map(|(z, v)| Act::Command([f64::MAX, f64::MAX, z], v)),
        6 => (1i64..400).prop_map(Act::Look),
        1 => (1i64..300).prop_map(Act::Blind),
        1 => Just(Act::Hold),
        2 => Just(Act::Arm),
        1 => Just(Act::Disarm),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn nothing_forbidden_reaches_the_robot(acts in prop::collection::vec(act(), 1..80)) {
        let (world, guard) = guarded();
        let mut guard = guard.with_surroundings(Some(around()));
        let mut poses = Vec::new();
        // Time since the pose stream was last read, and the lowest reported height.
        let (mut unseen, mut lowest_mm) = (0, f64::INFINITY);
        // Where the tip went down below clearance height.
        let mut foot: Option<[f64; 2]> = None;
        guard.arm().map_err(|e| TestCaseError::fail(e.to_string()))?;
        for act in acts {
            match act {
                Act::Command(mut target, speed) => {
                    let (now, tip, commands_before) = {
                        let w = lock(&world);
                        (w.t, w.tip, w.commands.len())
                    };
                    let last = guard.position();
                    if target[0] == f64::MAX {
                        let place = last.map_or(tip, |p| p.measured.to_array());
                        (target[0], target[1]) = (place[0], place[1]);
                    }
                    let [x, y, z] = target;
                    let answer = guard.command(Point3::new(x, y, z), speed, HostTime(now));
                    let w = lock(&world);
                    let fresh = last.is_some_and(|p| now - p.t.0 <= 100 * MS);
                    let sideways = last.is_none_or(|p| {
                        let [a, b, c] = p.measured.to_array();
                        let aside = libm::hypot(x - a, y - b);
                        let steep = aside <= 0.05 && z - c >= aside;
                        let off = foot.map_or(0.0, |[u, v]| libm::hypot(x - u, y - v));
                        (aside > 0.05 || (!steep && off > 0.05)) && z.min(c) < 4.95
                    });
                    let allowed = [x, y, z, speed].iter().all(|v| v.is_finite())
                        && speed > 0.0 && speed <= 100.0
                        && (-40.0..=60.0).contains(&x) && (-50.0..=55.0).contains(&y)
                        && (-3.0..=40.0).contains(&z)
                        && fresh && guard.is_armed() && !sideways
                        && last.is_none_or(|p| allows(p.measured.to_array(), [x, y, z]));
                    prop_assert_eq!(answer.is_ok(), allowed, "{:?} at {} -> {:?}", target, speed, answer);
                    prop_assert_eq!(w.commands.len() - commands_before, usize::from(allowed));
                    if allowed && z < 4.95 {
                        foot.get_or_insert([x, y]);
                    } else if allowed && last.is_some_and(|p| p.measured.z_mm >= 4.95) {
                        foot = None;
                    }
                }
                Act::Look(ms) => {
                    lock(&world).t += ms * MS;
                    let observed = guard.poll(&MockClock(world.clone()), &mut poses);
                    let gap = HostDuration(unseen + ms * MS);
                    unseen = 0;
                    lowest_mm = poses.iter().map(|p| p.measured.z_mm).fold(lowest_mm, f64::min);
                    if let Err(why) = observed {
                        // Only this is a fault here: too long between polls while the tip may have been low.
                        let is_late = matches!(
                            why,
                            RunFault::Watchdog(WatchdogTrip::Late { found, .. }) if found == gap
                        );
                        let limit = ControllerSettings::default().late_after;
                        prop_assert!(is_late && gap > limit && lowest_mm < 4.95, "{gap}: {why}");
                        return Ok(());
                    }
                }
                Act::Blind(ms) => {
                    unseen += ms * MS;
                    lock(&world).t += ms * MS;
                }
                Act::Hold => prop_assert!(guard.hold().is_ok()),
                Act::Arm => prop_assert!(guard.arm().is_ok()),
                Act::Disarm => prop_assert!(guard.disarm().is_ok()),
            }
        }
        prop_assert!(poses.is_sorted_by(|a, b| a.t < b.t));
    }
}

#[test]
fn rejections_state_the_limit() {
    let (world, mut guard) = guarded();
    let mut poses = Vec::new();
    assert!(guard.arm().is_ok());
    lock(&world).t = 50 * MS;
    assert!(guard.poll(&MockClock(world.clone()), &mut poses).is_ok() && poses.len() == 50);
    let mut ask = |x, y, z, speed, ms: i64| {
        let answer = guard.command(Point3::new(x, y, z), speed, HostTime(ms * MS));
        match answer {
            Err(RunFault::Guard(e)) => e.to_string(),
            other => format!("{other:?}"),
        }
    };
    let messages = [
        ask(0.0, 0.0, -2.0, 200.0, 60),
        ask(0.0, 99.0, 10.0, 20.0, 60),
        ask(1.0, 0.0, 2.0, 20.0, 60),
        ask(0.0, 0.0, 6.0, 20.0, 200),
        ask(f64::NAN, 0.0, 6.0, 20.0, 60),
    ];
    assert_eq!(
        messages,
        [
            "expected a speed above 0 and at most 100 mm/s, found 200 mm/s",
            "expected a target with y from -50 to 55 mm, found 99 mm",
            "expected lateral motion only at 5 mm or higher, found 1.000 mm sideways at 2.000 mm",
            "expected a pose sample no older than 0.100000 s, found 0.150000 s",
            "expected finite coordinates and speed, found [NaN, 0.0, 6.0] at 20 mm/s",
        ]
    );
    let deep = GuardError::Depth {
        limit_mm: 3.0,
        found_mm: 3.5,
    };
    assert_eq!(
        deep.to_string(),
        "expected a depth of at most 3 mm, found 3.5 mm"
    );
    assert!(lock(&world).commands.is_empty());
}

/// Below clearance height the tip moves only vertically where it went down, however small the lateral steps are.
#[test]
fn many_small_lateral_steps_count_as_one_large_step() {
    let (world, mut guard) = guarded();
    let mut poses = Vec::new();
    assert!(guard.arm().is_ok());
    let mut go = |x: f64, z: f64| {
        lock(&world).t += 50 * MS;
        assert!(guard.poll(&MockClock(world.clone()), &mut poses).is_ok());
        let now = HostTime(lock(&world).t);
        let answer = guard.command(Point3::new(x, 0.0, z), 50.0, now);
        for _ in 0..10 {
            lock(&world).t += 50 * MS;
            assert!(guard.poll(&MockClock(world.clone()), &mut poses).is_ok());
        }
        answer
    };
    assert!(go(0.0, -1.0).is_ok());
    assert!(go(0.04, -1.0).is_ok());
    for z in [-1.0, -0.97, -1.5] {
        let refused = go(0.08, z);
        assert!(
            matches!(&refused, Err(RunFault::Guard(GuardError::Lateral { .. }))),
            "{z}: {refused:?}"
        );
    }
    // Up, along and down again is another location.
    assert!(go(0.04, 6.0).is_ok() && go(5.0, 6.0).is_ok() && go(5.0, -1.0).is_ok());
}
