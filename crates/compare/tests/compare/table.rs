//! The table and the map of a comparison against the presses themselves.
#![expect(clippy::unwrap_used, reason = "tests")]

use skinrig_analysis::result::{PressResult, PressView};
use skinrig_compare::{Comparison, ComparisonOptions, Metric, Row, Subject, compare};
use skinrig_model::{PressRole, Verdict};
use skinrig_statistics::{AlphaSpending, Pairing};

use crate::causes::planted::{PlantedCause, record};

const WITHIN_MM: f64 = 0.1;

fn scored(of: &Subject) -> impl Iterator<Item = &PressResult> {
    let presses = of.sessions.iter().flat_map(|s| &s.analysis.presses);
    presses.filter(|p| p.role == PressRole::Score)
}

fn errors(of: &Subject) -> Vec<(f64, f64)> {
    scored(of).map(|p| p.error_mm().unwrap()).collect()
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, n) = values
        .into_iter()
        .fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / n
}

fn both_views(of: &Subject, value: fn(&PressView) -> f64) -> f64 {
    mean(scored(of).map(|p| p.views.iter().flatten().map(value).sum::<f64>()))
}

/// Mean over locations of the standard deviation of two repetitions, per axis.
fn repeat_std(of: &Subject) -> f64 {
    let presses: Vec<_> = scored(of).collect();
    let half = presses.len() / 2;
    let (first, second) = presses.split_at(half);
    mean(first.iter().zip(second).map(|(a, b)| {
        assert_eq!(a.location, b.location);
        let (a, b) = (a.estimate().unwrap(), b.estimate().unwrap());
        let square = |d: f64| d * d / 2.0;
        ((square(a.x_mm - b.x_mm) + square(a.y_mm - b.y_mm)) / 2.0).sqrt()
    }))
}

fn compared(a: &Subject, b: &Subject) -> Comparison {
    let options = ComparisonOptions {
        within_mm: Some(WITHIN_MM),
        ..ComparisonOptions::default()
    };
    compare(&[a.clone(), b.clone()], &vec![None], &options)
}

fn row(of: &Comparison, metric: Metric) -> &Row {
    of.table.iter().find(|r| r.metric == metric).unwrap()
}

fn is_near(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-9 * expected.abs().max(1e-3)
}

#[test]
fn the_values_of_a_skin_are_those_of_its_presses() {
    let (a, b) = (
        record(1, PlantedCause::Nothing).skin('A', None),
        record(2, PlantedCause::Signal(0.5)).skin('B', None),
    );
    let found = compared(&a, &b);
    for (k, subject) in [&a, &b].into_iter().enumerate() {
        let errors = errors(subject);
        let square = |of: fn(&(f64, f64)) -> f64| mean(errors.iter().map(of)).sqrt();
        let rmse = square(|e| e.0 * e.0 + e.1 * e.1);
        let settings = &subject.sessions[0].analysis.settings;
        let rate = both_views(subject, |v| v.rate_per_s);
        let share = mean(
            errors
                .iter()
                .map(|e| f64::from(u8::from(libm::hypot(e.0, e.1) <= WITHIN_MM))),
        );
        for (metric, expected) in [
            (Metric::Rmse, rmse),
            (Metric::RmseX, square(|e| e.0 * e.0)),
            (Metric::RmseY, square(|e| e.1 * e.1)),
            (Metric::BiasX, mean(errors.iter().map(|e| e.0))),
            (Metric::BiasY, mean(errors.iter().map(|e| e.1))),
            (Metric::LocatedRate, 1.0),
            (Metric::WithinRate, share),
            (
                Metric::IdleEvents,
                both_views(subject, |v| v.idle_rate_per_s),
            ),
            (Metric::PressEvents, rate),
            (Metric::PressBytes, rate * settings.bits_per_event / 8.0),
        ] {
            let value = row(&found, metric).values[k].value.unwrap().value;
            assert!(
                is_near(value, expected),
                "{metric:?}: {value}, not {expected}"
            );
        }
        let std = row(&found, Metric::RepeatStd).values[k]
            .value
            .unwrap()
            .value;
        assert!((0.5..2.0).contains(&(std / repeat_std(subject))), "{std}");
        let taxels = |k: usize| row(&found, Metric::Taxels).values[k].value.unwrap().value;
        let areas = [0, 1].map(|k| {
            let rmse = row(&found, Metric::Rmse).values[k].value.unwrap().value;
            taxels(k) * rmse * rmse
        });
        assert!(is_near(areas[0], areas[1]), "{areas:?}");
    }
    let share = row(&found, Metric::WithinRate).values[0]
        .value
        .unwrap()
        .value;
    assert!(
        share > 0.1 && share < 0.9,
        "{share}: the limit tells nothing"
    );
}

