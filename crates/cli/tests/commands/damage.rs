//! Damaged session files are detected, never trusted, and never cause a panic.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::catalogue::change;
use crate::support::{Lab, ProgramOutput, SeededRandom, read_json, skinrig, text};

/// Records a small sealed session; returns its path and bytes.
fn sealed_session(lab: &Lab) -> (PathBuf, Vec<u8>) {
    let session = lab.record(
        "s",
        &[
            "--set",
            "path.points=[[10 mm, 2 mm], [-10 mm, 18 mm]]",
            "--set",
            "repetitions.count=1",
            "--set",
            "evaluation.score=[1]",
        ],
    );
    let bytes = std::fs::read(&session).unwrap();
    (session, bytes)
}

/// Poses and measured positions of a session say the same, also after its seal was taken off.
#[test]
#[cfg(unix)]
fn measured_positions_that_the_poses_contradict_are_reported() {
    use std::os::unix::fs::PermissionsExt;
    let lab = Lab::new();
    let (session, _) = sealed_session(&lab);
    let writable = std::fs::Permissions::from_mode(0o644);
    std::fs::set_permissions(&session, writable).unwrap();
    for statement in ["DELETE FROM seal", "DELETE FROM table_digest"] {
        change(&session, statement);
    }
    let path = text(&session);
    let sound = skinrig(&["verify", &path]).code(0).out;
    assert!(sound.contains("sound, but not sealed"), "{sound}");
    let analyzed = skinrig(&["analyze", &path, "--json"]).code(0).json();
    let warnings = analyzed["analysis"]["warnings"].as_array().unwrap();
    assert_eq!(warnings[0]["kind"], "not_sealed");
    let verdict = "UPDATE attempt SET verdict = 'missed', reason = 'unlucky' WHERE press = 3";
    change(&session, verdict);
    let missed = skinrig(&["verify", &path]).code(4).out;
    assert!(missed.contains("never attempted"), "{missed}");
    skinrig(&["analyze", &path]).code(2).expect_stderr(&[
        "expected rows that agree",
        "press 4",
        "skinrig verify",
    ]);
    change(
        &session,
        "UPDATE attempt SET verdict = 'valid', reason = NULL WHERE press = 3",
    );
    macro_rules! edit {
        ($column:literal, $change:literal) => {
            concat!(
                "UPDATE attempt SET ",
                $column,
                " = ",
                $column,
                " ",
                $change,
                " WHERE press = 3"
            )
        };
    }
    for (edit, undo, part) in [
        (
            edit!("measured_depth_mm", "+ 0.3"),
            edit!("measured_depth_mm", "- 0.3"),
            "the depth",
        ),
        (
            edit!("contact_ns", "+ 3000000"),
            edit!("contact_ns", "- 3000000"),
            "contact where the poses cross",
        ),
        (
            edit!("release_ns", "+ 10000000"),
            edit!("release_ns", "- 10000000"),
            "release where the poses cross",
        ),
        (
            edit!("at_depth_ns", "+ 40000000"),
            edit!("at_depth_ns", "- 40000000"),
            "poses have settled",
        ),
        (
            edit!("at_depth_ns", "- 30000000"),
            edit!("at_depth_ns", "+ 30000000"),
            "poses have settled",
        ),
        (
            edit!("retract_ns", "- 40000000"),
            edit!("retract_ns", "+ 40000000"),
            "set point begins to rise",
        ),
        (
            edit!("retract_ns", "+ 30000000"),
            edit!("retract_ns", "- 30000000"),
            "set point begins to rise",
        ),
        (
            edit!("scheduled", "+ 1"),
            edit!("scheduled", "- 1"),
            "those of a schedule",
        ),
        (edit!("measured_y_mm", "+ 0.3"), "", "of its poses"),
    ] {
        change(&session, edit);
        let found = skinrig(&["verify", &path]).code(4);
        let all = format!("{}{}", found.out, found.err);
        assert!(all.contains(part), "{edit}: {all}");
        if !undo.is_empty() {
            change(&session, undo);
        }
    }
    // No seal makes it sound again, and no copy.
    assert_ne!(skinrig(&["resume", &path]).code, Some(0));
    let copy = lab.text("copy.session.sqlite");
    let salvaged = skinrig(&["salvage", &path, "--out", &copy]).code(4);
    assert!(
        salvaged.out.contains("a value contradicts others: "),
        "{}",
        salvaged.out
    );
    salvaged.expect_stderr(&["nothing is lost", "restore the session from a copy"]);
    let shown = viewed(&session);
    assert!(shown.contains("expected rows that agree"), "{shown}");
}

