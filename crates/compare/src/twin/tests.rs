//! Coverage of the intervals, and what a twin is not allowed to see, on synthetic skins.

use proptest::prelude::*;
use skinrig_model::{LocationId, Point2};
use skinrig_statistics::seeded;

use super::*;

/// Skins whose figures and outcomes follow from their constants, with noise.
fn skins(seed: u64, n: usize) -> Vec<SkinDraw> {
    (0..n as u64).map(|k| skin(1_000 * seed + k)).collect()
}

fn skin(seed: u64) -> SkinDraw {
    let shares = TwinConstant::draw(seed);
    let mut random = seeded::generator(seed, 1);
    let mut noise = |size: f64| {
        size * (0..3)
            .map(|_| seeded::signed_unit(&mut random))
            .sum::<f64>()
    };
    let (loss, scatter, bright) = (shares[0], shares[5], shares[9]);
    let values = CalibrationFigure::ALL
        .iter()
        .enumerate()
        .map(|(k, figure)| {
            let from = [loss, scatter, bright][k % 3];
            // Within the range of a share.
            let value = 0.1 + 0.6 * from + noise(0.02);
            Some(match figure {
                CalibrationFigure::LeftOut => libm::exp(2.0 * scatter + noise(0.1)),
                _ => value,
            })
        });
    let figures = CalibrationFigures {
        values: values.collect(),
        presses: 20,
    };
    // Errors grow with the scatter, faster than the figures, and their noise with them.
    let rmse = libm::exp(2.0 * scatter * scatter + noise(0.05 + 0.2 * scatter));
    let outcomes = |factor: f64| {
        SessionFigures::with(&[
            (SessionFigure::Rmse, factor * rmse),
            (SessionFigure::PressRate, 1_000.0 * (1.0 + loss)),
        ])
    };
    let places = (0..12u32).map(|k| {
        let steep = f64::from(k) / 6.0;
        PlaceErrors {
            location: LocationId::from_index(k),
            at: Point2::new(f64::from(k % 4) * 10.0, f64::from(k / 4) * 10.0),
            calibration_mm: Some(rmse * libm::exp(steep + noise(0.3))),
            response_per_s: Some(1e4),
            region_mm: Some(2.0 * rmse),
            scored_mm: Some(rmse * libm::exp(steep + noise(0.3))),
        }
    });
    SkinDraw {
        shares,
        figures,
        outcomes: outcomes(1.0),
        changed: Some(outcomes(2.0)),
        places: places.collect(),
    }
}

fn observed(skin: &SkinDraw) -> Observed {
    Observed {
        figures: skin.figures.clone(),
        outcomes: skin.outcomes.clone(),
        places: skin.places.clone(),
    }
}

fn outcome(twin: &Twin, figure: SessionFigure) -> OutcomePrediction {
    *twin
        .outcomes
        .iter()
        .find(|row| row.figure == figure)
        .unwrap()
}

#[test]
fn intervals_hold_as_often_as_stated_and_are_narrower_than_ignorance() {
    let all = skins(1, 300);
    let table = &all[..100];
    let (mut held, mut n) = (0, 0);
    for skin in &all[100..] {
        let twin = twin(&observed(skin), table).unwrap();
        let rmse = outcome(&twin, SessionFigure::Rmse);
        let inside = |i: Interval, x: f64| u32::from((i.low..=i.high).contains(&x));
        held += inside(rmse.predicted.unwrap(), rmse.recorded.unwrap());
        let changed = skin
            .changed
            .as_ref()
            .unwrap()
            .get(SessionFigure::Rmse)
            .unwrap();
        held += inside(rmse.changed.unwrap(), changed);
        let scatter = &twin.constants[5];
        assert!(scatter.explained > 0.75, "{}", scatter.explained);
        held += inside(scatter.value, scatter.constant.at(skin.shares[5]));
        n += 3;
        // Depth scatter has no figure.
        let unknown = &twin.constants[6];
        assert!(unknown.explained < 0.1 && unknown.value.high > 20.0 && unknown.value.low < 10.0);
    }
    // 95 % and four binomial standard errors of 600.
    let percent = 100.0 * f64::from(held) / f64::from(n);
    assert!((91.4..=98.6).contains(&percent), "{percent}");
}

#[test]
fn scored_presses_change_no_prediction() {
    let table = skins(2, 60);
    let session = observed(&skin(9));
    let mut other = session.clone();
    other.outcomes = SessionFigures::with(&[(SessionFigure::Rmse, 99.0)]);
    for place in &mut other.places {
        place.scored_mm = None;
    }
    let (a, b) = (
        twin(&session, &table).unwrap(),
        twin(&other, &table).unwrap(),
    );
    assert_eq!(a.constants, b.constants);
    let predicted = |t: &Twin| {
        t.outcomes
            .iter()
            .map(|row| (row.predicted, row.changed))
            .collect::<Vec<_>>()
    };
    assert_eq!(predicted(&a), predicted(&b));
    let (a, b) = (a.places.unwrap(), b.places.unwrap());
    assert_eq!(a.predicted_mm, b.predicted_mm);
    assert!(a.correlation.is_some() && b.correlation.is_none());
}

