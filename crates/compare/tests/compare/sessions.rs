//! Skins with one and with several sessions.
#![expect(clippy::unwrap_used, reason = "tests")]

use skinrig_compare::{Comparison, ComparisonOptions, NoResult, Subject, compare};
use skinrig_statistics::{AlphaSpending, Interval, Verdict};

use crate::causes::planted::{PlantedCause, record};

/// A skin with these sessions.
fn skin(letter: char, sessions: &[&Subject]) -> Subject {
    Subject {
        letter,
        name: letter.to_string(),
        sessions: sessions.iter().flat_map(|s| s.sessions.clone()).collect(),
    }
}

/// Sessions of A and B behind the spread between sessions, by metric; `None` if it is unknown.
fn sessions(of: &Comparison) -> Vec<Option<[u32; 2]>> {
    let compared = of.table.iter().filter_map(|row| {
        let found = row.against_first.first().unwrap().comparison.as_ref()?;
        Some(found.components.sessions.map(|s| s.sessions))
    });
    compared.collect()
}

#[test]
fn sessions_of_each_skin_are_told_apart() {
    let [one, two, three, four] =
        [1, 2, 3, 4].map(|seed| record(seed, PlantedCause::Nothing).skin('A', None));
    let [one, two, three, four] = [&one, &two, &three, &four];
    let compared = |a: &[&Subject], b: &[&Subject]| {
        let options = ComparisonOptions::default();
        compare(&[skin('A', a), skin('B', b)], &vec![None], &options)
    };
    let is_confounded = |of: &Comparison| of.differences.iter().any(|d| d.key == "mounting");

    let single = compared(&[one], &[three]);
    assert!(is_confounded(&single), "{:#?}", single.differences);
    assert!(sessions(&single).iter().all(Option::is_none));

    for (a, b, expected) in [
        (&[one, two][..], &[three, four][..], [2, 2]),
        (&[one], &[two, three, four], [1, 3]),
    ] {
        let several = compared(a, b);
        assert!(!is_confounded(&several), "{:#?}", several.differences);
        let found = sessions(&several);
        assert!(found.len() > 5, "{found:?}");
        assert!(found.iter().all(|s| *s == Some(expected)), "{found:?}");
    }
}

/// An interval that excludes no difference beside "undecided" would be of one comparison alone.
#[test]
fn intervals_of_several_skins_hold_together_like_their_verdicts() {
    let skins: Vec<Subject> = (1..=4)
        .map(|seed| record(seed, PlantedCause::Nothing).skin('A', None))
        .zip('A'..)
        .map(|(of, letter)| skin(letter, &[&of]))
        .collect();
    let metrics = 20;
    let all = compare(&skins, &vec![None; metrics], &ComparisonOptions::default());
    let pair = compare(
        &skins[..2],
        &vec![None; metrics],
        &ComparisonOptions::default(),
    );
    let mut wider = 0;
    for (row, alone) in all.table.iter().zip(&pair.table) {
        let (found, alone) = (&row.against_first[0], &alone.against_first[0]);
        let Some((together, alone)) = found.difference().zip(alone.difference()) else {
            continue;
        };
        let width = |of: &Interval| Some(of.high? - of.low?);
        let (of_all, of_pair) = (width(&together), width(&alone));
        if let Some((of_all, of_pair)) = of_all.zip(of_pair) {
            assert!(of_all >= of_pair, "{}", row.name);
            wider += usize::from(of_all > of_pair);
        }
        let excludes =
            together.low.is_some_and(|l| l > 0.0) || together.high.is_some_and(|h| h < 0.0);
        let is_undecided = found.verdict == Some(Verdict::Undecided);
        assert!(!(excludes && is_undecided), "{}: {together:?}", row.name);
    }
    assert!(wider > 5, "{wider}");
}

/// One session of a skin does not tell how much sessions vary.
#[test]
fn looks_begin_with_the_second_session() {
    let [one, two, three, four] =
        [1, 2, 3, 4].map(|seed| record(seed, PlantedCause::Nothing).skin('A', None));
    let options = ComparisonOptions {
        sequential: Some(AlphaSpending {
            planned_looks: None,
        }),
        ..ComparisonOptions::default()
    };
    let looked = |a: &[&Subject], b: &[&Subject]| {
        let found = compare(&[skin('A', a), skin('B', b)], &vec![None], &options);
        let looks = found.sequential.unwrap().looks;
        let taken: Vec<u32> = looks
            .iter()
            .filter(|look| look.refused.is_none())
            .map(|look| look.repetitions)
            .collect();
        (taken, looks)
    };
    // Two scored repetitions a session.
    let (taken, looks) = looked(&[&one, &two], &[&three, &four]);
    assert_eq!(taken.first(), Some(&3), "{looks:#?}");
    assert_eq!(looks[0].refused, Some(NoResult::OneSession));
    assert_eq!(looks[0].verdict, None);
    // What the first two did not spend is spent by the third.
    let spent = |look: &skinrig_compare::Look| [look.alpha, look.spent];
    assert_eq!(spent(&looks[1]), [0.0; 2]);
    let three_looks = 0.05 * (1.0 / 2.0 + 1.0 / 6.0 + 1.0 / 12.0);
    assert!((looks[2].alpha - three_looks).abs() < 1e-12, "{looks:#?}");
    assert!((looks[2].spent - three_looks).abs() < 1e-12, "{looks:#?}");
    let found = compare(
        &[skin('A', &[&one]), skin('B', &[&three, &four])],
        &vec![None],
        &options,
    );
    let reason = &found.table[0].against_first[0].error;
    assert_eq!(*reason, Some(NoResult::OneSession));
    let (taken, looks) = looked(&[&one], &[&three, &four]);
    assert_eq!(taken, [0; 0], "{looks:#?}");
    let (taken, looks) = looked(&[&one], &[&three]);
    assert_eq!(taken.first(), Some(&1), "{looks:#?}");
}
