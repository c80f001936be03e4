//! Solves all problems, checks every result, and keeps the table of `README.md`.
//!
//! With `SKINRIG_WRITE_DOCS=1` the tests write the table instead of comparing it.

use std::fmt::Write as _;

use crate::digits::{digits, required};
use crate::problem::{Family, Problem, Solution, family, folder};
use crate::{calibration, clocks, clusters, fields, quantiles, sums, triangulation};

/// Families in the order of the table.
pub(crate) const FAMILIES: [&str; 7] = [
    "triangulation",
    "calibration",
    "clocks",
    "clusters",
    "fields",
    "quantiles",
    "sums",
];

const BEGIN: &str = "<!-- the table is written by tests/certified/table.rs -->\n";
const END: &str = "<!-- end of the table -->";
const NEXT: &str = "SKINRIG_WRITE_DOCS=1 cargo test -p skinrig-certified";

/// (level, solution) of a problem; several levels for several starts.
fn solutions<'a>(family: &str, problem: &'a Problem, long: bool) -> Vec<(&'a str, Solution)> {
    let one = match family {
        "triangulation" => triangulation::solve(problem),
        "clocks" => clocks::solve(problem),
        "clusters" => clusters::solve(problem),
        "fields" => fields::solve(problem),
        "quantiles" => quantiles::solve(problem),
        "sums" => sums::solve(problem, long),
        "calibration" => {
            let starts = calibration::STARTS.into_iter();
            return starts
                .map(|start| (start, calibration::solve(problem, start)))
                .collect();
        }
        other => panic!("unknown family {other}"),
    };
    vec![(problem.level.as_str(), one)]
}

/// Fewest digits over the answers, with the largest condition number; what is wrong goes to `wrong`.
fn judge(problem: &Problem, values: &[(&str, f64)], wrong: &mut Vec<String>) -> (f64, f64) {
    let (mut fewest, mut condition) = (15.0f64, 0.0f64);
    for answer in &problem.answers {
        let found = values.iter().find(|v| v.0 == answer.quantity).unwrap().1;
        let (has, needs) = (digits(found, answer), required(answer));
        if has < needs {
            wrong.push(format!(
                "{}, {}: expected {} to {needs:.1} digits, found {found:e}: {has:.1}",
                problem.name, answer.quantity, answer.value
            ));
        }
        fewest = fewest.min(has);
        condition = condition.max(answer.condition);
    }
    (fewest, condition)
}

/// Rows of a family. Rows of problems that take long are those of `documented` unless `long`.
fn rows(all: &Family, documented: &str, long: bool, wrong: &mut Vec<String>) -> String {
    let mut rows = String::new();
    for problem in &all.problems {
        for (level, solution) in solutions(&all.family, problem, long) {
            let head = format!("| {} | {} | {level} | ", all.family, problem.name);
            let (outcome, values, refusal) = match &solution {
                Solution::Values(values) => ("solved", values, ""),
                Solution::Refused(outcome, name, values) => (outcome.as_str(), values, *name),
                Solution::Skipped => {
                    let row = documented.lines().find(|row| row.starts_with(&head));
                    let row =
                        row.map_or_else(|| format!("{head}not measured | | |"), str::to_owned);
                    let _ = writeln!(rows, "{row}");
                    continue;
                }
            };
            if outcome != problem.outcome {
                let (name, expected) = (&problem.name, &problem.outcome);
                wrong.push(format!(
                    "{name}, {level}: expected {expected}, found {solution:?}"
                ));
                continue;
            }
            let (fewest, condition) = judge(problem, values, wrong);
            let _ = write!(rows, "{head}");
            if problem.answers.is_empty() {
                let _ = writeln!(rows, "| | {outcome}: `{refusal}` |");
                continue;
            }
            let _ = write!(rows, "{condition:e} | {} | ", fewest.floor());
            let _ = if refusal.is_empty() {
                writeln!(rows, "|")
            } else {
                writeln!(rows, "{outcome}: `{refusal}` |")
            };
        }
    }
    rows
}

/// Checks all problems, and compares the table with the documented one.
fn check(long: bool) {
    let path = folder().join("README.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once(BEGIN).unwrap();
    let (documented, after) = rest.split_once(END).unwrap();
    let families = FAMILIES.map(family);
    let problems = || families.iter().flat_map(|f| &f.problems);
    let answers: usize = problems().map(|p| p.answers.len()).sum();
    let mut table = format!(
        "{} problems, {answers} certified answers.\n\n\
         | family | problem | level, start | condition | digits | refused |\n|---|---|---|---|---|---|\n",
        problems().count()
    );
    let mut wrong = Vec::new();
    for family in &families {
        table += &rows(family, documented, long, &mut wrong);
    }
    assert!(wrong.is_empty(), "too few digits:\n{}", wrong.join("\n"));
    if std::env::var_os("SKINRIG_WRITE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{table}{END}{after}")).unwrap();
    } else {
        assert_eq!(
            documented, table,
            "README.md is not up to date; next: {NEXT}"
        );
    }
}

#[test]
fn every_well_posed_problem_has_its_digits_and_the_rest_is_refused() {
    check(false);
}

#[test]
#[ignore = "a minute or two: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-certified -- --ignored"]
fn so_have_sums_of_a_thousand_million_terms() {
    check(true);
}
