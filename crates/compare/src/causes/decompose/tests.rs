//! Tests of the decomposition: parts add up, and a single changed factor gets the whole change.

use super::*;

fn budget(rest: f64, per_event: f64, width2: f64, excess: f64, idle: f64) -> ErrorBudget {
    ErrorBudget {
        mse: rest,
        calibration: 0.0,
        robot: 0.0,
        scatter: rest,
        bias: 0.0,
        per_event: per_event.ln(),
        width2: width2.ln(),
        excess: excess.ln(),
        idle: idle.ln(),
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
