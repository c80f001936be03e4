//! Tests comparisons of several prototypes at once.

use skinrig_statistics::{
    ComparisonError, ComparisonTarget, ImprovementDirection, Pair, PairSelection, Sample, Settings,
    Verdict, compare_all,
};

use crate::populations::Draws;

const QUESTION: ComparisonTarget = ComparisonTarget {
    better: ImprovementDirection::Lower,
    margin: None,
};

fn settings() -> Settings {
    Settings {
        resamples: 999,
        ..Settings::default()
    }
}

/// Skins pressed at the same 12 locations, each worse than the first by its shift.
fn skins(seed: u64, shifts: &[f64]) -> Vec<Sample> {
    let mut draws = Draws::new(11, seed);
    let shared: Vec<f64> = (0..12).map(|_| draws.normal()).collect();
    let skin = |shift: &f64| {
        let mut values = Vec::new();
        for (location, place) in (0..).zip(&shared) {
            let own = 0.6 * draws.normal();
            values.extend((0..3).map(|_| (location, shift + place + own + 0.3 * draws.normal())));
        }
        Sample::mean(values).unwrap()
    };
    shifts.iter().map(skin).collect()
}

fn claims(pairs: &[Pair], adjusted: bool) -> bool {
    pairs.iter().any(|p| {
        let alone = p.alone.as_ref().unwrap().verdict;
        let verdict = if adjusted {
            p.adjusted.unwrap().verdict
        } else {
            alone
        };
        verdict != Verdict::Undecided
    })
}

#[test]
fn a_false_claim_among_many_pairs_stays_rare() {
    let families = 200u32;
    let (mut adjusted, mut alone, mut missed) = (0.0, 0.0, 0.0);
    for seed in 0..families {
        let pairs = compare_all(
            &skins(seed.into(), &[0.0; 4]),
            PairSelection::All,
            &QUESTION,
            &settings(),
        )
        .unwrap();
        assert_eq!(pairs.len(), 6);
        adjusted += f64::from(u8::from(claims(&pairs, true)));
        alone += f64::from(u8::from(claims(&pairs, false)));
        let wrong = pairs.iter().any(|p| {
            let i = p.adjusted.unwrap().simultaneous;
            i.low.unwrap() > 0.0 || i.high.unwrap() < 0.0
        });
        missed += f64::from(u8::from(wrong));
    }
    let n = f64::from(families);
    let most = 0.05 + 3.0 * (0.05 * 0.95 / n).sqrt();
    assert!(
        adjusted / n < most && missed / n < most,
        "{adjusted} {missed}"
    );
    assert!(alone / n > most, "uncorrected: {alone}");
}

#[test]
fn a_family_against_a_reference_finds_the_worse_one() {
    let pairs = compare_all(
        &skins(1, &[0.0, 0.0, 3.0]),
        PairSelection::Reference(0),
        &QUESTION,
        &settings(),
    )
    .unwrap();
    let of: Vec<(usize, usize)> = pairs.iter().map(|p| (p.a, p.b)).collect();
    assert_eq!(of, [(0, 1), (0, 2)]);
    assert_eq!(pairs[1].adjusted.unwrap().verdict, Verdict::Worse);
    for pair in &pairs {
        let (alone, among) = (pair.alone.as_ref().unwrap(), pair.adjusted.unwrap());
        assert!(among.p_difference >= alone.p_difference);
        assert!(among.simultaneous.low < alone.difference.low);
        assert!(among.simultaneous.high > alone.difference.high);
    }
}

#[test]
fn incomparable_samples_are_left_out() {
    let mut skins = skins(1, &[0.0, 3.0]);
    skins.push(Sample::mean([]).unwrap());
    let pairs = compare_all(&skins, PairSelection::All, &QUESTION, &settings()).unwrap();
    assert_eq!(pairs[0].adjusted.unwrap().family, 1);
    for pair in &pairs[1..] {
        assert!(
            matches!(pair.alone, Err(ComparisonError::Empty { .. })),
            "{pair:?}"
        );
        assert_eq!(pair.adjusted, None);
    }
    let one = compare_all(&skins[..1], PairSelection::All, &QUESTION, &settings());
    assert!(matches!(one, Err(ComparisonError::Setting { .. })));
    let nobody = compare_all(&skins, PairSelection::Reference(3), &QUESTION, &settings());
    assert!(matches!(nobody, Err(ComparisonError::Setting { .. })));
}