#[test]
fn a_session_unlike_every_skin_has_no_twin_and_the_figure_is_named() {
    let table = skins(3, 100);
    let mut session = observed(&skin(9));
    assert!(twin(&session, &table).unwrap().is_like());
    // Each figure for itself stays possible: only together they are not.
    session.figures.values[1] = Some(0.8 - session.figures.values[1].unwrap());
    let found = twin(&session, &table).unwrap();
    assert!(!found.is_like());
    assert!(found.constants.is_empty() && found.outcomes.is_empty() && found.places.is_none());
    let far = found
        .figures
        .iter()
        .max_by(|a, b| a.deviations.abs().total_cmp(&b.deviations.abs()));
    let far = far.unwrap();
    assert_eq!(far.figure, CalibrationFigure::ALL[1]);
    assert!(far.is_unlike(), "{}", far.deviations);
}

#[test]
fn places_are_ranked_by_what_the_calibration_presses_and_other_skins_show() {
    let found = twin(&observed(&skin(9)), &skins(4, 60))
        .unwrap()
        .places
        .unwrap();
    assert!(found.correlation.unwrap() > 0.7, "{:?}", found.correlation);
    assert!(found.usual.unwrap().middle > 0.7, "{:?}", found.usual);
    // A place without calibration presses has no prediction.
    let mut session = observed(&skin(9));
    session.places[3].calibration_mm = None;
    let found = twin(&session, &skins(4, 60)).unwrap().places.unwrap();
    assert_eq!(found.predicted_mm[3], None);
    assert!(found.predicted_mm[4].is_some());
}

#[test]
fn figures_that_the_session_lacks_are_not_used() {
    let mut table = skins(5, 60);
    let mut session = observed(&skin(9));
    session.figures.values[2] = None;
    // Two skins lack another one: they do not count.
    table[7].figures.values[4] = None;
    table[8].figures.values[4] = None;
    let found = twin(&session, &table).unwrap();
    assert_eq!((found.skins, found.left_out), (58, 2));
    assert!(
        found
            .figures
            .iter()
            .all(|row| row.figure != CalibrationFigure::ALL[2])
    );
    session.figures.values.fill(None);
    assert_eq!(twin(&session, &table), Err(NoTwin::NoFigures));
}

#[test]
fn too_few_skins_are_refused() {
    assert_eq!(
        twin(&observed(&skin(9)), &skins(6, 39)),
        Err(NoTwin::TooFew(39))
    );
    assert!(twin(&observed(&skin(9)), &skins(6, 40)).is_ok());
}

#[test]
fn an_outcome_that_does_not_vary_has_no_interval() {
    let mut table = skins(7, 60);
    for skin in &mut table {
        skin.outcomes = SessionFigures::with(&[(SessionFigure::Located, 1.0)]);
    }
    let found = twin(&observed(&skin(9)), &table).unwrap();
    assert_eq!(outcome(&found, SessionFigure::Located).predicted, None);
    assert_eq!(outcome(&found, SessionFigure::Rmse).predicted, None);
}

/// The ends of a share are whole presses, so that a session that locates all of them is inside an interval that ends just below.
#[test]
fn a_predicted_share_ends_at_whole_presses() {
    let mut table = skins(8, 60);
    for (n, skin) in table.iter_mut().enumerate() {
        let located = if n % 6 == 0 { 0.975 } else { 1.0 };
        skin.outcomes = SessionFigures::with(&[(SessionFigure::Located, located)]);
    }
    let mut session = observed(&skin(9));
    session.outcomes = SessionFigures::with(&[(SessionFigure::Located, 1.0)]);
    let found = twin(&session, &table).unwrap();
    let predicted = outcome(&found, SessionFigure::Located).predicted.unwrap();
    assert_eq!(predicted.high, 1.0);
    let presses = 40.0 * predicted.low;
    assert_eq!(presses, presses.round());
}

#[test]
fn draws_cover_their_range_evenly() {
    let draws: Vec<Vec<f64>> = (0..2_000).map(TwinConstant::draw).collect();
    assert_eq!(draws[3], TwinConstant::draw(3));
    for k in 0..TwinConstant::ALL.len() {
        let below = |share: f64| draws.iter().filter(|d| d[k] < share).count() as f64 / 2_000.0;
        for share in [0.1, 0.5, 0.9] {
            // Four binomial standard errors of 2,000 are at most 0.045.
            assert!(
                (below(share) - share).abs() < 0.045,
                "{k} {share} {}",
                below(share)
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Units of a figure, and the order of the skins, change nothing.
    #[test]
    fn the_order_of_skins_changes_no_interval(seed in 0u64..1_000) {
        let table = skins(8, 50);
        let session = observed(&skin(seed));
        let mut turned = table.clone();
        turned.rotate_left(17);
        let (a, b) = (twin(&session, &table).unwrap(), twin(&session, &turned).unwrap());
        for (a, b) in a.outcomes.iter().zip(&b.outcomes) {
            prop_assert_eq!(a.predicted.is_some(), b.predicted.is_some());
            if let (Some(a), Some(b)) = (a.predicted, b.predicted) {
                prop_assert!((a.low / b.low - 1.0).abs() < 1e-9 && (a.high / b.high - 1.0).abs() < 1e-9);
            }
        }
        prop_assert_eq!(a.farther, b.farther);
    }
}
