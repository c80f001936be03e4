//! Every case of the battery, for a sample of seeds: none is valid with a wrong result.

#![expect(clippy::print_stdout, reason = "the table of the documentation")]

use rayon::prelude::*;
use skinrig_wrong_inputs::cases::{Case, all};
use skinrig_wrong_inputs::judge::{Allowed, Judged, Observed, judge};

/// A row of the table in `docs/reference/wrong-inputs.md`.
fn row(case: &Case, judged: &Judged) -> String {
    let unknowable = case.allowed.iter().find_map(|allowed| match allowed {
        Allowed::Unknowable(why) => Some(*why),
        _ => None,
    });
    let outcome = match (&judged.observed, unknowable) {
        (Observed::Named(fault, false), _) => format!("named: {}; INVALID", fault.name()),
        (Observed::Named(fault, true), _) => {
            format!("named: {}; the number is right", fault.name())
        }
        (Observed::Refused(_), _) => "refused".to_owned(),
        (Observed::Right, None) => "the number is right".to_owned(),
        (_, Some(why)) => format!("cannot be known: {why}"),
        (other, None) => format!("{other:?}"),
    };
    format!("| {} | {} | {outcome} |", case.group, case.name)
}

/// True unless the number is right or withheld. With other noise a fault may stay below what names it, or an alignment below
/// its odds: neither claims anything wrong.
const fn is_unsafe(observed: &Observed) -> bool {
    !matches!(observed, Observed::Right | Observed::Refused(_))
}

/// Runs every case with this many seeds; returns failures with their outcome.
fn failures(seeds: u64) -> Vec<String> {
    let only = std::env::var("ONLY").unwrap_or_default();
    let cases: Vec<(Case, u64)> = all()
        .into_iter()
        .filter(|case| case.name.contains(&only))
        .flat_map(|case| (0..seeds).map(move |seed| (case.clone(), seed)))
        .collect();
    let judged: Vec<(Case, u64, Judged)> = cases
        .into_par_iter()
        .map(|(case, seed)| {
            let judged = judge(&case, seed);
            (case, seed, judged)
        })
        .collect();
    let deviating = judged.iter().filter(|(.., judged)| !judged.holds).count();
    println!("{deviating} of {} not as the case allows", judged.len());
    for (case, _, judged) in judged.iter().filter(|(_, seed, _)| *seed == 0) {
        println!("{}", row(case, judged));
    }
    judged
        .into_iter()
        .filter(|(_, seed, judged)| !judged.holds && (*seed == 0 || is_unsafe(&judged.observed)))
        .map(|(case, seed, judged)| {
            format!(
                "{}: {}, seed {seed}: allowed {:?}, came out {judged}",
                case.group, case.name, case.allowed
            )
        })
        .collect()
}

#[test]
fn no_wrong_input_ends_valid_with_a_wrong_number() {
    assert!(all().len() >= 60, "{}", all().len());
    let failures = failures(1);
    assert!(
        failures.is_empty(),
        "{} fail:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

#[test]
#[ignore = "ten seeds of every case take minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-wrong-inputs -- --ignored; ONLY=text takes the cases with it in their name"]
fn nor_does_any_of_ten_seeds() {
    let failures = failures(10);
    assert!(
        failures.is_empty(),
        "{} fail:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

#[test]
fn every_case_stands_in_the_table_of_the_docs() {
    let page = include_str!("../../../docs/reference/wrong-inputs.md");
    for case in all() {
        let row = format!("| {} | {} | ", case.group, case.name);
        assert!(
            page.contains(&row),
            "docs/reference/wrong-inputs.md lacks: {row}"
        );
    }
}
