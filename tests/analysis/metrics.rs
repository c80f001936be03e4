//! Metrics compared with numbers computed by hand, and properties of their intervals.

use proptest::prelude::*;
use skinrig_analysis::metrics::{Exclusions, metrics, penalised};
use skinrig_analysis::result::{LocationOutcome, Metrics, PressResult};
use skinrig_analysis::sets::ScoreSet;
use skinrig_model::{LocationId, Point2, PressId, PressRole, RepetitionId, SkinOutline, Verdict};

/// A scored press at (10 + location, 2) whose estimate is off by `error`; `None`: no estimate.
pub(crate) fn row(location: u32, error: Option<(f64, f64)>, verdict: Verdict) -> PressResult {
    let truth = Point2::new(10.0 + f64::from(location), 2.0);
    PressResult {
        press: PressId::from_index(0),
        role: PressRole::Score,
        repetition: RepetitionId::default(),
        location: LocationId::from_index(location),
        planned: truth,
        depth_mm: 2.0,
        truth: Some(truth),
        verdict,
        cause: None,
        timing: None,
        views: [None, None],
        location_outcome: error.map_or(LocationOutcome::Missing, |(dx, dy)| {
            LocationOutcome::Located {
                at: Point2::new(truth.x_mm + dx, truth.y_mm + dy),
                sine: 0.9,
            }
        }),
        region: None,
        extrapolated: false,
    }
}

fn measure(rows: &[PressResult], exclusions: Exclusions) -> Metrics {
    metrics(
        &ScoreSet::from_presses(rows, &[]),
        exclusions,
        &SkinOutline::PAPER,
        5.0,
        500,
        1,
    )
}

fn near(found: Option<f64>, expected: f64) -> bool {
    found.is_some_and(|f| (f - expected).abs() < 1e-12)
}

#[test]
fn values_are_those_of_the_definitions() {
    let rows = [
        row(0, Some((3.0, 4.0)), Verdict::Valid),
        row(0, Some((1.0, 0.0)), Verdict::Valid),
        row(1, Some((0.0, -2.0)), Verdict::Valid),
        row(1, Some((50.0, 0.0)), Verdict::Excluded),
        row(2, None, Verdict::Excluded),
        row(3, None, Verdict::Invalid),
        row(4, None, Verdict::Missed),
    ];
    let m = measure(&rows, Exclusions::Applied);
    assert!(near(m.rmse_mm.value, (30.0f64 / 3.0).sqrt()));
    assert!(near(m.rmse_x_mm.value, (10.0f64 / 3.0).sqrt()));
    assert!(near(m.rmse_y_mm.value, (20.0f64 / 3.0).sqrt()));
    assert!(near(m.bias_x_mm.value, 4.0 / 3.0) && near(m.bias_y_mm.value, 2.0 / 3.0));
    assert!(near(m.median_mm.value, 2.0));
    assert!(near(m.p95_mm.value, 2.0 + 0.9 * 3.0));
    // Two estimates of location 0, (2, 4) mm apart: sample std sqrt(20 / 2).
    assert!(near(m.repeat_std_mm.value, 10f64.sqrt()));
    assert_eq!(
        (m.rmse_mm.n, m.repeat_std_mm.n, m.located_rate.n),
        (3, 1, 6)
    );
    assert!(near(m.located_rate.value, 0.5));
    assert!(near(m.rmse_diagonal_percent, 10f64.sqrt() / 2f64.sqrt()));

    let all = measure(&rows, Exclusions::Ignored);
    assert!(near(all.rmse_mm.value, (2530.0f64 / 4.0).sqrt()));
    assert!(near(all.located_rate.value, 4.0 / 6.0));
    assert_eq!(all.repeat_std_mm.n, 2);
}

#[test]
fn a_failure_counts_the_penalty_or_its_own_larger_error() {
    let of =
        |rows: &[PressResult], stated| penalised(&ScoreSet::from_presses(rows, &[]), stated, 0, 1);
    let rows = [
        row(0, Some((3.0, 4.0)), Verdict::Valid),
        row(1, Some((0.0, 12.0)), Verdict::Excluded),
        row(2, Some((0.0, 40.0)), Verdict::Excluded),
        row(3, None, Verdict::Invalid),
    ];
    let p = of(&rows, Some(30.0));
    assert_eq!((p.penalty_mm, p.raised, p.derived), (30.0, false, false));
    assert_eq!((p.failures, p.beyond_penalty), (3, 1));
    assert!(near(
        p.rmse_mm.value,
        ((25.0 + 900.0 + 1600.0 + 900.0) / 4.0f64).sqrt()
    ));
    // A penalty below the actual errors is raised to the RMSE of all estimates.
    let p = of(&rows, Some(1.0));
    let all = ((25.0 + 144.0 + 1600.0) / 3.0f64).sqrt();
    assert!((p.penalty_mm - all).abs() < 1e-12 && p.raised);
    // Locations 1 mm apart: a blind guess would be better than these estimates.
    assert!(of(&rows, None).raised && of(&rows, None).derived);
    assert!(of(&rows[..1], None).rmse_mm.value.is_some() && of(&[], None).rmse_mm.value.is_none());
}

