//! `skinrig twin`: predictions of the held-out presses, the protocol of the twin, and sessions that have none.

use crate::support::{Lab, only, skinrig, text};

/// Few presses, so that forty skins are quick.
const PROTOCOL: &str = "skinrig: 1
name: places
operator: tests
prototype: {id: K7-03}
scene: {needs: [optical_error], skin: {press_scatter: 0.5 mm}}
sync: {count: 2, interval: 1.2 s, at: [10 mm, 2 mm], pause_after: 1 s}
path: {points: [[10 mm, 2 mm], [-10 mm, 18 mm], [0 mm, -18 mm], [25 mm, 17 mm], [-12 mm, -8 mm], [22 mm, -12 mm]]}
repetitions: {count: 2, between: {return_to_start: true, pause: 500 ms}}
depth: 2 mm
motion: {period: 2.4 s}
limits:
  workspace: {min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}
  max_depth: 3 mm
  max_speed: 100 mm/s
  max_force: 4 N
triggers: {marks: [contact, retract]}
evaluation: {calibrate: [1], score: [2]}
";

fn recorded(lab: &Lab, name: &str, changes: &[&str]) -> String {
    let protocol = lab.path("places.yaml");
    std::fs::write(&protocol, PROTOCOL).unwrap();
    let (protocol, folder) = (text(&protocol), lab.text(name));
    let mut arguments = vec!["run", &protocol, "--sessions", &folder, "--no-analysis"];
    for change in changes {
        arguments.extend(["--set", change]);
    }
    skinrig(&arguments).code(0);
    text(&only(&lab.path(name), ".session.sqlite"))
}

#[test]
fn a_twin_predicts_held_out_and_changed_presses_and_is_a_protocol() {
    let lab = Lab::new();
    let session = recorded(&lab, "s", &[]);
    let run = skinrig(&["twin", &session, "--skins", "56", "--set", "depth=2.5mm"]).code(0);
    let out = &run.out;
    assert!(out.lines().count() <= 12, "{out}");
    for expected in [
        "a twin of",
        "RMSE (mm)",
        "changed protocol",
        "errors by place",
        "twin.yaml",
    ] {
        assert!(out.contains(expected), "{expected}: {out}");
    }
    let results = std::fs::read_to_string(only(&lab.path("s"), ".twin.json")).unwrap();
    let results: serde_json::Value = serde_json::from_str(&results).unwrap();
    let twin = &results["twin"]["twin"];
    let rmse = &twin["outcomes"][0];
    assert_eq!(rmse["figure"], "rmse");
    let end = |kind: &str, end: &str| rmse[kind][end].as_f64().unwrap();
    for kind in ["predicted", "changed"] {
        assert!(
            0.0 < end(kind, "low") && end(kind, "low") < end(kind, "high"),
            "{rmse}"
        );
    }
    assert!(rmse["recorded"].as_f64().unwrap() > 0.0);
    let page = std::fs::read_to_string(only(&lab.path("s"), ".twin.html")).unwrap();
    assert!(page.contains("Constants of the twin") && page.contains("depth=2.5mm"));

    // The twin is a protocol like any other, and what it records says so.
    let twin = text(&only(&lab.path("s"), ".twin.yaml"));
    let folder = lab.text("of-twin");
    let out = skinrig(&["run", &twin, "--sessions", &folder]).code(0).out;
    assert!(out.contains("twin of"), "{out}");
    let page = std::fs::read_to_string(only(&lab.path("of-twin"), ".report.html")).unwrap();
    assert!(page.contains("simulated (optical, twin of"));
}

#[test]
#[ignore = "a minute: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig --test commands twin:: -- --ignored"]
fn a_session_unlike_its_scene_has_no_twin() {
    let lab = Lab::new();
    // Another model of the skin: its touches come and go otherwise.
    let session = recorded(&lab, "s", &["scene={level: geometric}"]);
    let run = skinrig(&["twin", &session, "--skins", "56"]).code(4);
    assert!(run.out.contains("no twin: unlike all of"), "{}", run.out);
    assert!(run.out.lines().count() <= 12, "{}", run.out);
    let files = std::fs::read_dir(lab.path("s")).unwrap();
    let names: Vec<String> = files
        .map(|f| f.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    assert!(
        !names.iter().any(|name| name.ends_with(".twin.yaml")),
        "{names:?}"
    );
}

#[test]
fn sessions_that_cannot_have_a_twin_are_refused() {
    let lab = Lab::new();
    let session = recorded(
        &lab,
        "none",
        &[
            "evaluation={calibrate: [], score: [1, 2]}",
            "analysis.calibration=none",
        ],
    );
    skinrig(&["twin", &session])
        .code(2)
        .expect_stderr(&["expected calibration presses", "evaluation.calibrate"]);
    skinrig(&["twin", &session, "--skins", "10"])
        .code(2)
        .expect_stderr(&["50..=2000"]);
    let session = recorded(&lab, "s", &[]);
    skinrig(&["twin", &session, "--set", "scene.nois=1"])
        .code(2)
        .expect_stderr(&["did you mean"]);
}
