//! Every row of a tradeoff is what an analysis with its settings says, to the last bit.

use std::ops::ControlFlow;

use skinrig_analysis::tradeoff::{Choice, Cost, Plan, Progress, Requirement, measure};
use skinrig_analysis::{SessionInput, analyze};
use skinrig_model::{AnalysisSettings, CalibrationModel};

use skinrig_planted::Memory;
use skinrig_planted::grid::session;

const PLAN: Plan = Plan {
    full: false,
    checks: 0,
    repeats: 3,
    least_located: None,
};

/// Goes on to the end.
fn on(_: &Progress<'_>) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// A stopwatch whose every measurement lasts one second longer than the one before.
fn ticking() -> impl FnMut() -> f64 {
    let (mut now, mut calls) = (0.0, 0.0);
    move || {
        now += calls;
        calls += 1.0;
        now
    }
}

fn with_settings(input: &SessionInput, settings: AnalysisSettings) -> SessionInput {
    SessionInput {
        settings,
        ..input.clone()
    }
}

#[test]
fn each_row_equals_an_analysis_with_its_settings() {
    let (mut input, memory) = session();
    input.settings.bootstrap_resamples = 50;
    let result = measure(&input, &memory, PLAN, &mut ticking(), &mut on)
        .unwrap()
        .tradeoff;
    assert_eq!((result.calibrating, result.scored), ((25, 25), (25, 25)));
    assert_eq!(result.rows[0].choice, Choice::of(&input.settings));
    assert_ne!(result.model, CalibrationModel::Auto);
    for (i, row) in result.rows.iter().enumerate() {
        // One of each kind of change, and some combinations.
        if i % 9 != 0 && i > 20 {
            continue;
        }
        let settings = row
            .choice
            .settings(&input.settings, row.rows, result.model, result.locator);
        let other = Memory {
            events: memory.events.clone(),
            slice: 77 + i,
        };
        let analysis = analyze(&with_settings(&input, settings), &other).unwrap();
        assert_eq!(analysis.scored.rmse_mm, row.rmse_mm, "{:?}", row.choice);
        assert_eq!(
            analysis.scored.located_rate, row.located_rate,
            "{:?}",
            row.choice
        );
        assert_eq!(
            analysis.scored.within_rate, row.within_rate,
            "{:?}",
            row.choice
        );
        assert_eq!(
            analysis.penalised.rmse_mm, row.penalised_rmse_mm,
            "{:?}",
            row.choice
        );
    }
}

#[test]
fn results_do_not_depend_on_times_and_costs_follow_the_choice() {
    let (mut input, memory) = session();
    input.settings.bootstrap_resamples = 20;
    let mut still = || 0.0;
    let measured = measure(&input, &memory, PLAN, &mut ticking(), &mut on).unwrap();
    let one = &measured.tradeoff;
    let two = measure(&input, &memory, PLAN, &mut still, &mut on)
        .unwrap()
        .tradeoff;
    for (a, b) in one.rows.iter().zip(&two.rows) {
        assert_eq!(
            (a.choice, a.rmse_mm, a.bytes_per_s),
            (b.choice, b.rmse_mm, b.bytes_per_s)
        );
        assert!(a.cpu_us > 0.0 && b.cpu_us == 0.0);
        assert!(a.cpu_range_us.0 <= a.cpu_us && a.cpu_us <= a.cpu_range_us.1);
    }
    let own = &one.rows[0];
    let find = |change: fn(&mut Choice)| {
        let mut expected = own.choice;
        change(&mut expected);
        one.rows.iter().find(|r| r.choice == expected).unwrap()
    };
    // 0.45 s between contact and release, 50 ms after it.
    assert!((own.delay_ms - 500.0).abs() < 0.1, "{}", own.delay_ms);
    let short = find(|c| c.window_ms = Some(50.0));
    assert!((short.delay_ms - 50.0).abs() < 0.1, "{}", short.delay_ms);
    assert!(short.bytes_per_s < 0.5 * own.bytes_per_s);
    let thin = find(|c| c.thinning = 8);
    assert!((thin.bytes_per_s * 8.0 / own.bytes_per_s - 1.0).abs() < 0.05);
    // The rows of 16 px bins are 4 bits shorter in each direction.
    let coarse = find(|c| c.bin_px = 16);
    assert!((coarse.bytes_per_s / own.bytes_per_s - 13.0 / 21.0).abs() < 1e-9);
    let rows = coarse.rows.map(|(first, last)| u32::from(last - first) + 1);
    assert_eq!(coarse.pixels, 40 * rows[0].max(rows[1]).div_ceil(16));
    let grids = one.rows.iter().filter(|r| {
        let other = Choice {
            bin_px: own.choice.bin_px,
            region: own.choice.region,
            ..r.choice
        };
        other == own.choice
    });
    assert_eq!(grids.count(), 15, "five bins by three parts of the rows");
    let few = Requirement::Budget(f64::from(coarse.pixels), Cost::Pixels);
    let found = measured.select(few).unwrap().row;
    assert!(found.pixels <= coarse.pixels && found.competes);
    // So few events are left that nothing can be located: that is a failure, not an absence.
    let thinned_away = find(|c| c.thinning = 1024);
    assert_eq!(
        (
            thinned_away.located_rate.value,
            thinned_away.located_rate.n,
            thinned_away.competes
        ),
        (Some(0.0), 25, false)
    );
    assert_eq!(thinned_away.rmse_mm.value, None);
    assert!(one.rows.iter().any(|r| r.fronts.contains(&Cost::Bytes)));
    let within_own = Requirement::Budget(own.delay_ms, Cost::Delay);
    let found = measured.select(within_own).unwrap();
    assert!(found.row.delay_ms <= own.delay_ms && found.row.competes);
    // Of 25 locations 8 choose.
    assert_eq!(found.confirmed_mm.n, 17);
}

#[test]
fn a_session_without_clocks_has_nothing_to_compare() {
    let (mut input, memory) = session();
    input.marks.clear();
    input
        .outcomes
        .iter_mut()
        .flatten()
        .for_each(|o| o.timing = None);
    let error = measure(&input, &memory, PLAN, &mut || 0.0, &mut on).unwrap_err();
    assert!(error.to_string().contains("INVALID"), "{error}");
}

#[test]
fn an_interrupted_measurement_keeps_what_it_measured() {
    let (mut input, memory) = session();
    input.settings.bootstrap_resamples = 50;
    let mut best = Vec::new();
    let mut watch = |progress: &Progress<'_>| {
        best.push(progress.best.and_then(|row| row.rmse_mm.value).unwrap());
        if progress.measured < 12 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    };
    let measured = measure(&input, &memory, PLAN, &mut ticking(), &mut watch).unwrap();
    let rows = &measured.tradeoff.rows;
    assert!(measured.tradeoff.is_interrupted && rows.len() == 12);
    assert!(
        best.len() == 12 && best.is_sorted_by(|a, b| a >= b),
        "{best:?}"
    );
    let competing = rows.iter().filter(|r| r.competes);
    let least = competing
        .filter_map(|r| r.rmse_mm.value)
        .fold(f64::MAX, f64::min);
    assert_eq!(best.last(), Some(&least));
    assert!(rows.iter().all(|r| r.cpu_us > 0.0) && measured.tradeoff.predictions.of.is_empty());
    assert!(
        measured
            .select(Requirement::Budget(1e12, Cost::Cpu))
            .is_ok()
    );
    let whole = measure(&input, &memory, PLAN, &mut ticking(), &mut on).unwrap();
    assert!(!whole.tradeoff.is_interrupted);
    for (part, whole) in rows.iter().zip(&whole.tradeoff.rows) {
        assert_eq!((part.choice, part.rmse_mm), (whole.choice, whole.rmse_mm));
    }
}
