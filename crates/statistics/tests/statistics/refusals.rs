//! Tests samples that cannot be compared: each reason has its own type and message, and no result
//! is NaN.

use skinrig_statistics::{
    ComparisonError, ComparisonTarget, Count, ImprovementDirection, Note, Pairing, Position,
    Sample, SampleFault, Settings, compare, estimate,
};

const LOWER: ComparisonTarget = ComparisonTarget {
    better: ImprovementDirection::Lower,
    margin: Some(0.5),
};

/// Errors at locations `places`, with 3 different repetitions each.
fn errors(places: std::ops::Range<u32>) -> Sample {
    let value = |i: u32, r: u32| 2.0 + 0.05 * f64::from((7 * i * i + 3 * r) % 11);
    Sample::rms(places.flat_map(|i| (0..3).map(move |r| (i, value(i, r))))).unwrap()
}

fn refusal(a: &Sample, b: &Sample) -> ComparisonError {
    compare(a, b, &LOWER, &Settings::default()).unwrap_err()
}

fn times(missed: u32) -> Sample {
    let time = |i: u32| (i >= missed).then(|| 20.0 + f64::from(i % 7));
    Sample::median((0..20).map(|i| (i, time(i)))).unwrap()
}

#[test]
fn an_impossible_comparison_states_its_reason() {
    let empty = Sample::rms([]).unwrap();
    let found = refusal(&errors(0..9), &empty);
    assert_eq!(
        found.to_string(),
        "B has no value of this metric: none of its presses yields one"
    );
    let found = refusal(&errors(0..9), &errors(9..15));
    assert!(
        matches!(found, ComparisonError::NoSharedLocation { a: 9, b: 6 }),
        "{found}"
    );
    let found = refusal(&errors(0..9), &errors(8..15));
    assert!(
        matches!(found, ComparisonError::TooFewLocations { locations: 1 }),
        "{found}"
    );
    let found = refusal(&errors(0..9), &times(0));
    assert!(matches!(found, ComparisonError::Kinds { .. }), "{found}");
    let alone = estimate(&errors(0..1), &Settings::default()).unwrap_err();
    assert!(
        matches!(alone, ComparisonError::TooFewLocations { locations: 1 }),
        "{alone}"
    );
}

#[test]
fn without_spread_there_is_no_interval() {
    let found = refusal(&errors(0..9), &errors(0..9));
    assert!(
        matches!(found, ComparisonError::NoSpread { locations: 9, .. }),
        "{found}"
    );
    let all = |v: f64| Sample::mean((0..9).map(|i| (i, v))).unwrap();
    let found = refusal(&all(1.0), &all(2.0));
    assert_eq!(
        found,
        ComparisonError::NoSpread {
            a: 1.0,
            b: 2.0,
            locations: 9
        }
    );
    let still = |x_mm: f64| {
        let at = Position {
            series: 0,
            x_mm,
            y_mm: 0.0,
        };
        Sample::repeat_std((0..18).map(|i| (i / 2, at))).unwrap()
    };
    assert!(matches!(
        refusal(&still(1.0), &still(2.0)),
        ComparisonError::NoSpread { .. }
    ));
    let perfect = Sample::taxels(2000.0, (0..9).map(|i| (i, 0.0))).unwrap();
    assert!(matches!(
        refusal(&perfect, &perfect),
        ComparisonError::NoError { .. }
    ));
}

#[test]
fn a_share_of_0_or_1_still_has_an_interval() {
    let all = |success: bool| Sample::share((0..20).map(|i| (i / 2, success)));
    let question = ComparisonTarget {
        better: ImprovementDirection::Higher,
        margin: None,
    };
    let found = compare(&all(true), &all(true), &question, &Settings::default()).unwrap();
    assert_eq!((found.difference.value, found.p_difference), (0.0, 1.0));
    assert!(found.difference.low.unwrap() < -0.2, "{found:?}");
    assert_eq!(found.notes.len(), 2);
    let none = |seconds: f64| {
        let count = Count {
            events: 0,
            exposure: seconds,
        };
        Sample::count_rate((0..9).map(|i| (i, count))).unwrap()
    };
    let found = compare(&none(1.0), &none(2.0), &LOWER, &Settings::default()).unwrap();
    assert!(found.difference.low.unwrap() < 0.0 && found.difference.high.unwrap() > 0.0);
}

