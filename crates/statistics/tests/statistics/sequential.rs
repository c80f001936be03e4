//! Sequential comparisons of simulated skins: false decisions, coverage at the stop, early stops, and what to expect.
#![expect(clippy::print_stdout, reason = "shows the rates that docs state")]

use skinrig_statistics::{
    AlphaSpending, Comparison, ComparisonTarget, ImprovementDirection, Kind, Outlook, Settings,
    Verdict, compare,
};

use crate::populations::{Draws, SimulatedPair};

const UNPLANNED: AlphaSpending = AlphaSpending {
    planned_looks: None,
};
/// Looks of each run.
const LOOKS: u32 = 5;
/// Draws per look unless its level needs more.
const RESAMPLES: u32 = 199;

/// How a simulated laboratory looks at its data.
#[derive(Clone, Copy)]
enum Rule {
    Spends(AlphaSpending),
    /// 5 % at each look, as if it were the only one.
    Naive,
}

/// Looks after each repetition until one decides; returns the number of the last look and what it found.
fn run(pair: SimulatedPair, margin: Option<f64>, rule: Rule, seed: u64) -> (u32, Comparison) {
    let question = ComparisonTarget {
        better: ImprovementDirection::Lower,
        margin,
    };
    let settings = Settings {
        resamples: RESAMPLES,
        ..Settings::default()
    };
    let looks = pair.draw_looks(&mut Draws::new(17, seed));
    let mut last = None;
    for (look, [a, b]) in (1..).zip(&looks) {
        let own = match rule {
            Rule::Spends(spending) => spending.settings(&settings, look),
            Rule::Naive => Some(settings),
        };
        let Some(own) = own else { break };
        let found = compare(a, b, &question, &own).unwrap();
        let is_decided = found.verdict != Verdict::Undecided;
        last = Some((look, found));
        if is_decided {
            break;
        }
    }
    last.unwrap()
}

fn pair(locations: u32) -> SimulatedPair {
    SimulatedPair {
        locations,
        repetitions: LOOKS,
        ..SimulatedPair::new(Kind::Rms)
    }
}

/// Share of runs that end with one of these verdicts.
fn share(
    runs: u64,
    pair: SimulatedPair,
    margin: Option<f64>,
    rule: Rule,
    wrong: &[Verdict],
) -> f64 {
    let ends = (0..runs).map(|seed| run(pair, margin, rule, seed).1.verdict);
    ends.filter(|v| wrong.contains(v)).count() as f64 / runs as f64
}

const DIFFER: [Verdict; 2] = [Verdict::Better, Verdict::Worse];

fn false_decisions(pair: SimulatedPair, planned_looks: Option<u32>) {
    let rule = Rule::Spends(AlphaSpending { planned_looks });
    let wrong = share(1000, pair, None, rule, &DIFFER);
    println!(
        "{} locations, {} repetitions, planned looks {planned_looks:?}: {wrong}",
        pair.locations, pair.repetitions
    );
    assert!(wrong <= 0.05, "{pair:?}, {planned_looks:?}: {wrong}");
}

#[test]
fn equal_skins_are_told_apart_in_at_most_five_percent_of_a_thousand_runs() {
    false_decisions(pair(24), None);
    false_decisions(pair(9), Some(LOOKS));
    // Looking at each repetition as if it were the only look does not pass.
    let naive = share(1000, pair(24), None, Rule::Naive, &DIFFER);
    println!("each look at 5 %: {naive}");
    assert!(naive > 0.06, "{naive}");
}

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-compare -- --ignored --nocapture false_decision"]
fn false_decision_rates_of_more_looks_and_locations() {
    for locations in [8, 24, 60] {
        for repetitions in [3, 8] {
            for planned_looks in [None, Some(repetitions)] {
                let pair = SimulatedPair {
                    repetitions,
                    ..pair(locations)
                };
                false_decisions(pair, planned_looks);
            }
        }
    }
}

#[test]
fn skins_a_margin_apart_are_called_equivalent_in_at_most_five_percent_of_a_thousand_runs() {
    let pair = pair(24).shifted();
    let [a, b] = pair.truth();
    let rule = Rule::Spends(UNPLANNED);
    let wrong = share(1000, pair, Some(b - a), rule, &[Verdict::Equivalent]);
    println!("a margin apart, called equivalent: {wrong}");
    assert!(wrong <= 0.05, "{wrong}");
}