#[test]
fn every_metric_has_a_name_and_a_unit() {
    let a = record(1, PlantedCause::Nothing).skin('A', None);
    let found = compared(&a, &record(2, PlantedCause::Nothing).skin('B', None));
    let rows = found.table.iter().map(|r| {
        let (scale, unit) = (r.format.scale, r.format.unit);
        format!("{} | {} | {scale} {unit}", r.name, r.unit)
    });
    let rows: Vec<String> = rows.collect();
    let expected = [
        "RMSE | mm | 1 mm",
        "RMSE along x | mm | 1 mm",
        "RMSE along y | mm | 1 mm",
        "bias along x | mm | 1 mm",
        "bias along y | mm | 1 mm",
        "std of repetitions | mm | 1 mm",
        "located rate | share | 100 %",
        "within 0.1 mm | share | 100 %",
        "latency, median | ms | 1 ms",
        "latency, 5-95 % width | ms | 1 ms",
        "false alarms | 1/s | 1 /s",
        "events, idle | events/s | 0.001 kev/s",
        "events, press | events/s | 0.001 kev/s",
        "data, press | bytes/s | 0.001 kB/s",
        "taxels | locations | 1 ",
    ];
    assert_eq!(rows, expected);
}

#[test]
fn the_map_has_the_error_of_each_location() {
    let a = record(1, PlantedCause::Nothing).skin('A', None);
    let b = record(2, PlantedCause::Nothing).skin('B', None);
    let found = compared(&a, &b);
    assert_eq!(found.locations.len(), 25);
    for (k, subject) in [&a, &b].into_iter().enumerate() {
        let mut means = Vec::new();
        for location in &found.locations {
            let at_location = |p: &&PressResult| {
                let d = (
                    p.planned.x_mm - location.at.x_mm,
                    p.planned.y_mm - location.at.y_mm,
                );
                libm::hypot(d.0, d.1) < 0.05
            };
            let presses: Vec<_> = scored(subject).filter(at_location).collect();
            assert_eq!(presses.len(), 2, "{location:?}");
            assert!(presses.iter().all(|p| p.verdict == Verdict::Valid));
            let errors = presses.iter().map(|p| p.error_mm().unwrap());
            let lengths = mean(errors.clone().map(|(x, y)| libm::hypot(x, y)));
            let own = &location.skins[k];
            assert!(is_near(own.error_mm.unwrap(), lengths), "{own:?}");
            let vector = own.vector_mm.unwrap();
            assert!(is_near(vector[0], mean(errors.clone().map(|e| e.0))));
            assert!(is_near(vector[1], mean(errors.map(|e| e.1))));
            assert_eq!(own.presses, [2, 2]);
            means.push((lengths, own.rank.unwrap()));
        }
        means.sort_by(|a, b| a.0.total_cmp(&b.0));
        let ranks: Vec<u32> = means.iter().map(|m| m.1).collect();
        assert_eq!(ranks, (1..=25).collect::<Vec<u32>>());
    }
}

/// Each skin with its own calibration has the RMSE of the table; with that of the other, as many presses are located.
#[test]
fn calibrations_exchanged_between_skins_locate_the_same_presses() {
    let a = record(1, PlantedCause::Nothing).skin('A', None);
    let b = record(2, PlantedCause::Camera(1.0, 1.5)).skin('B', None);
    let found = compared(&a, &b);
    let rows = &found.causes[0].as_ref().unwrap().exchanged;
    let of = |presses: char, calibration: char| {
        let row = rows
            .iter()
            .find(|r| (r.presses, r.calibration) == (presses, calibration));
        row.unwrap()
    };
    for (k, letter) in ['A', 'B'].into_iter().enumerate() {
        let own = of(letter, letter);
        let rmse = row(&found, Metric::Rmse).values[k].value.unwrap().value;
        assert!(is_near(own.rmse_mm.unwrap(), rmse), "{own:?}");
        assert_eq!(own.located, [50, 50]);
        let other = of(letter, if k == 0 { 'B' } else { 'A' });
        assert_eq!(other.located[1], 50);
        assert!(other.rmse_mm.unwrap() > rmse, "{other:?}");
    }
}

/// Presses that do not count: the map has no error where none counts.
#[test]
fn a_location_without_a_press_that_counts_has_no_error() {
    let mut a = record(1, PlantedCause::Nothing).skin('A', None);
    let b = record(2, PlantedCause::Nothing).skin('B', None);
    let lost = scored(&a).next().unwrap().location;
    let presses = a.sessions[0].analysis.presses.iter_mut();
    for press in presses.filter(|p| p.role == PressRole::Score && p.location == lost) {
        let mut json = serde_json::to_value(&*press).unwrap();
        json["verdict"] = "excluded".into();
        json["cause"] = serde_json::json!({"no_cluster": {"camera": "camera1"}});
        *press = serde_json::from_value(json).unwrap();
    }
    let found = compared(&a, &b);
    let without: Vec<_> = found
        .locations
        .iter()
        .filter(|l| l.skins[0].error_mm.is_none())
        .collect();
    let [location] = without[..] else {
        panic!("{without:#?}");
    };
    let [own, other] = &location.skins[..] else {
        panic!("{location:#?}");
    };
    assert_eq!((own.vector_mm, own.rank), (None, None), "{own:#?}");
    assert!(other.error_mm.is_some() && other.difference_mm.is_none());
    assert_eq!(other.sign(), 0);
}

