//! Every case of the battery, for a sample of seeds: none is valid with a wrong result.

#![expect(clippy::print_stdout, reason = "outcomes are printed with --nocapture")]

use rayon::prelude::*;
use skinrig_model::{AnalysisSettings, WindowAnchor};
use skinrig_wrong_inputs::cases::{Case, all};
use skinrig_wrong_inputs::judge::{Allowed, CaseVerdict, Observed, judge};

/// Outcome of a case, as a line of the printed summary.
fn row(case: &Case, judged: &CaseVerdict) -> String {
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

const BEGIN: &str = "<!-- the list is written by tests/wrong_inputs/tests/battery.rs -->\n";
const END: &str = "<!-- end of the list -->";

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
    let judged: Vec<(Case, u64, CaseVerdict)> = cases
        .into_par_iter()
        .map(|(case, seed)| {
            let judged = judge(&case, seed, |_| {});
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

type Change = fn(&mut AnalysisSettings);

/// Legal settings with which an analysis sees little of the recording.
const UNUSUAL: [(&str, Change); 7] = [
    ("windows about the middle", |s| {
        s.window_anchor = WindowAnchor::Middle;
    }),
    ("windows that end at the contact", |s| {
        s.window_after_contact_ms = Some(1.0);
    }),
    ("one event of 64", |s| s.thinning = 64),
    ("rates drawn in bins of 2 s", |s| s.rate_bin_ms = 2_000.0),
    ("clusters of a small radius", |s| s.eps_px = 2.0),
    ("clusters of a large radius", |s| s.eps_px = 50.0),
    ("coarse pixels, one window of 3 s", |s| {
        (s.bin_px, s.window_before_ms) = (16, 3_000.0);
    }),
];

/// Judges the cases, each with the unusual settings that `with` accepts by their number and that of the case.
fn failures_with_unusual_settings(with: fn(usize, usize) -> bool) -> Vec<String> {
    let cases: Vec<(usize, Case)> = all().into_iter().enumerate().collect();
    let cases = cases.into_par_iter().flat_map_iter(|(i, case)| {
        let chosen = (0..UNUSUAL.len()).filter(move |k| with(i, *k));
        chosen.map(move |k| (case.clone(), k))
    });
    cases
        .filter_map(|(case, k)| {
            let (name, change) = UNUSUAL[k];
            // As a variant of the analysis, and for sound recordings as their own settings too.
            let is_sound = case.allowed == [Allowed::Right];
            let variant = judge(&case, 0, |input| {
                input.recorded_settings = Some(input.settings.clone());
                change(&mut input.settings);
            });
            let own = is_sound.then(|| judge(&case, 0, |input| change(&mut input.settings)));
            let unknowable = case
                .allowed
                .iter()
                .any(|a| matches!(a, Allowed::Unknowable(_)));
            let is_wrong = |judged: &CaseVerdict| match judged.observed {
                Observed::Wrong(_) => !unknowable,
                // The settings of an analysis are no fault of a recording.
                Observed::Misnamed(_) | Observed::Named(..) => is_sound,
                Observed::Right | Observed::Refused(_) => false,
            };
            let judged = own.into_iter().chain([variant]).find(is_wrong)?;
            Some(format!("{}: {}, {name}: {judged}", case.group, case.name))
        })
        .collect()
}

#[test]
fn settings_of_the_analysis_hide_no_fault_and_cause_none() {
    let failures = failures_with_unusual_settings(|case, k| case % (4 * UNUSUAL.len()) == k);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
#[ignore = "every case with each of the settings takes minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-wrong-inputs -- --ignored"]
fn nor_does_any_setting_with_any_case() {
    let failures = failures_with_unusual_settings(|_, _| true);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The cases in `README.md`. Cases of a group that allow the same outcomes share a line.
fn list() -> String {
    let mut rows: Vec<(&str, String, String)> = Vec::new();
    for case in all() {
        let mut allowed = case.allowed.clone();
        allowed.sort_by_key(|a| match a {
            Allowed::Right => (0, ""),
            Allowed::Named(fault) => (1, fault.name()),
            Allowed::Unknowable(_) => (2, ""),
            Allowed::Refused => (3, ""),
        });
        let outcomes: Vec<String> = allowed
            .iter()
            .map(|a| match a {
                Allowed::Right => "right".to_owned(),
                Allowed::Named(fault) => fault.name().to_owned(),
                Allowed::Unknowable(_) => "unknown".to_owned(),
                Allowed::Refused => "refused".to_owned(),
            })
            .collect();
        let outcomes = outcomes.join("; ");
        match rows
            .iter_mut()
            .find(|(group, _, same)| *group == case.group && *same == outcomes)
        {
            Some((_, names, _)) => {
                names.push_str("; ");
                names.push_str(case.name);
            }
            None => rows.push((case.group, case.name.to_owned(), outcomes)),
        }
    }
    let mut list = String::new();
    let mut last = "";
    for (group, names, outcomes) in rows {
        if group != last {
            list.push_str(&format!("\n### {group}\n\n"));
        }
        list.push_str(&format!("- **{outcomes}**: {names}\n"));
        last = group;
    }
    list.push('\n');
    list
}

/// With `SKINRIG_WRITE_DOCS=1` writes the list instead of comparing it.
#[test]
fn the_documented_list_is_this_one() -> std::io::Result<()> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
    let page = std::fs::read_to_string(path)?;
    let (before, rest) = page.split_once(BEGIN).unwrap_or_default();
    let (documented, after) = rest.split_once(END).unwrap_or_default();
    let list = list();
    if std::env::var_os("SKINRIG_WRITE_DOCS").is_some() {
        return std::fs::write(path, format!("{before}{BEGIN}{list}{END}{after}"));
    }
    let next = "SKINRIG_WRITE_DOCS=1 cargo test -p skinrig-wrong-inputs documented";
    assert_eq!(documented, list, "{path} is not up to date; next: {next}");
    Ok(())
}

#[test]
fn the_page_for_users_names_every_finding() {
    let page = include_str!("../../../docs/reference/wrong-inputs.md");
    let cases = all();
    let named = cases.iter().flat_map(|case| &case.allowed);
    let missing: Vec<&str> = named
        .filter_map(|allowed| match allowed {
            Allowed::Named(fault) => Some(fault.name()),
            _ => None,
        })
        .filter(|name| !page.contains(name))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}
