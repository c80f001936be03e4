//! Commands from another terminal: status, notes, pause, resume, stop; killed runs; sessions without a run.
#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::interrupt::{LIVE_PRESSES, LiveRun};
use crate::support::{Lab, files, only, program, sha256, show, skinrig, text};

fn status(place: &Path) -> Value {
    skinrig(&["status", "--json", &text(place)]).code(0).json()
}

fn control(session: &Path, what: &str) -> String {
    let session = text(session);
    let done = skinrig(&["control", &session, what, "--wait", "60 s"]);
    done.code(0).out
}

fn socket_of(session: &Path) -> PathBuf {
    PathBuf::from(format!("{}-control", text(session)))
}

#[test]
fn a_run_is_watched_paused_resumed_and_stopped_from_another_terminal() {
    let lab = Lab::new();
    let run = LiveRun::new(&lab.path("s"));
    let session = only(&lab.path("s"), ".session.sqlite");
    assert!(socket_of(&session).exists());
    // The first reported press may be a sync press, which does not count as done.
    let patience = Instant::now() + Duration::from_secs(60);
    while status(&session)["live"]["done"].as_u64() == Some(0) {
        assert!(Instant::now() < patience, "no press was made");
    }

    // Two readers at once, one of which names the folder.
    let ask = |place: &str| {
        let mut reader = program(&["status", place, "--json"]);
        let piped = reader.stdout(Stdio::piped()).stderr(Stdio::piped());
        piped.spawn().unwrap()
    };
    let readers = [ask(&text(&session)), ask(&lab.text("s"))];
    for reader in readers {
        let output = reader.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(found["live"]["state"], "running", "{found}");
        assert_eq!(found["live"]["planned"], LIVE_PRESSES);
        assert!(found["live"]["done"].as_u64() >= Some(1), "{found}");
        assert!(found["live"]["eta_s"].as_f64() > Some(0.0), "{found}");
        assert!(found["disk_free_bytes"].as_u64() > Some(0), "{found}");
        assert_eq!(found["last_outcomes"][0]["verdict"], "valid", "{found}");
        assert_eq!((&found["end"], &found["legs"]), (&Value::Null, &1.into()));
    }
    let words = skinrig(&["status", &text(&session)]).code(0).out;
    for word in ["running (process", "eta 0:0", "kev/s", "free", "valid"] {
        assert!(words.contains(word), "{word} in {words}");
    }

    let output = control(&session, "pause-now");
    assert!(output.contains("the run is paused"), "{output}");
    let paused = status(&session);
    assert_eq!(paused["live"]["state"], "paused", "{paused}");
    let kinds = |found: &Value| -> Vec<String> {
        let rows = found["last_interruptions"].as_array().unwrap();
        rows.iter()
            .map(|row| row[1].as_str().unwrap().to_owned())
            .collect()
    };
    let note = [
        "note",
        &lab.text("s"),
        "the lamp",
        "flickers",
        "--by",
        "Ann",
    ];
    assert!(skinrig(&note).code(0).out.contains("noted"));
    // Pausing a paused run has no effect.
    let output = skinrig(&["control", &text(&session), "pause", "--wait", "1 s"]);
    assert!(output.code(0).out.contains("the run is paused"));

    let output = control(&session, "resume");
    assert!(output.contains("the run is running"), "{output}");
    let output = control(&session, "stop");
    assert!(
        output.contains("ended") || output.contains("finished"),
        "{output}"
    );
    let (code, messages) = run.end();
    assert_eq!(code, Some(5), "{messages}");

    // The session lists all requests, has no run, and stays unchanged.
    let before = sha256(&std::fs::read(&session).unwrap());
    let ended = status(&lab.path("s"));
    assert_eq!(kinds(&ended), ["pause_now", "resume", "stop"], "{ended}");
    assert_eq!(ended["last_notes"][0][1], "Ann: the lamp flickers");
    assert!(ended["last_notes"][0][0].as_f64() > Some(0.0), "{ended}");
    assert_eq!(
        (&ended["live"], &ended["writer"]),
        (&Value::Null, &Value::Null)
    );
    assert_eq!(ended["sealed"], true);
    let words = skinrig(&["status", &text(&session)]).code(0).out;
    let next = format!("next      skinrig resume {}\n", text(&session));
    assert!(
        words.contains("state     stopped: operator: stop\n") && words.contains(&next),
        "{words}"
    );
    for arguments in [
        ["control", &text(&session), "stop"],
        ["note", &text(&session), "late"],
    ] {
        let refused = skinrig(&arguments).code(2);
        refused.expect_stderr(&["sealed one, which never changes"]);
    }
    assert_eq!(sha256(&std::fs::read(&session).unwrap()), before);
    let left = files(&lab.path("s"), "-control");
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_killed_run_is_recognised_and_its_socket_is_replaced() {
    let lab = Lab::new();
    let run = LiveRun::new(&lab.path("s"));
    run.signal("KILL");
    assert_eq!(run.end().0, None);
    let session = only(&lab.path("s"), ".session.sqlite");
    assert!(socket_of(&session).exists(), "what a killed run leaves");
    let found = status(&lab.path("s"));
    assert_eq!(
        (&found["live"], &found["end"]),
        (&Value::Null, &Value::Null)
    );
    let words = skinrig(&["status", &text(&session)]).code(0).out;
    assert!(
        words.contains("cut off: no program is running it"),
        "{words}"
    );
    for arguments in [
        ["control", &text(&session), "abort"],
        ["note", &text(&session), "why?"],
    ] {
        let refused = skinrig(&arguments).code(2);
        refused.expect_stderr(&["no program is running", "skinrig resume"]);
    }

    // The next leg opens its control socket again and reports it.
    let repeated = ["resume", &text(&session), "--real-time", "--no-analysis"];
    let mut leg = program(&repeated);
    let mut leg = leg
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut found = status(&session);
    while found["live"].is_null() || found["live"]["state"] == "planned" {
        assert!(leg.try_wait().unwrap().is_none(), "{found}");
        found = status(&session);
    }
    let output = control(&session, "halt");
    assert!(
        output.contains("ended") || output.contains("finished"),
        "{output}"
    );
    assert_eq!(leg.wait().unwrap().code(), Some(5));
    let ended = status(&session);
    assert_eq!(ended["legs"], 2, "{ended}");
    let halted = ended["end_reason"].as_str().unwrap_or_default();
    assert!(halted.contains("operator: halt"), "{ended}");
    assert!(!socket_of(&session).exists());
}

#[test]
fn a_finished_session_is_only_read() {
    let lab = Lab::new();
    let session = lab.record("s", &[]);
    let before = std::fs::read(&session).unwrap();
    let found = status(&session);
    assert_eq!(
        (&found["end"], &found["sealed"]),
        (&"completed".into(), &true.into())
    );
    assert_eq!(
        found["last_outcomes"].as_array().unwrap().len(),
        5,
        "{found}"
    );
    let words = skinrig(&["status", &lab.text("s")]).code(0).out;
    assert!(words.contains("state     completed"), "{words}");
    assert!(words.contains("8 planned: 8 valid"), "{words}");
    assert_eq!(std::fs::read(&session).unwrap(), before);
    assert_eq!(show(&session)["sealed"], true);

    std::fs::create_dir(lab.path("none")).unwrap();
    skinrig(&["status", &lab.text("none")])
        .code(2)
        .expect_stderr(&["expected a session, found none"]);
    skinrig(&["status", "Cargo.toml"])
        .code(2)
        .expect_stderr(&["expected a skinrig session"]);
    skinrig(&["control", &text(&session), "launch"]).code(2);
    skinrig(&["note", &text(&session)]).code(2);
}
