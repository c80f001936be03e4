//! What two samples say about each other, and why they may say nothing.

use skinrig_compare::statistics::{
    Better, Question, Refusal, Sample, Settings, Verdict, compare, estimate,
};

const LOWER: Question = Question {
    better: Better::Lower,
    margin: Some(0.5),
};

/// Errors of 20 locations with 3 repetitions, `shift` added to all.
fn errors(shift: f64) -> Sample {
    let value = |i: u32, r: u32| 2.0 + shift + 0.05 * f64::from((7 * i + 3 * r) % 11);
    Sample::rms((0..20).flat_map(|i| (0..3).map(move |r| (i, value(i, r + i * r))))).unwrap()
}

#[test]
fn a_skin_that_errs_less_is_better() {
    let settings = Settings::default();
    let far = compare(&errors(0.0), &errors(-1.0), &LOWER, &settings);
    assert_eq!(far, far.clone());
    let better = compare(&errors(1.0), &errors(0.1), &LOWER, &settings).unwrap();
    assert_eq!(better.verdict, Verdict::Better);
    let alone = estimate(&errors(0.1), &settings).unwrap();
    assert!((alone.value - better.b.value).abs() < 1e-12);
}

#[test]
fn nothing_to_compare_has_its_reason() {
    let settings = Settings::default();
    let empty = Sample::rms([]).unwrap();
    let found = compare(&errors(0.0), &empty, &LOWER, &settings).unwrap_err();
    assert!(matches!(found, Refusal::Empty { .. }), "{found}");
    let same = compare(&errors(0.0), &errors(0.0), &LOWER, &settings).unwrap_err();
    assert!(matches!(same, Refusal::NoSpread { .. }), "{same}");
}
