//! A recorded or imported session, served through the device traits, gives the same results.

use std::path::Path;

use crate::support::{Lab, chunks, only, read_json, show, skinrig, text};

/// Replays `session` into `folder` and asserts that only names and dates differ.
#[track_caller]
pub(crate) fn assert_replays(lab: &Lab, session: &Path, folder: &str) {
    skinrig(&["analyze", &text(session)]).code(0);
    let original = read_json(&session_results(session));
    let shown = show(session);
    let stopped = shown["end"] == "stopped" && shown["end_cause"]["decided"].is_null();
    skinrig(&[
        "run",
        "--replay",
        &text(session),
        "--sessions",
        &lab.text(folder),
    ])
    .code(if stopped { 5 } else { 0 });
    let replayed = only(&lab.path(folder), ".session.sqlite");
    let repeated = read_json(&only(&lab.path(folder), ".results.json"));
    let hash = &original["provenance"]["results_hash"];
    assert_eq!(hash.as_str().unwrap().len(), 64);
    assert_eq!(*hash, repeated["provenance"]["results_hash"]);
    assert_eq!(
        original["analysis"]["presses"],
        repeated["analysis"]["presses"]
    );
    let (a, b) = (show(session), show(&replayed));
    for key in [
        "presses",
        "cameras",
        "plan_sha256",
        "protocol_sha256",
        "seed",
        "totals",
        "end",
        "duration_s",
    ] {
        assert_eq!(a[key], b[key], "{key}");
    }
    for camera in skinrig_model::CameraId::ALL {
        assert!(
            chunks(session, camera) == chunks(&replayed, camera),
            "{camera}"
        );
    }
    assert_eq!(b["rig_kind"], "replayed");
    skinrig(&["verify", &text(&replayed)]).code(0);
}

fn session_results(session: &Path) -> std::path::PathBuf {
    text(session)
        .replace(".session.sqlite", ".results.json")
        .into()
}

#[test]
fn a_replay_ends_with_the_same_press_table_and_results_hash() {
    let lab = Lab::new();
    let session = lab.record("s", &[]);
    assert_replays(&lab, &session, "r");
    // A replay is an ordinary session and can be replayed.
    let replayed = only(&lab.path("r"), ".session.sqlite");
    assert_replays(&lab, &replayed, "rr");
}

#[test]
fn an_overridden_session_replays_as_it_was_run() {
    let lab = Lab::new();
    let session = lab.record(
        "s",
        &[
            "--set",
            "depth=1 mm",
            "--set",
            "order={shuffled: {}}",
            "--seed",
            "77",
        ],
    );
    assert_replays(&lab, &session, "r");
}