#[test]
fn too_few_presses_give_no_number_instead_of_a_false_one() {
    let m = measure(&[], Exclusions::Applied);
    assert_eq!(
        (m.rmse_mm.value, m.rmse_mm.n, m.located_rate.value),
        (None, 0, None)
    );
    let m = measure(&[row(0, None, Verdict::Excluded)], Exclusions::Applied);
    assert_eq!((m.rmse_mm.value, m.median_mm.value), (None, None));
    assert_eq!((m.located_rate.value, m.located_rate.n), (Some(0.0), 1));
    // One location: a value, but nothing to resample.
    let m = measure(
        &[row(0, Some((1.0, 1.0)), Verdict::Valid)],
        Exclusions::Applied,
    );
    assert!(
        m.rmse_mm.value.is_some() && m.rmse_mm.low.is_none() && m.repeat_std_mm.value.is_none()
    );
}

#[test]
fn what_always_or_never_happened_has_the_exact_interval_over_locations() {
    // Two presses at each of four places, all located, none within 5 mm.
    let rows: Vec<_> = (0..8)
        .map(|i| row(i / 2, Some((6.0, 0.0)), Verdict::Valid))
        .collect();
    let m = measure(&rows, Exclusions::Applied);
    let end = libm::pow(0.025f64, 1.0 / 4.0);
    assert!(near(m.located_rate.low, end) && m.located_rate.high == Some(1.0));
    assert!(m.within_rate.low == Some(0.0) && near(m.within_rate.high, 1.0 - end));
    // A mean of 0 is not a share.
    assert_eq!((m.bias_y_mm.low, m.bias_y_mm.high), (Some(0.0), Some(0.0)));
}

#[test]
fn depths_are_not_repetitions_of_each_other() {
    let mut deep = row(0, Some((5.0, 0.0)), Verdict::Valid);
    deep.depth_mm = 4.0;
    let m = measure(
        &[row(0, Some((0.0, 0.0)), Verdict::Valid), deep],
        Exclusions::Applied,
    );
    assert_eq!(m.repeat_std_mm.value, None);
}

#[test]
fn the_interval_has_its_nominal_coverage() {
    // 120 sessions of 60 locations with normal errors of 3 mm in x and y: RMSE 3 sqrt(2). Percentile intervals of a
    // bootstrap cover a little less than 95 %.
    let mut state = 5u64;
    let mut unit = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut normal = || (0..12).map(|_| unit()).sum::<f64>() - 6.0;
    let covered = (0..120)
        .filter(|_| {
            let rows: Vec<PressResult> = (0..60)
                .map(|i| row(i, Some((3.0 * normal(), 3.0 * normal())), Verdict::Valid))
                .collect();
            let m = measure(&rows, Exclusions::Applied).rmse_mm;
            let truth = 3.0 * 2f64.sqrt();
            m.low.unwrap() <= truth && truth <= m.high.unwrap()
        })
        .count();
    assert!((104..=120).contains(&covered), "{covered} of 120");
}