/// The interval of the look that stopped covers the true difference in 95 % of the runs.
#[test]
fn the_interval_is_valid_at_the_stop() {
    let pair = SimulatedPair {
        shift: 0.3,
        ..pair(24)
    };
    let [a, b] = pair.truth();
    let rule = Rule::Spends(UNPLANNED);
    let ends = (0..300).map(|seed| run(pair, None, rule, seed).1.difference);
    let covered = ends
        .filter(|i| i.low.is_none_or(|l| l <= b - a) && i.high.is_none_or(|h| h >= b - a))
        .count();
    assert!(covered >= 285, "{covered} of 300");
}

/// A clear difference ends most runs before the last repetition.
#[test]
fn a_clear_difference_stops_early() {
    let pair = SimulatedPair {
        shift: 1.2,
        ..pair(24)
    };
    let ends: Vec<(u32, Verdict)> = (0..200)
        .map(|seed| run(pair, None, Rule::Spends(UNPLANNED), seed))
        .map(|(look, found)| (look, found.verdict))
        .collect();
    let right = ends.iter().filter(|e| e.1 == Verdict::Worse).count();
    let looks = ends.iter().map(|e| f64::from(e.0)).sum::<f64>() / 200.0;
    assert!(
        right >= 160 && looks < 0.5 * f64::from(LOOKS),
        "{right} of 200, {looks} looks"
    );
}

#[test]
fn the_levels_add_up_to_alpha() {
    for planned_looks in [None, Some(1), Some(7), Some(100)] {
        let spending = AlphaSpending { planned_looks };
        let sum: f64 = (0..=120).map(|look| spending.at(0.05, look)).sum();
        assert!(
            sum <= 0.05 + 1e-12 && sum > 0.049,
            "{planned_looks:?}: {sum}"
        );
    }
    let three = AlphaSpending {
        planned_looks: Some(3),
    };
    assert!(three.settings(&Settings::default(), 3).is_some());
    assert!(three.settings(&Settings::default(), 4).is_none());
    // Every level leaves draws outside its interval.
    for look in [1, 5, 40, 100] {
        let own = UNPLANNED.settings(&Settings::default(), look).unwrap();
        assert!(f64::from(own.resamples) * 0.5 * own.alpha >= 4.0);
    }
}

/// Told to take n more repetitions, most runs decide within them; a difference that varies between locations is not a matter of
/// repetitions.
#[test]
fn the_outlook_comes_true() {
    let pair = SimulatedPair {
        shift: 0.55,
        ..pair(40)
    };
    let settings = Settings {
        resamples: RESAMPLES,
        ..Settings::default()
    };
    let question = ComparisonTarget {
        better: ImprovementDirection::Lower,
        margin: None,
    };
    let (mut told, mut hopeless) = (0, 0);
    for seed in 0..100 {
        let looks = pair.draw_looks(&mut Draws::new(23, seed));
        let [a, b] = &looks[1];
        let own = UNPLANNED.settings(&settings, 2).unwrap();
        let found = compare(a, b, &question, &own).unwrap();
        match UNPLANNED.outlook(&found, 2, &settings) {
            Outlook::More { repetitions } => {
                assert!(repetitions > 0);
                told += 1;
            }
            Outlook::NotByRepetitions => hopeless += 1,
            Outlook::Decided => assert_ne!(found.verdict, Verdict::Undecided),
            other => panic!("{other:?}"),
        }
        let [a, b] = &looks[0];
        let own = UNPLANNED.settings(&settings, 1).unwrap();
        let found = compare(a, b, &question, &own).unwrap();
        if found.verdict == Verdict::Undecided {
            assert_eq!(UNPLANNED.outlook(&found, 1, &settings), Outlook::Unknown);
        }
        let single = AlphaSpending {
            planned_looks: Some(1),
        };
        if found.verdict == Verdict::Undecided {
            assert_eq!(single.outlook(&found, 1, &settings), Outlook::Spent);
        }
    }
    assert!(hopeless > 20, "{told} {hopeless}");
}
