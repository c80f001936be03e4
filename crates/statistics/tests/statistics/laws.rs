//! Tests properties of all samples: swapping them mirrors the result, order does not matter, units
//! carry through.

use proptest::prelude::*;
use skinrig_statistics::{
    Comparison, ComparisonTarget, ImprovementDirection, Interval, Kind, Pairing, Position, Sample,
    Settings, Verdict, compare, estimate,
};

use crate::populations::{Draws, SimulatedPair};

const KINDS: [Kind; 9] = [
    Kind::Mean,
    Kind::Rms,
    Kind::Taxels,
    Kind::RepeatStd,
    Kind::Share,
    Kind::Median,
    Kind::Percentile95,
    Kind::Width,
    Kind::CountRate,
];

fn mirrored(i: Interval) -> Interval {
    Interval {
        value: -i.value,
        low: i.high.map(|v| -v),
        high: i.low.map(|v| -v),
    }
}

const fn opposite(verdict: Verdict) -> Verdict {
    match verdict {
        Verdict::Better => Verdict::Worse,
        Verdict::Worse => Verdict::Better,
        other => other,
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * (1.0 + a.abs().max(b.abs()))
}

fn near(a: Interval, b: Interval) -> bool {
    let end = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => close(a, b),
        (a, b) => a == b,
    };
    close(a.value, b.value) && end(a.low, b.low) && end(a.high, b.high)
}

fn all_finite(c: &Comparison) -> bool {
    let ends = [c.a, c.b, c.difference]
        .into_iter()
        .flat_map(|i| [Some(i.value), i.low, i.high]);
    ends.flatten().all(f64::is_finite)
        && (0.0..=1.0).contains(&c.p_difference)
        && c.tost.is_none_or(|t| (0.0..=1.0).contains(&t.p))
        && c.components.between.is_finite()
}

/// Presses as (location, value).
type Lines = Vec<(u32, f64)>;

/// Presses of a few locations on two skins, with a planted difference.
fn lines(seed: u64, shift: f64) -> [Lines; 2] {
    let mut draws = Draws::new(seed, 0);
    [0.0, shift].map(|shift| {
        let mut lines = Vec::new();
        for location in 0..12 {
            let place = draws.normal();
            for _ in 0..1 + location % 4 {
                lines.push((location, 2.0 + shift + place + 0.3 * draws.normal()));
            }
        }
        lines
    })
}