#[test]
fn a_median_among_misses_is_beyond_the_window() {
    let found = refusal(&times(3), &times(11));
    let expected = "the 50 % percentile of B lies beyond the window: 11 of 20 trials were missed";
    assert!(found.to_string().starts_with(expected), "{found}");
    // Fewer than half are missed, so there is a median; misses still count.
    let found = compare(&times(0), &times(6), &LOWER, &Settings::default()).unwrap();
    assert!(found.b.value > found.a.value, "{found:?}");
    assert!(matches!(
        found.notes[..],
        [Note::Missed {
            missed: 6,
            trials: 20,
            ..
        }]
    ));
    // Misses extend into the interval: it has no upper end.
    let late = estimate(&times(9), &Settings::default()).unwrap();
    assert!(late.low.is_some() && late.high.is_none(), "{late:?}");
}

#[test]
fn unequal_repetitions_do_not_pass_for_a_difference() {
    // The same scatter, pressed 3 and 12 times: the std of 3 is too small on average.
    let sample = |repetitions: u32, seed: u64| {
        let mut draws = crate::populations::Draws::new(seed, 3);
        Sample::repeat_std((0..400 * repetitions).map(|i| {
            let at = Position {
                series: 0,
                x_mm: draws.normal(),
                y_mm: draws.normal(),
            };
            (i / repetitions, at)
        }))
        .unwrap()
    };
    let few = sample(3, 1);
    let found = compare(&few, &sample(12, 2), &LOWER, &Settings::default()).unwrap();
    assert!(found.p_difference > 0.05, "{found:?}");
    assert_eq!(found.notes, [Note::UnequalRepetitions]);
    let alone = estimate(&few, &Settings::default()).unwrap();
    assert!(
        alone.value > found.a.value,
        "pairs scatter less than threes"
    );
}

#[test]
fn non_finite_values_are_rejected() {
    let nan = Sample::mean([(3, f64::NAN)]).unwrap_err();
    assert_eq!(
        nan.to_string(),
        "expected finite values, found NaN at location 4"
    );
    let never = Count {
        events: 1,
        exposure: 0.0,
    };
    let found = Sample::count_rate([(1, never)]);
    assert!(matches!(
        found,
        Err(SampleFault::Exposure { location, .. }) if location.index() == 1
    ));
    assert!(matches!(
        Sample::taxels(-1.0, []),
        Err(SampleFault::Area(_))
    ));
}

#[test]
fn settings_out_of_range_are_refused() {
    let usual = Settings::default();
    for (settings, name) in [
        (
            Settings {
                alpha: 0.0,
                ..usual
            },
            "alpha",
        ),
        (
            Settings {
                alpha: f64::NAN,
                ..usual
            },
            "alpha",
        ),
        (
            Settings {
                power: 1.0,
                ..usual
            },
            "power",
        ),
        (
            Settings {
                resamples: 38,
                ..usual
            },
            "resamples",
        ),
    ] {
        let found = compare(&errors(0..9), &errors(0..8), &LOWER, &settings).unwrap_err();
        assert!(
            matches!(&found, ComparisonError::Setting { name: n, .. } if n == name),
            "{found}"
        );
    }
    let margin = ComparisonTarget {
        margin: Some(0.0),
        ..LOWER
    };
    let found = compare(&errors(0..9), &errors(0..9), &margin, &usual).unwrap_err();
    assert!(
        matches!(&found, ComparisonError::Setting { name, .. } if name == "margin"),
        "{found}"
    );
    let few = Settings {
        pairing: Pairing::Independent,
        ..usual
    };
    let found = compare(&errors(0..9), &errors(9..15), &LOWER, &few).unwrap();
    assert_eq!(found.design.locations, [9, 6]);
}
