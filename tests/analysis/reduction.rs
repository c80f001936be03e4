//! The data reduction and the data rates of a planted session.

#![expect(clippy::unwrap_used, reason = "tests")]

use skinrig_analysis::locator::FittedLocator;
use skinrig_analysis::reference_code::reference_code;
use skinrig_analysis::result::{Analysis, Estimate, ReductionRow, Thinning};
use skinrig_analysis::{Retention, SessionInput, analyze, analyze_with_events, reduction};
use skinrig_model::PressRole;

use skinrig_planted::Memory;
use skinrig_planted::grid::session;

/// The planted session with few resamples: 25 scored presses of some 600 events per camera.
fn small() -> (SessionInput, Memory) {
    let (mut input, source) = session();
    input.settings.reduction.max_power = 8;
    input.settings.reduction.seeds = 4;
    (input, source)
}

fn rows(analysis: &Analysis, thinning: Thinning) -> &[ReductionRow] {
    let curves = &analysis.reduction.as_ref().unwrap().curves;
    &curves.iter().find(|c| c.thinning == thinning).unwrap().rows
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * (a.abs() + b.abs())
}

#[test]
fn without_thinning_the_study_is_the_analysis() {
    let (input, source) = small();
    let a = analyze(&input, &source).unwrap();
    let study = a.reduction.as_ref().unwrap();
    assert_eq!((study.presses, study.seeds, study.min_samples), (25, 4, 10));
    let mut errors: Vec<f64> = a
        .presses
        .iter()
        .filter(|p| p.role == PressRole::Score)
        .map(|p| p.error_mm().map(|(dx, dy)| libm::hypot(dx, dy)).unwrap())
        .collect();
    errors.sort_by(f64::total_cmp);
    // Type 7 quantile of 25 values: position 22.8.
    let p95 = 0.2 * errors[22] + 0.8 * errors[23];
    assert!(near(study.pass_threshold_mm.unwrap(), p95));
    let mean_events = |k: usize| {
        let scored = a.presses.iter().filter(|p| p.role == PressRole::Score);
        scored
            .map(|p| f64::from(p.views[k].unwrap().events))
            .sum::<f64>()
            / 25.0
    };
    let rates = a.bit_rates.as_ref().unwrap();
    for thinning in [Thinning::Exact, Thinning::Bernoulli] {
        let row = rows(&a, thinning)[0];
        assert_eq!(row.factor, 1);
        // The same draws of the same presses: value and interval.
        for (of_study, of_analysis) in [
            (row.rmse_mm, a.scored.rmse_mm),
            (row.located_rate, a.scored.located_rate),
            (row.within_rate, a.scored.within_rate),
        ] {
            let numbers = |e: Estimate| [e.value, e.low, e.high].map(Option::unwrap);
            let pairs = numbers(of_study).into_iter().zip(numbers(of_analysis));
            assert!(pairs.into_iter().all(|(s, a)| near(s, a)), "{of_study:?}");
            assert_eq!(of_study.n, of_analysis.n);
        }
        assert!(near(row.pass_rate.value.unwrap(), 23.0 / 25.0));
        let (low, high) = row.rmse_of_seeds_mm.unwrap();
        assert!(low == high && near(low, row.rmse_mm.value.unwrap()));
        assert!(near(
            row.events_per_view,
            (mean_events(0) + mean_events(1)) / 2.0
        ));
        assert!(
            (row.press_bytes_per_s.value.unwrap() / rates.press_bytes_per_s.value.unwrap() - 1.0)
                .abs()
                < 1e-6
        );
        for rate in [row.press_bytes_per_s, row.idle_bytes_per_s] {
            let (low, value, high) = (rate.low.unwrap(), rate.value.unwrap(), rate.high.unwrap());
            assert!(low <= value && value <= high && rate.n > 0, "{rate:?}");
        }
        assert!(near(
            row.idle_bytes_per_s.value.unwrap(),
            rates.idle_bytes_per_s.value.unwrap()
        ));
    }
}