proptest! {
    /// For any outcome of the presses and any penalty setting.
    #[test]
    fn counting_failures_never_lowers_the_rmse(
        presses in prop::collection::vec(
            (0u32..12, prop::option::of((-150.0f64..150.0, -150.0f64..150.0)), 0usize..4, -6.0f64..4.0), 1..40),
        stated in prop::option::of(1e-3f64..200.0),
    ) {
        let verdicts = [Verdict::Valid, Verdict::Excluded, Verdict::Invalid, Verdict::Missed];
        let rows: Vec<PressResult> = presses.iter()
            .map(|(location, error, verdict, log)| {
                let scale = libm::pow(10f64, *log);
                row(*location, error.map(|(x, y)| (x * scale, y * scale)), verdicts[*verdict])
            })
            .collect();
        let set = ScoreSet::from_presses(&rows, &[]);
        let counted = penalised(&set, stated, 0, 1);
        for exclusions in [Exclusions::Applied, Exclusions::Ignored] {
            if let Some(rmse) = measure(&rows, exclusions).rmse_mm.value {
                prop_assert!(counted.rmse_mm.value.unwrap() >= rmse * (1.0 - 1e-12), "{counted:?} {rmse}");
                prop_assert!(counted.penalty_mm >= rmse * (1.0 - 1e-12));
            }
        }
        prop_assert!(counted.failures >= counted.beyond_penalty);
    }

    #[test]
    fn intervals_hold_their_value_and_repetitions_do_not_narrow_them(
        errors in prop::collection::vec((-20.0f64..20.0, -20.0f64..20.0), 4..30), copies in 2usize..5,
    ) {
        let rows: Vec<PressResult> =
            errors.iter().zip(0..).map(|(e, i)| row(i, Some(*e), Verdict::Valid)).collect();
        let m = measure(&rows, Exclusions::Applied);
        for e in [m.rmse_mm, m.rmse_x_mm, m.rmse_y_mm, m.bias_x_mm, m.median_mm, m.p95_mm] {
            prop_assert!(e.low <= e.high);
            prop_assert!(e.n as usize == errors.len());
        }
        let (x, y, r) = (m.rmse_x_mm.value.unwrap(), m.rmse_y_mm.value.unwrap(), m.rmse_mm.value.unwrap());
        prop_assert!((x * x + y * y - r * r).abs() < 1e-9 * (1.0 + r * r));
        // Repeating the same presses at the same locations adds no information.
        let repeated: Vec<PressResult> = (0..copies).flat_map(|_| rows.clone()).collect();
        let second = measure(&repeated, Exclusions::Applied);
        prop_assert!((second.rmse_mm.low.unwrap() - m.rmse_mm.low.unwrap()).abs() < 1e-9);
        prop_assert!((second.rmse_mm.high.unwrap() - m.rmse_mm.high.unwrap()).abs() < 1e-9);
        prop_assert_eq!(second.repeat_std_mm.value.map(|v| v < 1e-9), Some(true));
    }
}

/// Where the headline presses are at calibrating locations, their RMSE is that of places the calibration knows.
#[test]
fn the_left_out_rmse_is_of_locations_that_did_not_calibrate() {
    let (input, events) = skinrig_planted::grid::session();
    let mut analysis = skinrig_analysis::analyze(&input, &events).unwrap();
    assert_eq!(analysis.scores_calibrating_places(), Some(true));
    let compared = &analysis.locator.as_ref().unwrap().compared;
    let chosen = compared.iter().find(|c| c.chosen).unwrap().rmse_mm;
    assert!(chosen.value.is_some() && chosen != analysis.scored.rmse_mm);
    assert_eq!(analysis.left_out_rmse(), Some(chosen));

    // Calibrated at some of the places only: the presses at the others give the error there, as their own mean square.
    let known: Vec<LocationId> = analysis.presses.iter().map(|p| p.location).collect();
    let half = |location: LocationId| location.index().is_multiple_of(2);
    for press in analysis.presses.iter_mut() {
        if press.role == PressRole::Calibrate && half(press.location) {
            press.location = LocationId::from_index(1000 + press.location.index());
        }
    }
    let elsewhere: Vec<f64> = analysis
        .presses
        .iter()
        .filter(|p| p.role == PressRole::Score && p.verdict == Verdict::Valid && half(p.location))
        .filter_map(|p| p.error_mm().map(|(x, y)| x * x + y * y))
        .collect();
    let rmse = (elsewhere.iter().sum::<f64>() / elsewhere.len() as f64).sqrt();
    let found = analysis.left_out_rmse().unwrap();
    assert_eq!(found.n as usize, elsewhere.len());
    assert!(
        (found.value.unwrap() - rmse).abs() < 1e-12,
        "{found:?} {rmse}"
    );
    assert!(found.low.unwrap() < rmse && rmse < found.high.unwrap());
    assert_eq!(analysis.scores_calibrating_places(), Some(true));
    for (press, location) in analysis.presses.iter_mut().zip(known) {
        press.location = location;
    }

    let calibrating = analysis.presses.iter_mut();
    for press in calibrating.filter(|p| p.role == PressRole::Calibrate) {
        press.location = LocationId::from_index(1000 + press.location.index());
    }
    assert_eq!(analysis.scores_calibrating_places(), Some(false));
    assert_eq!(analysis.left_out_rmse(), Some(analysis.scored.rmse_mm));

    // No press counts.
    analysis
        .presses
        .iter_mut()
        .for_each(|p| p.verdict = Verdict::Excluded);
    assert_eq!(analysis.scores_calibrating_places(), None);
    assert_eq!(analysis.left_out_rmse(), None);
}
