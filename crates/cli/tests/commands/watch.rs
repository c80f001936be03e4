//! Watching a run from other terminals, from before its start until it is sealed.
#![cfg(unix)]

use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::interrupt::{LIVE_PRESSES, LiveRun};
use crate::support::{Lab, SMALL, only, program, read_json, skinrig, text};

const WATCHERS: usize = 8;

#[test]
fn a_run_in_real_time_is_shown_with_its_path_its_rates_and_its_signals() {
    let lab = Lab::new();
    let run = LiveRun::new(&lab.path("s"));
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    // The first press has nothing to be compared with.
    let patience = Instant::now() + Duration::from_secs(60);
    let done = || skinrig(&["status", "--json", &session]).code(0).json()["live"]["done"].as_u64();
    while done() < Some(3) {
        assert!(Instant::now() < patience, "three presses were not made");
    }
    let frame = skinrig(&["watch", &lab.text("s"), "--once", "--json"]);
    let frame = frame.code(0).json();
    assert_eq!(frame["live"]["state"], "running", "{frame}");
    assert_eq!(frame["sealed"], false);
    assert_eq!(frame["presses"]["planned"], LIVE_PRESSES - 2);
    // Four locations, ten times each; the two sync presses do not count.
    assert_eq!(frame["places"].as_array().unwrap().len(), 4, "{frame}");
    assert_eq!(frame["places"][0]["planned"], 10);
    let latest = frame["latest"].as_array().unwrap().last().unwrap();
    assert_eq!(latest["verdict"], "valid", "{frame}");
    for camera in 0..2 {
        let signal = &latest["cameras"][camera];
        let [press, idle] = ["press_per_s", "idle_per_s"].map(|k| signal[k].as_f64().unwrap());
        assert!(press > 2.0 * idle, "{frame}");
    }
    let words = skinrig(&["watch", &session, "--once"]).code(0).out;
    for word in [
        "state    running",
        "camera 2",
        "kev/s",
        "eta 0:0",
        "@",
        "SNR 2",
        " free",
    ] {
        assert!(words.contains(word), "{word} in {words}");
    }
    let mut watcher = program(&["watch", &session, "--every", "100 ms"]);
    let watcher = watcher.stdout(Stdio::piped()).spawn().unwrap();
    skinrig(&["control", &session, "stop", "--wait", "60 s"]).code(0);
    let output = watcher.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let output = String::from_utf8(output.stdout).unwrap();
    let states: Vec<&str> = output.lines().filter(|l| l.starts_with("state ")).collect();
    assert_eq!(states.last(), Some(&"state    stopped"), "{states:?}");
    assert_eq!(run.end().0, Some(5));
}

/// Camera 1 stops sending in the third hold: presses fail, one after the other, until the run gives up.
#[test]
fn failing_presses_are_shown_with_their_cause_while_the_run_goes_on() {
    let lab = Lab::new();
    let folder = lab.text("s");
    let fault = "camera1-stalled@hold:3";
    let mut run = LiveRun::of(program(&[
        "run",
        SMALL,
        "--real-time",
        "--sessions",
        &folder,
        "--fault",
        fault,
    ]));
    run.wait_for("1 invalid");
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let frame = skinrig(&["watch", &session, "--once", "--json"])
        .code(0)
        .json();
    assert_eq!(frame["live"]["state"], "running", "{frame}");
    assert!(frame["failures_in_a_row"].as_u64() >= Some(1), "{frame}");
    let failure = &frame["failures"][0];
    assert_eq!(failure["kinds"][0], "data_late", "{frame}");
    let seen = skinrig(&["watch", &session, "--once"]).code(0).out;
    for part in [
        "FAILING  the last",
        "data late: camera 1",
        "invalid attempts, by cause",
        "  invalid",
    ] {
        assert!(seen.contains(part), "{part} in {seen}");
    }
    assert!(seen.lines().all(|l| l.chars().count() <= 80), "{seen}");
    skinrig(&["control", &session, "stop", "--wait", "60 s"]);
    run.end();
    let seen = skinrig(&["watch", &session]).code(0).out;
    assert!(
        seen.contains("state    faulted") || seen.contains("state    stopped"),
        "{seen}"
    );
}

