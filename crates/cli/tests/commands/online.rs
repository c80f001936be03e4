//! `skinrig online`, and touch felt while recording: what a replay prints, how presses react, sessions without enough to learn from.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use skinrig_model::{TouchEstimate, TouchKind};
use skinrig_recorder::SessionReader;

use crate::python::interpreter;
use crate::support::{Lab, ROOT, SMALL, only, program, skinrig, text};

/// Three repetitions calibrate, one scores.
fn session(lab: &Lab) -> String {
    session_with(lab, &[])
}

/// Its settings.
pub(crate) const USUAL: [&str; 10] = [
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
];

fn session_with(lab: &Lab, more: &[&str]) -> String {
    text(&lab.record("s", &[&USUAL, more].concat()))
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
    // Felt on the way down, or at the full depth of 1.5 mm; onsets count from 1 ms before the contact.
    let (delay, depth) = (&summary["felt"]["delay_ms"], &summary["felt"]["depth_mm"]);
    assert_eq!(depth["n"], delay["n"]);
    for quantile in ["median", "p99"] {
        let mm = depth[quantile].as_f64().unwrap();
        assert!(mm > -0.1 && mm < 1.6, "{quantile}: {mm} mm");
    }
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

/// A simulated session whose scored presses stop when they are felt: the figures in its results, and the same commands again in
/// a replay.
#[test]
fn presses_stop_when_they_are_felt_while_recording() {
    let lab = Lab::new();
    let session = session_with(&lab, &["--set", "online.react.then=stop"]);
    let reader = SessionReader::open(&session).unwrap();
    let touches = reader.touches().unwrap();
    assert_eq!(touches[0].kind, TouchKind::Started);
    let stopped: Vec<_> = touches
        .iter()
        .filter(|t| t.kind == TouchKind::Stopped)
        .collect();
    assert!(!stopped.is_empty());
    let presses = reader.presses().unwrap();
    for touch in &stopped {
        let press = touch.attempt.unwrap().press;
        let (planned, attempts) = presses.iter().find(|(p, _)| p.id == press).unwrap();
        let outcome = attempts[0].outcome.as_ref().unwrap();
        assert!(outcome.measured_depth_mm.unwrap() < planned.depth_mm - 0.1);
    }
    let results = skinrig(&["--json", "analyze", &session]).code(0).out;
    let results: Value = serde_json::from_str(&results).unwrap();
    let results = &results["analysis"];
    let felt = &results["felt"];
    // A press that stops within noise of the surface may be invalid: its phases have no order.
    let carried_out = felt["presses"].as_u64().unwrap();
    assert!((3..=4).contains(&carried_out), "{felt}");
    assert_eq!(felt["reactions"]["reaction"], "stop");
    let reacted = felt["reactions"]["reaction_ms"]["n"].as_u64().unwrap();
    assert!(reacted > 0 && reacted <= stopped.len() as u64, "{felt}");
    let warnings = results["warnings"].to_string();
    assert!(warnings.contains("stopped_when_felt"), "{warnings}");

    // Against a session whose presses went to their depth, the skin would be blamed.
    let usual = text(&lab.record("usual", &[&USUAL[..], &["--seed", "9"]].concat()));
    skinrig(&["compare", &usual, &session])
        .code(2)
        .expect_stderr(&[
            "presses that stopped when they were felt",
            "--despite stopped",
        ]);

    let folder = lab.path("again");
    skinrig(&[
        "run",
        "--replay",
        &session,
        "--sessions",
        &text(&folder),
        "--no-analysis",
    ])
    .code(0);
    let again = SessionReader::open(only(&folder, ".session.sqlite")).unwrap();
    let commands = |reader: &SessionReader| -> Vec<_> {
        let rows = reader.commands().unwrap();
        rows.into_iter().map(|row| (row.t, row.command)).collect()
    };
    assert!(commands(&again) == commands(&reader));
    // A replay has its own turns of the loop, at which it gets an estimate.
    let estimates = |touches: &[TouchEstimate]| -> Vec<_> {
        let parts = touches.iter().filter(|t| t.kind != TouchKind::Started);
        parts
            .map(|t| (t.kind, t.until, t.at_mm, t.region, t.depth))
            .collect()
    };
    assert!(estimates(&again.touches().unwrap()) == estimates(&touches));
}

/// Presses that stop at a felt depth brake before it, by as much as the robot is ahead, and come to rest above their own depth; the session holds the depths that were felt, and its results judge them.
#[test]
fn presses_stop_at_a_depth_that_is_felt() {
    let lab = Lab::new();
    let react = "online.react={then: stop, depth: 0.8 mm}";
    let points = "path.points=[[10 mm, 2 mm], [-10 mm, 18 mm], [0 mm, -18 mm], [25 mm, 17 mm], [5 mm, 20 mm], [-5 mm, -3 mm], [25 mm, -5 mm]]";
    let session = session_with(&lab, &["--set", points, "--set", react]);
    let reader = SessionReader::open(&session).unwrap();
    let touches = reader.touches().unwrap();
    let stopped = touches.iter().filter(|t| t.kind == TouchKind::Stopped);
    let felt_mm: Vec<f64> = stopped.map(|t| t.depth.unwrap().mm).collect();
    assert!(felt_mm.len() >= 7, "{felt_mm:?}");
    // Later presses brake earlier, by how far the first ones went on.
    assert!(
        felt_mm.iter().all(|mm| (0.0..0.8).contains(mm)) && felt_mm[6] < felt_mm[0],
        "{felt_mm:?}"
    );
    let results = skinrig(&["--json", "analyze", &session]).code(0).out;
    let results: Value = serde_json::from_str(&results).unwrap();
    let felt = &results["analysis"]["felt"];
    let reached = felt["reactions"]["depth_mm"]["median"].as_f64().unwrap();
    assert!((0.7..1.45).contains(&reached), "{felt}");
    let count = |key: &str| felt[key].as_u64().unwrap();
    assert!(count("with_depths") >= 7, "{felt}");
    assert!(count("depths_held") + 1 >= count("with_depths"), "{felt}");
    let off_mm = felt["depth_error_mm"]["median"].as_f64().unwrap();
    assert!(off_mm < 0.3, "{felt}");
}

/// The program of `docs/how-to` sends these lines on.
fn sent_over_lsl_and_dds(lab: &Lab, lines: &str) {
    let Some(python) = interpreter() else { return };
    let file = lab.path("touches.jsonl");
    std::fs::write(&file, lines).unwrap();
    let output = Command::new(python)
        .arg(format!("{ROOT}/tests/python/touches.py"))
        .args([file.as_os_str(), lab.path("").as_os_str()])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
}

/// Another program gets what the session records.
#[test]
#[cfg(unix)]
fn another_program_follows_what_is_felt() {
    let lab = Lab::new();
    let place = lab.text("s");
    let mut follower = program(&["watch", &place, "--touches", "--every", "5 ms"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It connects while the run learns, at the latest.
    let mut said = BufReader::new(follower.stderr.take().unwrap());
    let mut waited = String::new();
    said.read_line(&mut waited).unwrap();
    assert!(waited.contains("no run yet"), "{waited}");
    let session = session_with(&lab, &["--set", "online.react.then=lift"]);
    let output = follower.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let facts = |t_s: f64, rest: Value| (format!("{t_s:.6}"), rest.to_string());
    let lines = String::from_utf8(output.stdout).unwrap();
    let followed: Vec<_> = lines
        .lines()
        .map(|line| {
            let line: Value = serde_json::from_str(line).unwrap();
            assert_eq!(line["missed"], 0, "{line}");
            let rest = json!([line["kind"], line["press"], line["region"].is_null()]);
            facts(line["t_s"].as_f64().unwrap(), rest)
        })
        .collect();
    let touches = SessionReader::open(&session).unwrap().touches().unwrap();
    let recorded: Vec<_> = touches
        .iter()
        .map(|touch| {
            let press = touch.attempt.map(|attempt| attempt.press.number());
            let rest = json!([touch.kind, press, touch.region.is_none()]);
            facts(touch.t.as_secs_f64(), rest)
        })
        .collect();
    assert!(recorded.len() > 10, "{recorded:?}");
    assert_eq!(followed, recorded);
    sent_over_lsl_and_dds(&lab, &lines);

    // Nothing comes of a session that has ended, or of a run that feels nothing.
    skinrig(&["watch", &session, "--touches", "--every", "5 ms"])
        .code(2)
        .expect_stderr(&["expected a run that writes this session", "skinrig show"]);
}

/// A reaction that cannot happen is said beside the answer.
#[test]
fn presses_that_do_not_react_are_named_beside_the_answer() {
    let lab = Lab::new();
    // Of fewer presses no region is learnt, and the protocol is refused.
    let session = text(&lab.record(
        "s",
        &[
            "--set",
            "analysis.calibration=positions",
            "--set",
            "analysis.bootstrap_resamples=50",
            "--set",
            "repetitions.count=7",
            "--set",
            "evaluation.calibrate=[1-6]",
            "--set",
            "evaluation.score=[7]",
            "--set",
            "online.react={then: stop, region: 1e-9 mm}",
        ],
    ));
    let output = skinrig(&["analyze", &session]).code(0);
    let text = "asks presses to stop when they are felt: 0 of 4 valid scored presses did";
    let lines: Vec<&str> = output.out.lines().map(str::trim).collect();
    assert!(lines.join(" ").contains(text), "{output:?}");
    let lab = Lab::new();
    let session = session_with(&lab, &["--set", "online.false_alarms=0.1 Hz"]);
    let output = skinrig(&["analyze", &session, "-v"]).code(0);
    assert!(!output.out.contains("asks presses"), "{output:?}");
}

/// The leg that resumes a session does not feel: its presses are not missed.
#[test]
fn presses_after_a_resume_are_not_missed() {
    let lab = Lab::new();
    let folder = lab.text("s");
    let mut run = vec!["run", SMALL, "--sessions", &folder, "--no-analysis"];
    run.extend(USUAL);
    run.extend([
        "--set",
        "online.false_alarms=0.1 Hz",
        "--fault",
        "camera1-unplugged@hold:16",
    ]);
    skinrig(&run).code(3);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    skinrig(&["resume", &session, "--no-analysis"]).code(0);
    let felt = &skinrig(&["--json", "analyze", &session]).code(0).json()["analysis"]["felt"];
    assert_eq!(
        (&felt["presses"], &felt["outside"]),
        (&json!(1), &json!(3)),
        "{felt}"
    );
    assert_eq!(felt["missed"], 0, "{felt}");
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
    skinrig(&["online", &session, "--stop-at", "0mm"])
        .code(2)
        .expect_stderr(&["a length above 0"]);
    skinrig(&["online", &session, "--speed", "0"]).code(2);
}