#[test]
fn thinning_costs_accuracy_then_places_and_never_makes_a_number_of_nothing() {
    let (input, source) = small();
    let a = analyze(&input, &source).unwrap();
    for thinning in [Thinning::Exact, Thinning::Bernoulli] {
        let rows = rows(&a, thinning);
        assert!(
            rows.iter()
                .zip(0..)
                .all(|(r, power)| r.factor == 1 << power)
        );
        let full = rows[0].events_per_view;
        for row in rows {
            let left = full / f64::from(row.factor);
            assert!(
                (row.events_per_view - left).abs() < 0.05 * left + 1.0,
                "{row:?}"
            );
            assert!(row.located_rate.value >= row.within_rate.value);
        }
        // 75 events on one place make a cluster of 10 or more, 2 do not.
        let (eighth, last) = (&rows[3], &rows[8]);
        assert_eq!(eighth.located_rate.value, Some(1.0));
        assert!(eighth.rmse_mm.value > rows[0].rmse_mm.value);
        let (low, high) = eighth.rmse_of_seeds_mm.unwrap();
        assert!(low < eighth.rmse_mm.value.unwrap() && eighth.rmse_mm.value.unwrap() < high);
        assert_eq!((last.rmse_mm.value, last.rmse_mm.n), (None, 0));
        assert_eq!(last.rmse_of_seeds_mm, None);
        for rate in [last.pass_rate, last.within_rate, last.located_rate] {
            assert_eq!((rate.value, rate.low, rate.n), (Some(0.0), Some(0.0), 25));
            // The exact bound of 0 in 25 locations, not certainty.
            assert!(near(
                rate.high.unwrap(),
                1.0 - libm::pow(0.025f64, 1.0 / 25.0)
            ));
        }
    }
}

#[test]
fn one_event_each_is_always_located_by_a_clustering_that_asks_for_one() {
    let (mut input, source) = small();
    input.settings.reduction.min_samples = 1;
    input.settings.reduction.max_power = 20;
    let a = analyze(&input, &source).unwrap();
    let (exact, bernoulli) = (
        rows(&a, Thinning::Exact)[20],
        rows(&a, Thinning::Bernoulli)[20],
    );
    assert_eq!(exact.events_per_view, 1.0);
    // Wherever two single events point to, there are two.
    assert!(exact.located_rate.value > Some(0.5));
    // Some 600 events kept with probability 2^-20: hardly ever one, and both cameras need one.
    assert!(bernoulli.events_per_view < 0.05);
    assert_eq!(bernoulli.located_rate.value, Some(0.0));
}

#[test]
fn a_rule_on_the_data_keeps_a_press_in_the_study_and_a_hand_does_not() {
    let (mut input, source) = small();
    let scored = || input.planned.iter().filter(|p| p.role == PressRole::Score);
    let by_hand = scored().take(2).map(|p| p.id).collect();
    input.settings.exclude_press_numbers = by_hand;
    // More cluster events than any press has: all are excluded, and all were done.
    input.settings.min_cluster_events = 100_000;
    let a = analyze(&input, &source).unwrap();
    assert_eq!(a.scored.rmse_mm.n, 0);
    let study = a.reduction.unwrap();
    assert_eq!(study.presses, 23);
    assert_eq!(study.curves[0].rows[0].located_rate.value, Some(1.0));
    input.settings.study_presses = 0;
    assert_eq!(analyze(&input, &source).unwrap().reduction, None);
}

#[test]
fn threads_do_not_matter_and_seeds_do() {
    let (input, source) = small();
    let (mut a, kept) = analyze_with_events(&input, &source, Retention::Scored).unwrap();
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build()
            .unwrap()
            .install(|| reduction::study(&a, &FittedLocator::of(&a).unwrap(), &kept))
    };
    let one = with_threads(1);
    assert_eq!(one, a.reduction);
    assert_eq!(one, with_threads(3));
    a.settings.seed = 2;
    let other = reduction::study(&a, &FittedLocator::of(&a).unwrap(), &kept).unwrap();
    let fourth = |r: &skinrig_analysis::result::Reduction| r.curves[0].rows[2].rmse_mm.value;
    assert_ne!(fourth(&one.unwrap()), fourth(&other));
}