/// Answer of the page of `skinrig view` about a session.
fn viewed(session: &Path) -> String {
    let mut server = Command::new(env!("CARGO_BIN_EXE_skinrig"))
        .arg("view")
        .arg(session.parent().unwrap())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(server.stdout.take().unwrap()).lines();
    let link = lines
        .map_while(Result::ok)
        .find(|line| line.starts_with("http://"));
    let link = link.unwrap();
    let (host, token) = link["http://".len()..].split_once("/#token=").unwrap();
    let name = session.file_name().unwrap().to_string_lossy();
    let mut stream = TcpStream::connect(host).unwrap();
    let request = format!(
        "GET /api/session?session={name} HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {token}\r\nConnection: close\r\n\r\n"
    );
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    server.kill().unwrap();
    server.wait().unwrap();
    answer
}

/// RMSE of the results at `path`, mm.
fn rmse_mm(path: &str) -> serde_json::Value {
    read_json(Path::new(path))["summary"]["rmse_mm"].clone()
}

fn analyzed_rmse_mm(lab: &Lab, session: &Path) -> serde_json::Value {
    let out = lab.text("sound.json");
    skinrig(&["analyze", &text(session), "--out", &out]).code(0);
    rmse_mm(&out)
}

/// Runs every reading command on `file`: each must exit with an expected code, without a panic, and no analysis gives another error
/// than that of the sound session.
fn run_all_readers(lab: &Lab, file: &Path, sound: &serde_json::Value) -> ProgramOutput {
    let file = text(file);
    let out = lab.text("other.json");
    for arguments in [
        vec!["show", &file, "--presses"],
        vec!["analyze", &file, "--out", &out],
    ] {
        let output = skinrig(&arguments);
        assert!(
            matches!(output.code, Some(0 | 2)),
            "{arguments:?}: {output:#?}"
        );
        assert!(
            !output.err.contains("panicked"),
            "{arguments:?}: {output:#?}"
        );
        // Of a file with a header, what to do next is named.
        let is_torn = ["malformed", "not an SQLite database", "damaged: "];
        if output.code == Some(2) && is_torn.iter().any(|damage| output.err.contains(damage)) {
            assert!(output.err.contains("skinrig salvage"), "{output:#?}");
        }
        if arguments[0] == "analyze" && output.code == Some(0) {
            assert_eq!(&rmse_mm(&out), sound, "{output:#?}");
        }
    }
    skinrig(&["verify", &file])
}

#[test]
fn flipped_bytes_are_found() {
    let lab = Lab::new();
    let (_, good) = sealed_session(&lab);
    let file = lab.path("damaged.session.sqlite");
    std::fs::write(&file, &good).unwrap();
    skinrig(&["verify", &text(&file)]).code(0);
    let sound = analyzed_rmse_mm(&lab, &file);
    let mut random = SeededRandom(20);
    for round in 0..24 {
        let mut bytes = good.clone();
        // One in three hits the first pages, which hold headers and small tables.
        let reach = if round % 3 == 0 {
            65_536
        } else {
            bytes.len() as u64
        };
        let at = random.below(reach) as usize;
        let flip = 1 + random.below(255) as u8;
        bytes[at] ^= flip;
        std::fs::write(&file, &bytes).unwrap();
        let output = run_all_readers(&lab, &file, &sound);
        assert!(
            !output.err.contains("panicked"),
            "byte {at} ^ {flip:#04x}: {output:#?}"
        );
        assert!(
            matches!(output.code, Some(2 | 4)),
            "byte {at} ^ {flip:#04x}: {output:#?}"
        );
        assert!(output.err.contains("damaged.session.sqlite"), "{output:#?}");
    }
}

