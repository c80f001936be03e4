//! A campaign that ends by itself: session, results, texts, resume and replay.

use std::path::PathBuf;

use serde_json::Value;
use skinrig_recorder::SessionReader;

use crate::replay::assert_replays;
use crate::support::{Lab, SMALL, only, read_json, show, skinrig, text};

/// The small campaign with two more scored repetitions, and a question.
fn run(lab: &Lab, folder: &str, stop: &str) -> (PathBuf, String) {
    run_with(lab, folder, stop, &[])
}

/// The same, with more arguments.
fn run_with(lab: &Lab, folder: &str, stop: &str, more: &[&str]) -> (PathBuf, String) {
    let sessions = lab.text(folder);
    let stop = format!("stop={stop}");
    let arguments = [
        "run",
        SMALL,
        "--sessions",
        &sessions,
        "--set",
        "repetitions.count=4",
        "--set",
        "evaluation.score=[1-4]",
        "--set",
        &stop,
    ];
    let output = skinrig(&[&arguments[..], more].concat()).code(0);
    (only(&lab.path(folder), ".session.sqlite"), output.out)
}

fn results(lab: &Lab, folder: &str) -> Value {
    read_json(&only(&lab.path(folder), ".results.json"))
}

#[test]
fn a_campaign_ends_with_the_look_that_decides() {
    let lab = Lab::new();
    let (session, output) = run(&lab, "s", "{target: 40 mm, looks: [2, 3, 4]}");
    // Alpha of 5 % over three looks.
    for part in [
        "98.3 % interval",
        "n 8 presses at look 1 of 3",
        "question is decided",
    ] {
        assert!(output.contains(part), "expected {part:?} in {output}");
    }
    assert!(!output.contains("FAULT"), "no press is missing: {output}");
    let shown = show(&session);
    assert_eq!(shown["end"], "stopped");
    let look = &shown["end_cause"]["decided"];
    assert_eq!(
        (&look["number"], &look["answer"]),
        (&1.into(), &"below".into()),
        "{shown}"
    );
    let found = results(&lab, "s");
    let campaign = &found["analysis"]["campaign"];
    assert_eq!(campaign["looks"], serde_json::json!([look]));
    assert_eq!(campaign["decided"], *look);
    assert_eq!(
        campaign["looks"][0]["value_mm"],
        found["analysis"]["scored"]["rmse_mm"]["value"]
    );
    // Everything that reads the RMSE has the interval of the look.
    let rmse = &found["analysis"]["scored"]["rmse_mm"];
    assert_eq!(
        (&rmse["low"], &rmse["high"]),
        (&look["low_mm"], &look["high_mm"])
    );
    let ranked = skinrig(&["prototypes", &lab.text("s"), "--json"]).code(0);
    assert_eq!(ranked.json()[0]["series"][0]["last"], *rmse);
    assert_eq!(found["analysis"]["counts"]["missed"], 8);
    let page = std::fs::read_to_string(only(&lab.path("s"), ".report.html")).unwrap();
    assert!(page.contains("98.3 % interval") && page.contains("at look 1 of 3"));
    skinrig(&["verify", &text(&session)]).code(0);
    let status = skinrig(&["status", &text(&session)]).code(0).out;
    assert!(
        status.contains("question is decided: look 1 of 3"),
        "{status}"
    );
    assert!(!status.contains("resume"), "{status}");
    // Nothing is left to resume.
    let refused = skinrig(&["resume", &text(&session)]);
    assert_ne!(refused.code, Some(3), "{refused:#?}");
    assert_eq!(
        SessionReader::open(&session).unwrap().legs().unwrap().len(),
        1
    );
    // The same seed stops at the same press, and a replay as recorded.
    let (again, _) = run(&lab, "again", "{target: 40 mm, looks: [2, 3, 4]}");
    assert_eq!(show(&again)["end_cause"], shown["end_cause"]);
    assert_replays(&lab, &session, "r");
}

#[test]
fn a_question_about_the_median_gives_the_median_its_interval() {
    let lab = Lab::new();
    let stop = "{metric: median, target: 40 mm, looks: [2, 3, 4]}";
    let (session, _) = run(&lab, "s", stop);
    let scored = &results(&lab, "s")["analysis"]["scored"];
    let look = &show(&session)["end_cause"]["decided"];
    let ends = |of: &Value, low: &str, high: &str| [of[low].clone(), of[high].clone()];
    assert_eq!(
        ends(&scored["median_mm"], "low", "high"),
        ends(look, "low_mm", "high_mm")
    );
    assert_ne!(
        ends(&scored["rmse_mm"], "low", "high"),
        ends(look, "low_mm", "high_mm")
    );
    let shown = skinrig(&["analyze", &text(&session), "-v"]).code(0).out;
    let median = shown.lines().find(|l| l.contains("median error")).unwrap();
    assert!(median.contains("98.3 %"), "{shown}");
}

#[test]
fn a_question_is_not_decided_by_losing_presses() {
    let lab = Lab::new();
    let lost = [
        "--set",
        "analysis.min_cluster_events=5500",
        "--set",
        "analysis.cluster_threshold=fixed",
    ];
    let (session, output) = run_with(&lab, "s", "{target: 40 mm}", &lost);
    assert_eq!(show(&session)["end"], "completed", "{output}");
    let notes = SessionReader::open(&session).unwrap().notes().unwrap();
    let expected = "expected at least half of the attempted scored presses to count, found";
    assert!(
        !notes.is_empty() && notes.iter().all(|n| n.text.contains(expected)),
        "{notes:?}"
    );
    assert!(output.contains("no look found an interval"), "{output}");
}

#[test]
fn an_undecided_campaign_runs_to_its_end() {
    let lab = Lab::new();
    let (session, output) = run(&lab, "s", "{narrower_than: 1e-6 mm}");
    assert!(output.contains("at look 4 of 4"), "{output}");
    let open = "no look found an interval narrower than 0.000001 mm (4 of 4 taken)";
    assert!(output.contains(open), "{output}");
    let shown = show(&session);
    assert_eq!(shown["end"], "completed");
    let campaign = &results(&lab, "s")["analysis"]["campaign"];
    assert_eq!(campaign["looks"].as_array().unwrap().len(), 4);
    assert_eq!(campaign["decided"], Value::Null);
    let notes = SessionReader::open(&session).unwrap().notes().unwrap();
    let looks: Vec<&str> = notes.iter().map(|n| n.text.as_str()).collect();
    assert_eq!(looks.len(), 4, "{looks:?}");
    assert!(looks.iter().all(|l| l.contains("undecided")), "{looks:?}");
}