/// The skins share one of their depths; a location pressed at another alone is not compared.
#[test]
fn a_location_without_a_shared_depth_is_not_on_the_map() {
    let [a, b] = [(1, 1.0), (2, 1.5)].map(|(seed, depth_mm)| {
        let mut skin = record(seed, PlantedCause::Nothing).skin('A', None);
        let first = scored(&skin).next().unwrap().location;
        let presses = skin.sessions[0].analysis.presses.iter_mut();
        let own = presses.filter(|p| p.role == PressRole::Score && p.location == first);
        own.for_each(|p| p.depth_mm = depth_mm);
        skin
    });
    let found = compared(&a, &b);
    assert_eq!(found.locations.len(), 24);
    let attempted: Vec<u32> = found.skins.iter().map(|s| s.attempted).collect();
    assert_eq!(attempted, [48, 48]);
}

/// A skin that locates none of its faint presses does not look better for it.
#[test]
fn depths_that_one_skin_did_not_locate_are_not_compared() {
    let [mut a, mut b] = [1, 2].map(|seed| record(seed, PlantedCause::Nothing).skin('A', None));
    let first = scored(&a).next().unwrap();
    let (kept, faint) = (first.location, first.repetition);
    for (skin, is_dull) in [(&mut a, false), (&mut b, true)] {
        let presses = skin.sessions[0].analysis.presses.iter_mut();
        for press in presses.filter(|p| p.role == PressRole::Score && p.repetition == faint) {
            press.depth_mm = 0.5;
            if is_dull && press.location != kept {
                let mut json = serde_json::to_value(&*press).unwrap();
                json["verdict"] = "excluded".into();
                json["cause"] = serde_json::json!({"no_cluster": {"camera": "camera1"}});
                *press = serde_json::from_value(json).unwrap();
            }
        }
    }
    let square = |p: &PressResult| {
        let (x, y) = p.error_mm().unwrap();
        x * x + y * y
    };
    let of = |skin: &Subject, all: bool| {
        let shared = |p: &&PressResult| all || p.depth_mm != 0.5 || p.location == kept;
        mean(scored(skin).filter(shared).map(square)).sqrt()
    };
    let found = compared(&a, &b);
    let rmse = row(&found, Metric::Rmse).against_first[0]
        .comparison
        .as_ref();
    let rmse = rmse.unwrap();
    assert!(is_near(rmse.a.value, of(&a, false)), "{rmse:#?}");
    assert!((of(&a, true) - of(&a, false)).abs() > 1e-6);
    assert!(is_near(rmse.b.value, of(&b, false)), "{rmse:#?}");
    let told = found.differences.iter().find(|d| d.key == "located-depths");
    assert_eq!(told.unwrap().values[0], "26 of 50 located presses");
    // What it did not locate shows in its rate.
    let located = row(&found, Metric::LocatedRate);
    let rates: Vec<f64> = located
        .values
        .iter()
        .map(|v| v.value.as_ref().unwrap().value)
        .collect();
    assert!(is_near(rates[0], 1.0) && rates[1] < 0.6, "{rates:?}");
    // The verdict on the RMSE says so, whichever is the first.
    assert_eq!(found.fewer_located(1).map(|(skin, _)| skin), Some(1));
    let turned = compared(&b, &a);
    assert_eq!(turned.fewer_located(1).map(|(skin, _)| skin), Some(0));
    assert!(compared(&a, &a).fewer_located(1).is_none());
}

#[test]
fn looks_spend_alpha_and_an_overridden_rig_keeps_the_locations_paired() {
    let (a, mut b) = (
        record(1, PlantedCause::Nothing).skin('A', None),
        record(2, PlantedCause::Nothing).skin('B', None),
    );
    let options = ComparisonOptions {
        sequential: Some(AlphaSpending {
            planned_looks: None,
        }),
        ..ComparisonOptions::default()
    };
    let found = compare(&[a.clone(), b.clone()], &vec![None], &options);
    let looks = found.sequential.unwrap().looks;
    let spent: Vec<f64> = looks.iter().map(|l| l.spent).collect();
    let sums = [0.025, 0.025 + 0.05 / 6.0];
    assert_eq!(spent.len(), 2, "{looks:#?}");
    assert!(
        spent.iter().zip(sums).all(|(s, sum)| is_near(*s, sum)),
        "{spent:?}"
    );

    let fact = |kind: &str| [("rig.kind".to_owned(), kind.to_owned())].into();
    let mut a = a;
    a.sessions[0].facts.values = fact("simulated");
    b.sessions[0].facts.values = fact("bench");
    let of = |overrides: &[&str]| {
        let options = ComparisonOptions {
            overrides: overrides.iter().map(|o| (*o).to_owned()).collect(),
            ..ComparisonOptions::default()
        };
        compare(&[a.clone(), b.clone()], &vec![None], &options)
    };
    let refused = of(&[]);
    assert!(refused.table.is_empty() && refused.blocking().next().is_some());
    let despite = of(&["rig-kind"]);
    assert!(!despite.table.is_empty());
    assert_eq!(despite.settings.pairing, Pairing::SharedLocations);
}
