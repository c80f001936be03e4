//! Properties of the fronts, of the selection, and of the choices to try.

use proptest::prelude::*;
use skinrig_model::{CalibrationModel, Locator};

use super::*;
use crate::result::Estimate;

pub(super) fn row(rmse: Option<f64>, cost: f64, located: f64) -> Row {
    let estimate = |value: Option<f64>| Estimate {
        value,
        low: value.map(|v| 0.9 * v),
        high: value.map(|v| 1.1 * v),
        n: 20,
    };
    Row {
        choice: Choice::of(&AnalysisSettings::default()),
        rows: [(185, 360), (200, 355)],
        overrides: Vec::new(),
        rmse_mm: estimate(rmse),
        penalised_rmse_mm: estimate(rmse),
        located_rate: estimate(Some(located)),
        within_rate: estimate(Some(located)),
        events_per_press: cost,
        bytes_per_s: cost,
        delay_ms: 100.0,
        pixels: 640 * 176,
        cpu_us: cost,
        cpu_range_us: (cost, cost),
        competes: false,
        fronts: Vec::new(),
    }
}

pub(super) fn tradeoff(rows: Vec<Row>) -> Tradeoff {
    let mut result = Tradeoff {
        locator: Locator::Geometry,
        settings: AnalysisSettings::default(),
        model: CalibrationModel::Full,
        calibrating: (20, 20),
        scored: (20, 20),
        least_located: 0.9,
        timed_presses: 20,
        repeats: 1,
        press_s: 0.5,
        rows,
        predictions: Predictions::default(),
        is_interrupted: false,
    };
    front::mark_fronts(&mut result);
    result
}

/// Few distinct numbers, so that many are equal.
fn rows() -> impl Strategy<Value = Vec<Row>> {
    let one = (proptest::option::weighted(0.9, 1u8..8), 1u8..8, 0u8..=10);
    proptest::collection::vec(one, 0..30).prop_map(|all| {
        let row_of = |(e, c, l): (Option<u8>, u8, u8)| {
            row(e.map(f64::from), f64::from(c), f64::from(l) / 10.0)
        };
        all.into_iter().map(row_of).collect()
    })
}

proptest! {
    #[test]
    fn the_front_is_the_set_of_undominated_points(rows in rows()) {
        let result = tradeoff(rows);
        let values = |r: &Row| (r.rmse_mm.value.unwrap_or(f64::INFINITY), r.cpu_us);
        for one in &result.rows {
            let (e, c) = values(one);
            let dominated = result.rows.iter().filter(|r| r.competes).any(|other| {
                let (f, d) = values(other);
                f <= e && d <= c && (f < e || d < c)
            });
            prop_assert_eq!(one.fronts.contains(&Cost::Cpu), one.competes && !dominated);
            let expected = one.rmse_mm.value.is_some() && one.located_rate.value.unwrap() >= 0.9;
            prop_assert_eq!(one.competes, expected);
        }
    }

    #[test]
    fn the_selection_meets_the_demand_and_is_optimal(
        rows in rows(),
        target in 0.5..9.0f64,
        budget in 0.5..9.0f64,
    ) {
        let measured = proportional(tradeoff(rows));
        let all = &measured.tradeoff.rows;
        // Errors at all locations are proportional to the RMSE, and so are the ends of intervals.
        let error = |r: &Row| r.rmse_mm.value.unwrap();
        if let Ok(found) = measured.select(Requirement::Target(target, Cost::Cpu)) {
            let factor = found.confirmed_mm.high.unwrap() / error(found.row);
            prop_assert!(found.row.competes && found.confirmed_mm.high.unwrap() <= target);
            let meets = |r: &&Row| r.competes && factor * error(r) <= target - 1e-9;
            prop_assert!(all.iter().filter(meets).all(|r| r.cpu_us >= found.row.cpu_us));
        }
        let fits = |r: &&Row| r.competes && r.cpu_us <= budget;
        match measured.select(Requirement::Budget(budget, Cost::Cpu)) {
            Err(_) => prop_assert!(!all.iter().any(|r| fits(&r))),
            Ok(found) => {
                prop_assert!(fits(&found.row));
                prop_assert!(all.iter().filter(fits).all(|r| error(r) >= error(found.row)));
                prop_assert!(found.row.fronts.contains(&Cost::Cpu), "the best within a budget is on the front");
            }
        }
    }
}

/// Errors at 12 locations for every row.
fn proportional(tradeoff: Tradeoff) -> Measured {
    let errors = |row: &Row| {
        let each = row.rmse_mm.value.into_iter();
        each.flat_map(|e| (0..12u32).map(move |l| (l, e * (0.9 + 0.1 * f64::from(l % 3)))))
            .collect()
    };
    Measured {
        errors: tradeoff.rows.iter().map(errors).collect(),
        tradeoff,
    }
}

#[test]
fn too_few_locations_or_resamples_select_nothing() {
    let target = Requirement::Target(5.0, Cost::Cpu);
    let one = || tradeoff(vec![row(Some(1.0), 1.0, 1.0)]);
    let mut unsure = proportional(one());
    assert!(unsure.select(target).is_ok());
    unsure.tradeoff.settings.bootstrap_resamples = 0;
    assert!(matches!(unsure.select(target), Err(Unselected::Target(_))));
    let mut few = proportional(one());
    few.errors[0].truncate(8);
    assert_eq!(few.select(target), Err(Unselected::Locations(8)));
    few.errors[0].clear();
    assert_eq!(few.select(target), Err(Unselected::Locations(0)));
}

#[test]
fn a_sweep_starts_at_the_session_settings_without_repeats() {
    let session = Choice::of(&AnalysisSettings::default());
    let (some, all) = (choice::curves(session), choice::all(session));
    assert_eq!((some[0], all[0]), (session, session));
    assert_eq!(some.len(), 28 + 4 * 8);
    assert_eq!(all.len(), 7 * 11 * 5 * 6 * 3);
    assert!(some.iter().all(|choice| all.contains(choice)));
}

#[test]
fn overrides_list_only_the_differences() {
    let session = AnalysisSettings::default();
    let choice = Choice {
        thinning: 8,
        window_ms: Some(50.0),
        ..Choice::of(&session)
    };
    let rows = [(200, 280), (200, 355)];
    let settings = choice.settings(&session, rows, CalibrationModel::Full, Locator::Field);
    let lines: Vec<String> = choice::overrides(&session, &settings)
        .into_iter()
        .map(|(key, value)| format!("{key}={value}"))
        .collect();
    assert_eq!(
        lines,
        [
            "analysis.thinning=8",
            "analysis.window_after_contact=50 ms",
            "analysis.crop.camera1=[200 px, 280 px]",
            "analysis.calibration=full",
            "analysis.locator=field",
        ]
    );
    let cut = AnalysisSettings {
        window_after_contact_ms: Some(50.0),
        ..session
    };
    let whole = Choice {
        window_ms: None,
        ..Choice::of(&cut)
    };
    let settings = whole.settings(&cut, cut.crop_v, cut.calibration, cut.locator);
    assert_eq!(
        choice::overrides(&cut, &settings),
        [(
            "analysis.window_after_contact".to_owned(),
            "60000 ms".to_owned()
        )]
    );
}