fn settings(pairing: Pairing) -> Settings {
    Settings {
        pairing,
        resamples: 199,
        ..Settings::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn exchanging_the_samples_mirrors_the_answer(
        kind in proptest::sample::select(&KINDS[..]),
        seed in any::<u64>(),
        independent in any::<bool>(),
        shifted in any::<bool>(),
    ) {
        let pair = if shifted { SimulatedPair::new(kind).shifted() } else { SimulatedPair::new(kind) };
        let [a, b] = pair.draw(&mut Draws::new(seed, 1), false);
        let pairing = if independent { Pairing::Independent } else { Pairing::SharedLocations };
        let question = ComparisonTarget { better: pair.better(), margin: Some(0.3) };
        let there = compare(&a, &b, &question, &settings(pairing));
        let back = compare(&b, &a, &question, &settings(pairing));
        if let (Ok(there), Ok(back)) = (&there, &back) {
            prop_assert!(all_finite(there), "{there:?}");
            prop_assert!(near(there.difference, mirrored(back.difference)), "{there:?} {back:?}");
            prop_assert!(close(there.p_difference, back.p_difference), "{there:?} {back:?}");
            prop_assert_eq!(there.tost.map(|t| t.p > 0.05), back.tost.map(|t| t.p > 0.05));
            prop_assert_eq!(there.verdict, opposite(back.verdict));
            prop_assert_eq!((there.a, there.b), (back.b, back.a));
        } else {
            prop_assert!(there.is_err() && back.is_err());
        }
    }

    #[test]
    fn the_order_of_presses_does_not_matter(seed in any::<u64>(), turn in 0usize..30) {
        let [a, b] = lines(seed, 0.4);
        let mut turned = a.clone();
        let by = turn % a.len();
        turned.rotate_left(by);
        turned.reverse();
        let question = ComparisonTarget { better: ImprovementDirection::Lower, margin: Some(0.5) };
        let of = |a: &[(u32, f64)]| {
            let [a, b] = [a, &b[..]].map(|v| Sample::rms(v.iter().copied()).unwrap());
            compare(&a, &b, &question, &settings(Pairing::SharedLocations)).unwrap()
        };
        prop_assert_eq!(of(&a), of(&turned));
    }

    #[test]
    fn units_carry_through(seed in any::<u64>(), unit in 1e-3f64..1e3) {
        let [a, b] = lines(seed, 0.4);
        let make: [fn(Lines) -> Sample; 5] = [
            |v| Sample::mean(v).unwrap(),
            |v| Sample::rms(v).unwrap(),
            |v| Sample::median(v.into_iter().map(|(k, t)| (k, Some(t)))).unwrap(),
            |v| Sample::width(v.into_iter().map(|(k, t)| (k, Some(t)))).unwrap(),
            |v| Sample::repeat_std(v.into_iter().map(|(k, x_mm)| {
                (k, Position { series: 0, x_mm, y_mm: 0.0 })
            })).unwrap(),
        ];
        for make in make {
            let of = |unit: f64| {
                let scaled = |v: &[(u32, f64)]| make(v.iter().map(|(k, x)| (*k, unit * x)).collect());
                let question = ComparisonTarget { better: ImprovementDirection::Lower, margin: Some(0.5 * unit) };
                let settings = settings(Pairing::SharedLocations);
                compare(&scaled(&a), &scaled(&b), &question, &settings).unwrap()
            };
            let (one, other) = (of(1.0), of(unit));
            let back = |v: f64| v / unit;
            let scaled = Interval {
                value: back(other.difference.value),
                low: other.difference.low.map(back),
                high: other.difference.high.map(back),
            };
            prop_assert!(near(one.difference, scaled), "{one:?} {other:?}");
            prop_assert!(close(one.components.between, other.components.between / (unit * unit)));
        }
    }
}

#[test]
fn a_clear_difference_is_found_and_equal_skins_are_equivalent() {
    let question = ComparisonTarget {
        better: ImprovementDirection::Lower,
        margin: Some(0.5),
    };
    let verdict = |shift: f64| {
        let [a, _] = lines(3, 0.0);
        // Repetitions of B at the locations of A: the same skin except for noise and a shift.
        let mut draws = Draws::new(4, 0);
        let b: Vec<_> = a
            .iter()
            .map(|(k, v)| (*k, v + shift + 0.1 * draws.normal()))
            .collect();
        let [a, b] = [a, b].map(|v| Sample::mean(v).unwrap());
        compare(&a, &b, &question, &settings(Pairing::SharedLocations)).unwrap()
    };
    assert_eq!(verdict(-2.0).verdict, Verdict::Better);
    assert!(verdict(-2.0).beyond_margin && !verdict(-0.3).beyond_margin);
    assert_eq!(verdict(2.0).verdict, Verdict::Worse);
    assert_eq!(verdict(0.0).verdict, Verdict::Equivalent);
    assert_eq!(verdict(-0.3).verdict, Verdict::Equivalent);
}

#[test]
fn a_value_alone_is_the_metric_itself() {
    let [a, _] = lines(1, 0.0);
    let n = a.len() as f64;
    let mean_square = a.iter().map(|(_, v)| v * v).sum::<f64>() / n;
    let found = estimate(&Sample::rms(a).unwrap(), &settings(Pairing::default())).unwrap();
    assert!(close(found.value, mean_square.sqrt()));
    assert!(found.low.unwrap() < found.value && found.value < found.high.unwrap());
}