/// A camera that loses bytes, and presses that a retake makes good.
#[test]
fn losses_and_retakes_are_shown() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &["--fault", "camera1-drops@hold:4"]));
    let frame = skinrig(&["watch", &session, "--json"]).code(0).json();
    assert!(frame["losses"][0]["bytes"].as_u64() > Some(0), "{frame}");
    assert_eq!(frame["losses"][1]["bytes"], 0);
    assert_eq!(frame["failures"][0]["made_good"], 1, "{frame}");
    let seen = skinrig(&["watch", &session]).code(0).out;
    for part in ["LOST     camera 1: ", "1 x  ", "1 made good by a retake"] {
        assert!(seen.contains(part), "{part} in {seen}");
    }
    assert!(!seen.contains("FAILING"), "{seen}");
}

#[test]
fn a_terminal_is_cleared_before_each_frame() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let watch = format!("'{}' watch '{session}'", env!("CARGO_BIN_EXE_skinrig"));
    let mut terminal = std::process::Command::new("script");
    let Ok(output) = terminal.args(["-qec", &watch, "/dev/null"]).output() else {
        eprintln!("skipped: no `script`, which runs a program in a terminal");
        return;
    };
    let shown = String::from_utf8(output.stdout).unwrap();
    assert!(shown.contains("\u{1b}[H\u{1b}[J"), "{shown:?}");
    assert!(!shown.contains("\\u{1b}"), "{shown:?}");
}

#[test]
fn eight_readers_of_a_run_meet_no_lock_and_change_nothing() {
    let lab = Lab::new();
    let watchers: Vec<_> = (0..WATCHERS)
        .map(|_| {
            let folder = lab.text("s");
            let mut watcher = program(&["watch", &folder, "--every", "200 ms"]);
            let watcher = watcher.stdout(Stdio::piped()).stderr(Stdio::piped());
            watcher.spawn().unwrap()
        })
        .collect();
    let hash = |folder: &str| {
        let sessions = lab.text(folder);
        skinrig(&["run", SMALL, "--sessions", &sessions]).code(0);
        let results = read_json(&only(&lab.path(folder), ".results.json"));
        results["provenance"]["results_hash"].clone()
    };
    let watched = hash("s");
    for watcher in watchers {
        let output = watcher.wait_with_output().unwrap();
        let (out, err) = (&output.stdout, &output.stderr);
        let [out, err] = [out, err].map(|text| String::from_utf8_lossy(text).into_owned());
        assert_eq!(output.status.code(), Some(0), "{out}{err}");
        assert!(!err.contains("locked") && !err.contains("error"), "{err}");
        assert!(out.contains("state    completed"), "{out}");
    }
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    assert!(
        skinrig(&["verify", &session])
            .code(0)
            .out
            .contains(", sealed")
    );
    assert_eq!(watched, hash("alone"));
}

#[test]
fn watch_waits_for_a_run_and_reports_an_interrupted_one() {
    let lab = Lab::new();
    let folder = lab.text("s");
    skinrig(&["watch", &folder, "--once"])
        .code(2)
        .expect_stderr(&[&folder, "found none yet", "--once"]);
    let run = LiveRun::new(&lab.path("s"));
    skinrig(&["watch", &folder, "--touches"])
        .code(2)
        .expect_stderr(&["`online`", "skinrig show"]);
    run.signal("KILL");
    run.end();
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let output = skinrig(&["watch", &session]).code(0);
    assert!(output.out.contains("state    cut off"), "{output:?}");
    // Its completeness cannot be verified.
    skinrig(&[
        "export",
        &session,
        "--to",
        "bundle",
        "--out",
        &lab.text("b"),
    ])
    .code(2)
    .expect_stderr(&["sealed session", "resume"]);
}