#[test]
fn a_torn_session_is_found() {
    let lab = Lab::new();
    let (_, good) = sealed_session(&lab);
    let file = lab.path("torn.session.sqlite");
    std::fs::write(&file, &good).unwrap();
    let sound = analyzed_rmse_mm(&lab, &file);
    for length in [0, 50, 100, 4_096, good.len() / 2, good.len() - 1] {
        std::fs::write(&file, &good[..length]).unwrap();
        let output = run_all_readers(&lab, &file, &sound);
        let has_next = length < 108 || output.err.contains("skinrig salvage");
        assert!(has_next, "{length} bytes: {output:#?}");
        assert!(
            !output.err.contains("panicked"),
            "{length} bytes: {output:#?}"
        );
        assert!(
            matches!(output.code, Some(2 | 4)),
            "{length} bytes: {output:#?}"
        );
    }
    // Listing a folder continues after a broken file and names it.
    let listed = skinrig(&["sessions", &text(lab.path("").as_path())])
        .code(0)
        .out;
    assert!(listed.contains("torn.session.sqlite"), "{listed}");
}

#[test]
fn a_changed_row_is_found_and_its_table_named() {
    let lab = Lab::new();
    let (_, good) = sealed_session(&lab);
    // The operator's name, in the session's header row.
    let at = good.windows(9).position(|w| w == b"test skin").unwrap();
    let mut bytes = good;
    bytes[at] = b'b';
    let file = lab.path("forged.session.sqlite");
    std::fs::write(&file, &bytes).unwrap();
    let output = skinrig(&["verify", &text(&file)]).code(4);
    assert!(output.out.contains("session"), "{output:#?}");
    let json = skinrig(&["verify", "--json", &text(&file)]).code(4).json();
    assert_eq!(json["sound"], false);
    assert!(!json["problems"].as_array().unwrap().is_empty());
}

#[test]
fn intact_parts_of_a_damaged_session_are_salvaged_and_analysed() {
    let lab = Lab::new();
    let (session, mut bytes) = sealed_session(&lab);
    let file = lab.path("damaged.session.sqlite");
    std::fs::write(&file, &bytes).unwrap();
    let new = lab.path("damaged.salvaged.session.sqlite");
    let output = skinrig(&["salvage", "--json", &text(&file)]).code(0).json();
    assert_eq!(output["whole"], true);
    assert_eq!(output["salvaged"], text(&new));
    skinrig(&["verify", &text(&new)]).code(0);
    skinrig(&["salvage", &text(&file)])
        .code(2)
        .expect_stderr(&["file already exists"]);

    // Truncated file: SQLite rejects it, a salvage reads it.
    bytes.truncate(bytes.len() * 2 / 3);
    std::fs::write(&file, &bytes).unwrap();
    let out = lab.text("cut.session.sqlite");
    let output = skinrig(&["salvage", &text(&file), "--out", &out]);
    let output = output
        .code(4)
        .expect_stderr(&["some data are lost", "skinrig show"]);
    assert!(output.out.contains("recovered"), "{output:#?}");
    let shown = skinrig(&["show", &out]);
    assert!(matches!(shown.code, Some(0 | 2)), "{shown:#?}");
    assert_ne!(std::fs::read(&session).unwrap(), bytes);
}

/// Commands that describe a session, or rank it by stored results, do not pass edited rows for the recorded ones.
#[test]
#[cfg(unix)]
fn a_sealed_session_that_was_edited_is_described_by_no_command() {
    use std::os::unix::fs::PermissionsExt;
    let lab = Lab::new();
    let (session, bytes) = sealed_session(&lab);
    let (path, folder) = (text(&session), lab.text("s"));
    skinrig(&["analyze", &path]).code(0);
    let edits = [
        ("session", "UPDATE session SET prototype = 'other skin'"),
        (
            "attempt",
            "UPDATE attempt SET measured_x_mm = measured_x_mm + 5 WHERE press = 3",
        ),
        ("seal", "DELETE FROM table_digest WHERE name = 'attempt'"),
    ];
    let selection = lab.text("chosen.yaml");
    for (table, statement) in edits {
        let writable = std::fs::Permissions::from_mode(0o644);
        std::fs::set_permissions(&session, writable).unwrap();
        std::fs::write(&session, &bytes).unwrap();
        change(&session, statement);
        let found = format!("expected the rows that were sealed, found others in {table}");
        for command in [
            &["show", &path][..],
            &["inspect", &path],
            &["status", &path],
            &["select", &path, "--name", "chosen", "--out", &selection],
        ] {
            skinrig(command)
                .code(2)
                .expect_stderr(&[&found, "skinrig verify"]);
        }
        let ranked = skinrig(&["prototypes", &folder, "--json"]).code(0);
        let ranked = ranked.json()[0]["series"][0]["points"][0].clone();
        assert_eq!(ranked["rmse_mm"].is_null(), table == "session", "{ranked}");
    }
}
