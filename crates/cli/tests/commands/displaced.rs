//! The session or its lock file is moved, removed or replaced while recording: the run detects it, keeps the data, and the command
//! that it prints resumes the session.
#![cfg(target_os = "linux")]

use std::path::{Path, PathBuf};

use skinrig_recorder::SessionReader;

use crate::interrupt::LiveRun;
use crate::support::{Lab, SMALL, only, program, show, skinrig, text};

fn start_run(lab: &Lab) -> (LiveRun, PathBuf) {
    let folder = lab.text("sessions");
    let arguments = [
        "run",
        SMALL,
        "--real-time",
        "--no-analysis",
        "--sessions",
        &folder,
    ];
    let run = LiveRun::of(program(&arguments));
    (run, only(&lab.path("sessions"), ".session.sqlite"))
}

fn companion_file(session: &Path, ending: &str) -> PathBuf {
    PathBuf::from(format!("{}{ending}", session.display()))
}

fn count_attempts(session: &Path) -> usize {
    let presses = SessionReader::open(session).unwrap().presses().unwrap();
    let attempts = presses.iter().flat_map(|(_, attempts)| attempts);
    attempts.filter(|a| a.intent.is_some()).count()
}

/// Applies `damage` to a run, which must exit with 3, report `found`, and name the session at `kept`, which is sound and can be resumed.
#[track_caller]
fn assert_recovers_after(
    damage: impl FnOnce(&Lab, &Path),
    found: &str,
    kept: impl FnOnce(&Lab, &Path) -> PathBuf,
) {
    let lab = Lab::new();
    let (run, session) = start_run(&lab);
    let before = count_attempts(&session);
    damage(&lab, &session);
    let (code, output) = run.end();
    assert_eq!(code, Some(3), "{output}");
    let kept = text(&kept(&lab, &session));
    for part in [
        found,
        &format!("everything recorded so far is kept: {kept}\n"),
        &format!("continue with `skinrig resume {kept}`"),
    ] {
        assert!(output.contains(part), "expected {part:?} in {output}");
    }
    let after = count_attempts(Path::new(&kept));
    assert!(
        after <= before + 1,
        "{before} presses, then {after}: {output}"
    );
    let verified = skinrig(&["verify", &kept]).code(0).out;
    assert!(verified.contains("not sealed"), "{verified}");
    skinrig(&["resume", "--no-analysis", &kept]).code(0);
    let verified = skinrig(&["verify", &kept]).code(0).out;
    assert!(verified.contains("sound, sealed"), "{verified}");
    let shown = show(Path::new(&kept));
    let presses = shown["presses"].as_array().unwrap();
    assert!(presses.iter().all(|p| p["verdict"] == "valid"), "{shown}");
}

fn rescued_path(folder: &Path, session: &Path) -> PathBuf {
    let name = session.file_name().unwrap().to_str().unwrap();
    folder.join(name.replace(".session.sqlite", ".rescued.session.sqlite"))
}

#[test]
fn the_file_is_renamed() {
    assert_recovers_after(
        |lab, session| std::fs::rename(session, lab.path("b.session.sqlite")).unwrap(),
        "it was moved to",
        |lab, _| lab.path("b.session.sqlite"),
    );
}

#[test]
fn the_file_is_removed() {
    assert_recovers_after(
        |_, session| std::fs::remove_file(session).unwrap(),
        "it was removed",
        |lab, session| rescued_path(&lab.path("sessions"), session),
    );
}

#[test]
fn the_folder_is_renamed() {
    assert_recovers_after(
        |lab, _| std::fs::rename(lab.path("sessions"), lab.path("other")).unwrap(),
        "it was moved to",
        |lab, session| lab.path("other").join(session.file_name().unwrap()),
    );
}

#[test]
fn the_folder_is_removed() {
    assert_recovers_after(
        |lab, _| std::fs::remove_dir_all(lab.path("sessions")).unwrap(),
        "it was removed",
        |lab, session| rescued_path(lab.path("").as_path(), session),
    );
}

#[test]
fn the_log_is_removed() {
    assert_recovers_after(
        |_, session| std::fs::remove_file(companion_file(session, "-wal")).unwrap(),
        "-wal: the file of the current run is missing: it was removed",
        |_, session| session.to_owned(),
    );
}

#[test]
fn another_file_takes_its_place() {
    assert_recovers_after(
        |lab, session| {
            std::fs::write(lab.path("other"), "not a session").unwrap();
            std::fs::rename(lab.path("other"), session).unwrap();
        },
        "another file in its place; the original was removed",
        |lab, session| rescued_path(&lab.path("sessions"), session),
    );
}

/// Without the lock file, or with another file in its place, a second writer is rejected and the run ends normally.
#[test]
fn the_lock_file_is_removed_or_replaced() {
    for replaced in [false, true] {
        let lab = Lab::new();
        let (run, session) = start_run(&lab);
        let lock = companion_file(&session, "-lock");
        std::fs::remove_file(&lock).unwrap();
        if replaced {
            std::fs::write(&lock, "").unwrap();
        }
        let path = text(&session);
        skinrig(&["resume", &path])
            .code(2)
            .expect_stderr(&["session is in use: another process is writing it"]);
        // Under another name, which never had a lock file.
        let link = lab.path("link.session.sqlite");
        std::fs::hard_link(&session, &link).unwrap();
        assert_ne!(skinrig(&["resume", &text(&link)]).code, Some(0));
        std::fs::remove_file(link).unwrap();
        run.signal("INT");
        let (code, output) = run.end();
        assert_eq!(code, Some(5), "{output}");
        let verified = skinrig(&["verify", &path]).code(0).out;
        assert!(verified.contains("sound, sealed"), "{verified}");
    }
}

/// A paused run detects it too.
#[test]
fn a_paused_run_notices_it() {
    assert_recovers_after(
        |lab, session| {
            skinrig(&["control", &text(session), "pause", "--wait", "30s"]).code(0);
            std::fs::rename(session, lab.path("b.session.sqlite")).unwrap();
        },
        "it was moved to",
        |lab, _| lab.path("b.session.sqlite"),
    );
}
