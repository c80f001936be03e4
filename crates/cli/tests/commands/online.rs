//! `skinrig online`: what a replay prints, and sessions that it cannot learn from.

use serde_json::Value;

use crate::support::{Lab, skinrig, text};

/// Three repetitions calibrate, one scores.
fn session(lab: &Lab) -> String {
    text(&lab.record(
        "s",
        &[
            "--set",
            "repetitions.count=4",
            "--set",
            "evaluation.calibrate=[1, 2, 3]",
            "--set",
            "evaluation.score=[4]",
            "--set",
            "analysis.calibration=positions",
            "--set",
            "analysis.bootstrap_resamples=50",
        ],
    ))
}

#[test]
fn a_replay_gives_a_line_per_estimate_or_twelve_at_most() {
    let lab = Lab::new();
    let session = session(&lab);
    let short = skinrig(&["online", &session, "--stop-at", "20ms"])
        .code(0)
        .out;
    assert!(short.lines().count() <= 12, "{short}");
    assert!(
        short.contains("offline   18 of 18 press windows"),
        "{short}"
    );

    let lines = skinrig(&["--json", "online", &session, "--stop-at", "2mm"])
        .code(0)
        .out;
    let rows: Vec<Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let (summary, estimates) = rows.split_last().unwrap();
    let summary = &summary["summary"];
    assert_eq!(summary["windows"], summary["windows_equal_to_analysis"]);
    assert_eq!(summary["felt"]["presses"], 4);
    let times: Vec<i64> = estimates
        .iter()
        .map(|e| e["t_us"].as_i64().unwrap())
        .collect();
    assert!(times.is_sorted() && times.len() > 100, "{}", times.len());
    let felt = |what: &str| estimates.iter().filter(|e| e["felt"] == what).count();
    assert!(
        felt("onset") >= felt("release") && felt("release") >= 15,
        "{short}"
    );
}

#[test]
fn a_session_without_calibration_presses_teaches_nothing() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    skinrig(&["online", &session]).code(2).expect_stderr(&[
        "expected at least 8 valid calibration presses",
        "next: `skinrig show",
    ]);
    skinrig(&["online", &session, "--stop-at", "2"]).code(2);
    skinrig(&["online", &session, "--speed", "0"]).code(2);
}
