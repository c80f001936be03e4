//! A press has the same number everywhere, counted from 1 with the sync presses.

use serde_json::Value;
use skinrig_recorder::SessionReader;

use crate::support::{Lab, SMALL, only, read_json, show, skinrig, text};

/// The press in which a camera loses bytes and that is retaken: the sixth of eight after two sync presses.
const SPOILT: u64 = 8;
/// The press excluded by hand: second location of the first repetition.
const BY_HAND: u64 = 4;

fn find(rows: &Value, number: u64) -> Value {
    let rows = rows.as_array().unwrap();
    rows.iter().find(|r| r["press"] == number).unwrap().clone()
}

/// Asserts that the text has no press, repetition or location 0.
fn counts_from_one(text: &str) {
    for nothing in ["press 0", "repetition 0", "rep 0", "location 0", "press 0:"] {
        let found = text.find(nothing).map(|at| {
            let from = text[..at].rfind('\n').map_or(0, |n| n + 1);
            text[from..].lines().next().unwrap_or_default()
        });
        assert_eq!(found, None, "{nothing}");
    }
}

#[test]
fn a_press_has_one_number_everywhere() {
    let lab = Lab::new();
    let folder = lab.path("a");
    let run = skinrig(&[
        "-v",
        "run",
        SMALL,
        "--sessions",
        &text(&folder),
        "--fault",
        &format!("camera1-drops@hold:{SPOILT}"),
        "--set",
        &format!("analysis.exclude_press_numbers=[{BY_HAND}]"),
    ])
    .code(0);
    let session = only(&folder, ".session.sqlite");
    let s = text(&session);
    // Progress: the spoiled press is the eighth of ten.
    assert!(run.err.contains(&format!("press {SPOILT}/10")), "{run:#?}");
    counts_from_one(&run.err);
    // The terminal's table names the replaced attempt.
    assert!(run.out.contains(&format!("press {SPOILT}: ")), "{run:#?}");
    counts_from_one(&run.out);

    // `show`, as text and as JSON.
    let shown = show(&session);
    let numbers: Vec<u64> = (shown["presses"].as_array().unwrap().iter())
        .map(|p| p["press"].as_u64().unwrap())
        .collect();
    assert_eq!(numbers, (1..=10).collect::<Vec<_>>());
    let corrupted = find(&shown["presses"], SPOILT);
    assert_eq!(
        corrupted["earlier"].as_array().unwrap().len(),
        1,
        "{corrupted}"
    );
    assert_eq!(
        (&corrupted["repetition"], &corrupted["location"]),
        (&2.into(), &2.into())
    );
    let table = skinrig(&["show", "--presses", &s]).code(0).out;
    let row = |number: u64| {
        let mut words = table
            .lines()
            .map(|l| l.split_whitespace().collect::<Vec<_>>());
        let number = number.to_string();
        let found = words.find(|w| w.len() > 6 && w[0] == number && w[1] != "planned");
        found.unwrap()
    };
    assert_eq!(row(SPOILT)[1..4], ["score", "2", "2"], "{table}");
    counts_from_one(&table);

    // `status`: the last five outcomes include the spoiled press.
    let status = skinrig(&["status", &s]).code(0).out;
    assert!(
        status.contains(&format!("          press {SPOILT}, attempt 2 valid")),
        "{status}"
    );
    counts_from_one(&status);
    let status = skinrig(&["--json", "status", &s]).code(0).json();
    find(&status["last_outcomes"], SPOILT);

    // The results and the page.
    let results = read_json(&only(&folder, ".results.json"));
    assert_eq!(results["provenance"]["retaken"][0]["press"], SPOILT);
    let found = &results["analysis"]["presses"];
    assert_eq!(found[0]["press"], 1);
    let excluded = find(found, BY_HAND);
    assert_eq!(excluded["rule"], "by hand", "{excluded}");
    assert_eq!(
        (&excluded["repetition"], &excluded["location"]),
        (&1.into(), &2.into())
    );
    let page = std::fs::read_to_string(only(&folder, ".report.html")).unwrap();
    assert!(page.contains(&format!("press {SPOILT}: ")));
    counts_from_one(&page);

    // The export, and the plan.
    let out = lab.text("out");
    skinrig(&[
        "export", &s, "--to", "csv", "--only", "presses", "--out", &out,
    ])
    .code(0);
    let csv = std::fs::read_to_string(only(&lab.path("out"), ".csv")).unwrap();
    let head: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    let column = |name: &str| head.iter().position(|h| *h == name).unwrap();
    let attempts = csv.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        (
            cells[column("press")].parse::<u64>().unwrap(),
            cells[column("attempts")] == "2",
        )
    });
    let repeated: Vec<u64> = attempts
        .filter(|(_, repeated)| *repeated)
        .map(|(press, _)| press)
        .collect();
    assert_eq!(repeated, [SPOILT]);
    let plan = skinrig(&["--json", "plan", SMALL]).code(0).json();
    assert_eq!(plan["plan"]["presses"][0]["press"], 1);
    let planned = find(&plan["plan"]["presses"], SPOILT);
    assert_eq!(planned["location"], 2);
    let steps = skinrig(&["plan", "--steps", SMALL]).code(0).out;
    assert!(
        steps.contains("press 10 at") && steps.contains("begin of repetition 1"),
        "{steps}"
    );
    counts_from_one(&steps);

    // In the session file it is an index.
    let reader = SessionReader::open(&session).unwrap();
    let (press, attempts) = &reader.presses().unwrap()[SPOILT as usize - 1];
    assert_eq!(
        (press.id.index(), u64::from(press.id.number())),
        (7, SPOILT)
    );
    assert_eq!(attempts.len(), 2);
}

#[test]
fn the_old_zero_based_key_is_refused_with_help() {
    skinrig(&["check", SMALL, "--set", "analysis.exclude_presses=[3, 7]"])
        .code(2)
        .expect_stderr(&["exclude_press_numbers: [4, 8]"]);
    skinrig(&[
        "check",
        SMALL,
        "--set",
        "analysis.exclude_press_numbers=[0]",
    ])
    .code(2);
    let lab = Lab::new();
    let session = lab.record("a", &[]);
    let old = "analysis.exclude_presses=[3]";
    skinrig(&["analyze", &text(&session), "--set", old])
        .code(2)
        .expect_stderr(&["exclude_press_numbers"]);
}
