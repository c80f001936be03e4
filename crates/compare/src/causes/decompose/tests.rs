//! Tests of the decomposition: parts add up, and a single changed factor gets the whole change.

use super::*;

fn budget(rest: f64, per_event: f64, width2: f64, excess: f64, idle: f64) -> ErrorBudget {
    ErrorBudget {
        mse: rest,
        calibration: 0.0,
        robot: 0.0,
        scatter: rest,
        bias: 0.0,
        per_event: libm::log(per_event),
        width2: libm::log(width2),
        excess: libm::log(excess),
        idle: libm::log(idle),
    }
}

#[test]
fn parts_add_up_and_one_changed_factor_carries_all() {
    let a = budget(1.0, 1e-3, 100.0, 1.5, 2_000.0);
    // A quarter of the events, so noise inflates the clusters more.
    let parts = split_change(&[a, budget(4.0, 4e-3, 100.0, 1.5, 2_000.0)]);
    assert!(
        (parts[3] - 3.0).abs() < 1e-12 && parts[6].abs() < 1e-12,
        "{parts:?}"
    );
    let parts = split_change(&[a, budget(6.0, 4e-3, 100.0, 2.25, 2_000.0)]);
    assert!((parts[3] - 5.0).abs() < 1e-12, "{parts:?}");
    // Five times the noise.
    let parts = split_change(&[a, budget(3.0, 1e-3, 100.0, 4.5, 10_000.0)]);
    assert!((parts[4] - 2.0).abs() < 1e-12, "{parts:?}");
    // Twice as wide: attributed to width up to the square of its own effect, not beyond.
    let parts = split_change(&[a, budget(5.0, 1e-3, 400.0, 1.5, 2_000.0)]);
    assert!((parts[5] - 4.0).abs() < 1e-12, "{parts:?}");
    let parts = split_change(&[a, budget(40.0, 1e-3, 400.0, 1.5, 2_000.0)]);
    assert!(parts[5] > 25.0 && parts[6] > 5.0, "{parts:?}");
    assert!((parts.iter().sum::<f64>() - 39.0).abs() < 1e-12);
}

#[test]
fn what_was_not_measured_carries_nothing() {
    let a = budget(1.0, 1e-3, f64::NAN, f64::NAN, 2_000.0);
    let parts = split_change(&[a, budget(2.0, 1e-3, 100.0, 1.0, 2_000.0)]);
    assert!((parts[6] - 1.0).abs() < 1e-12, "{parts:?}");
    let parts = split_change(&[budget(-0.1, 1e-3, 1.0, 1.0, 1.0), a]);
    assert!((parts[6] - 1.1).abs() < 1e-12, "{parts:?}");
}

#[test]
fn draws_are_seeded_and_within_range() {
    let all: Vec<Vec<usize>> = draws(5, 100, 3).collect();
    assert_eq!(all, draws(5, 100, 3).collect::<Vec<_>>());
    assert_ne!(all, draws(5, 100, 4).collect::<Vec<_>>());
    let mut counts = [0; 5];
    all.iter().flatten().for_each(|i| counts[*i] += 1);
    assert!(counts.iter().all(|n| *n > 60), "{counts:?}");
}

/// A press along x with these errors and this offset from plan, mm.
fn press(fitted: f64, used: f64, off_plan: f64) -> PressFactors {
    PressFactors {
        used: [used, 0.0],
        fitted: [fitted, 0.0],
        off_plan: [off_plan, 0.0],
        per_event: 1e-3,
        width2: 100.0,
        cluster: 0.2,
        idle_per_s: 2_000.0,
    }
}

/// Two locations with these presses: fitted error and offset from plan. The used error is the fitted one times `used`.
fn skin(presses: [[(f64, f64); 2]; 2], used: f64, calibration_cost: f64) -> SkinPresses {
    let at = |presses: [(f64, f64); 2]| presses.map(|(e, off)| press(e, used * e, off)).to_vec();
    let [first, second] = presses.map(at);
    SkinPresses::new([(3, first), (8, second)].into(), calibration_cost)
}

fn assert_near(found: [f64; 5], expected: [f64; 5]) {
    let near = found
        .iter()
        .zip(expected)
        .all(|(f, e)| (f - e).abs() < 1e-12);
    assert!(near, "{found:?}, not {expected:?}");
}

fn parts(of: &ErrorBudget) -> [f64; 5] {
    [of.mse, of.calibration, of.robot, of.scatter, of.bias]
}

#[test]
fn a_budget_has_the_parts_that_it_was_made_of() {
    // Means 1.1 and -0.9; within a location +-0.1, so a variance of 0.02. The fitted errors have a mean square of 1.02, the used ones
    // twice that, of which half of the scatter is the fit's.
    let scattered = [[(1.0, 0.0), (1.2, 0.0)], [(-1.0, 0.0), (-0.8, 0.0)]];
    let found = error_budget(&skin(scattered, 2f64.sqrt(), 0.5), &[0, 1]);
    assert_near(parts(&found), [2.04, 1.01, 0.0, 0.03, 1.0]);
    assert!((found.excess - libm::log(2f64)).abs() < 1e-12);
    // A robot that is off by +-0.3 mm, which the errors follow in the opposite direction.
    let robot = [[(0.7, 0.3), (1.3, -0.3)], [(-1.3, 0.3), (-0.7, -0.3)]];
    let found = error_budget(&skin(robot, 1.0, 0.0), &[0, 1]);
    assert_near(parts(&found), [1.09, 0.0, 0.09, 0.0, 1.0]);
    // Errors that follow it in the same direction do so by chance.
    let chance = robot.map(|at| at.map(|(e, off)| (e, -off)));
    let found = error_budget(&skin(chance, 1.0, 0.0), &[0, 1]);
    assert_near(parts(&found), [1.09, 0.0, 0.0, 0.18, 0.91]);
}

#[test]
fn contributions_average_the_settings_and_give_them_the_rest() {
    let a = skin([[(1.0, 0.0); 2], [(-1.0, 0.0); 2]], 1.0, 0.0);
    let worse = skin([[(1.0, 0.0); 2], [(-1.0, 0.0); 2]], 3f64.sqrt(), 0.0);
    // Settings of A: both skins are alike. Settings of B: the calibration of the second adds 2 mm².
    let alone = contributions(&[[a.clone(), worse.clone()]], &[0, 1]);
    assert_eq!((alone.mse[0], alone.by_factor[0]), (1.0, 0.0));
    assert!((alone.mse[1] - 3.0).abs() < 1e-12 && (alone.change - 2.0).abs() < 1e-12);
    assert!((alone.by_factor[1] - 2.0).abs() < 1e-12, "{alone:?}");
    let both = contributions(&[[a.clone(), a.clone()], [a, worse]], &[0, 1]);
    assert!((both.change - 2.0).abs() < 1e-12, "{both:?}");
    assert!((both.by_factor[1] - 1.0).abs() < 1e-12, "{both:?}");
    assert!((both.by_factor[0] - 1.0).abs() < 1e-12, "{both:?}");
}
