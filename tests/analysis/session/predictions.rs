//! Coverage of predictions: simulated sessions, each with combinations that it measures only to check what it predicted of them.

use std::ops::ControlFlow;

use skinrig_analysis::tradeoff::{Measured, Plan, Predicted, Prediction, Progress, measure};
use skinrig_planted::grid::{Shape, session_of};

/// Predictions that hold, by quantity.
#[derive(Debug, Clone, Copy, Default)]
struct Held {
    all: u32,
    rmse: u32,
    events: u32,
}

impl Held {
    fn add(&mut self, measured: &Measured, one: &Prediction) {
        let row = &measured.tradeoff.rows[one.row];
        let holds = |p: &Predicted, value| u32::from(p.contains(value));
        self.all += 1;
        self.rmse += holds(&one.rmse_mm, row.rmse_mm.value.expect("the row competes"));
        self.events += holds(&one.events_per_press, row.events_per_press);
    }
}

/// Held predictions of random combinations, and of those that the search picked, over sessions with these seeds.
fn held(seeds: std::ops::RangeInclusive<u64>) -> [Held; 2] {
    use rayon::prelude::*;
    let plan = Plan {
        full: false,
        checks: 5,
        repeats: 1,
        least_located: None,
    };
    let sessions: Vec<Measured> = seeds
        .into_par_iter()
        .map(|seed| {
            let (mut input, memory) = session_of(seed, &Shape::drawn(seed));
            input.settings.bootstrap_resamples = 0;
            input.settings.seed = seed;
            let mut on = |_: &Progress<'_>| ControlFlow::Continue(());
            measure(&input, &memory, plan, &mut || 0.0, &mut on)
                .expect("drawn sessions can be measured")
        })
        .collect();
    let mut counts = [Held::default(); 2];
    for measured in &sessions {
        for one in &measured.tradeoff.predictions.of {
            assert_eq!(one.cpu_us, None);
            counts[usize::from(!one.is_check)].add(measured, one);
        }
    }
    counts
}

#[test]
fn predictions_of_random_combinations_hold() {
    let [checks, picked] = held(1..=6);
    assert_eq!(checks.all, 30);
    assert!(checks.rmse >= 26 && checks.events >= 26, "{checks:?}");
    assert!(picked.all > 150, "{picked:?}");
}

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-analysis-tests -- --ignored --nocapture combinations_over_200_sessions"]
fn combinations_over_200_sessions() {
    let [checks, picked] = held(1001..=1200);
    println!("random combinations: {checks:?}\npicked by the search: {picked:?}");
    assert!(checks.all >= 500, "{checks:?}");
    assert!(
        f64::from(checks.rmse) >= 0.95 * f64::from(checks.all),
        "{checks:?}"
    );
    assert!(
        f64::from(checks.events) >= 0.95 * f64::from(checks.all),
        "{checks:?}"
    );
}