#[test]
fn data_rates_are_means_over_the_presses_that_count() {
    let (input, source) = small();
    let a = analyze(&input, &source).unwrap();
    let rates = a.bit_rates.as_ref().unwrap();
    // 600 planted events in 0.45 s of touch and 0.1 s of slack about it, in both cameras, and the background.
    let press = rates.press_events_per_s;
    let background = 2.0 * 10_000.0 / 97.0 * 176.0 / 480.0;
    assert!(
        (press.value.unwrap() - 2.0 * 600.0 / 0.55 - background).abs() < 20.0,
        "{press:?}"
    );
    let idle = rates.idle_events_per_s;
    assert!((idle.value.unwrap() - background).abs() < 10.0, "{idle:?}");
    assert!(idle.low < idle.value && idle.value < idle.high);
    assert!(near(
        rates.press_bytes_per_s.value.unwrap(),
        press.value.unwrap() * 21.0 / 8.0
    ));
    assert!(near(
        rates.idle_bytes_per_s.low.unwrap(),
        idle.low.unwrap() * 21.0 / 8.0
    ));
    assert_eq!((press.n, idle.n), (25, 25));
    assert!((rates.press_s.value.unwrap() - 0.45).abs() < 1e-9);
}

#[test]
fn the_published_rule_scores_the_first_repetition_and_ignores_missing_presses() {
    let (mut input, source) = small();
    input.settings.centroid = skinrig_model::CentroidRule::AllClusters;
    // What it calibrates on is then what this session calibrates on.
    input.settings.calibration = skinrig_model::CalibrationModel::Full;
    let (a, kept) = analyze_with_events(&input, &source, Retention::All).unwrap();
    let r = reference_code(&input, &a, &kept);
    assert_eq!((r.presses, r.with_centroids, r.inside), (25, 25, 25));
    assert!(r.calibrated);
    let first = a.presses.iter().filter(|p| p.role == PressRole::Calibrate);
    let errors: Vec<(f64, f64)> = first.map(|p| p.error_mm().unwrap()).collect();
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| errors.iter().map(of).sum::<f64>() / 25.0;
    let (xx, yy) = (mean(&|e| e.0 * e.0), mean(&|e| e.1 * e.1));
    assert!(near(r.rmse_x_mm.unwrap(), xx.sqrt()) && near(r.rmse_y_mm.unwrap(), yy.sqrt()));
    assert!(near(r.rmse_mm.unwrap(), (xx + yy).sqrt()));
    // E[d²] = mean² + population variance.
    let length = mean(&|e| libm::hypot(e.0, e.1));
    let spread = r.std_of_errors_mm.unwrap();
    assert!((spread * spread + length * length - xx - yy).abs() < 1e-9);
    assert!(
        r.reduction
            .iter()
            .zip(0..=8)
            .all(|(row, power)| row.factor == 1 << power)
    );
    for row in &r.reduction {
        // One event makes a centroid: two of them always point somewhere, if only outside the square.
        assert!(row.rmse_mm.is_some_and(f64::is_finite));
        assert!(row.honest_pass_rate <= row.pass_rate);
    }
    // 23 of 25 lie below their own 95th percentile.
    assert!(near(r.reduction[0].pass_rate, 23.0 / 25.0));
    // Kept for the scored repetition alone there is nothing to thin.
    let (_, scored) = analyze_with_events(&input, &source, Retention::Scored).unwrap();
    assert_eq!(reference_code(&input, &a, &scored).reduction, []);
    // Presses left out by hand are not judged, those that a schedule does not use are not there at all.
    input.settings.exclude_press_numbers = vec![a.presses[3].press];
    if let Some(outcome) = &mut input.outcomes[4] {
        outcome.verdict =
            skinrig_model::PressVerdict::Excluded(skinrig_model::ExcludedReason::NotUsed {
                presses_used: "[5]".to_owned(),
            });
    }
    let (a, kept) = analyze_with_events(&input, &source, Retention::All).unwrap();
    let r = reference_code(&input, &a, &kept);
    assert_eq!((r.presses, r.inside), (23, 23));
    assert!(near(r.reduction[0].pass_rate, 22.0 / 24.0));
}
