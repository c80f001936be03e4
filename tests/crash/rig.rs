//! Presses lost due to the rig in a run that completes: the run does not count as a success, and a further leg repeats these
//! presses, even if that leg is killed. Checked with the program that shares no code with the writer.

use std::path::Path;
use std::process::Command;

use skinrig_model::{PressRole, PressVerdict};
use skinrig_recorder::SessionReader;

use super::lab::{
    Presses, assert_kept, campaign, expect, journal, output_text, program, resume, session_in,
};

/// The campaign on a rig whose camera sends nothing from the tenth press on; returns the session.
fn session_with_rig_losses(folder: &Path) -> std::path::PathBuf {
    let mut run = campaign(folder);
    run.args(["--fault", "camera1-stalled@approach:10"]);
    let text = expect(run, 3);
    for part in [
        "3 of 12 presses are invalid because of the rig, not the skin: press 10: camera 1 sent no bytes",
        "repeat these presses with `skinrig resume ",
    ] {
        assert!(text.contains(part), "expected {part:?} in {text}");
    }
    session_in(folder).unwrap()
}

fn verify(session: &Path) -> String {
    let mut command = program(&["verify"]);
    command.arg(session);
    expect(command, 0)
}

/// Every press is valid; no attempts were added to those valid before, except sync presses.
fn assert_complete(session: &Path, before: &Presses) {
    let text = verify(session);
    assert!(text.contains("sound, sealed"), "{text}");
    let after = journal(session).unwrap();
    assert_kept(before, &after, "what the rig cost");
    for ((press, was), (_, is)) in before.iter().zip(&after) {
        let valid = |a: &skinrig_recorder::AttemptRow| {
            a.outcome.as_ref().map(|o| &o.verdict) == Some(&PressVerdict::Valid)
        };
        assert!(is.last().is_some_and(valid), "{}: {is:?}", press.id);
        if press.role != PressRole::Sync && was.last().is_some_and(valid) {
            assert_eq!(was.len(), is.len(), "{}", press.id);
        }
    }
    let python = std::env::var("SKINRIG_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/crash/history.py");
    let Ok(checked) = Command::new(python).arg(script).arg(session).output() else {
        return;
    };
    assert!(checked.status.success(), "{}", output_text(&checked));
}

#[test]
fn presses_lost_to_the_rig_are_retaken() {
    let folder = tempfile::tempdir().unwrap();
    let session = session_with_rig_losses(folder.path());
    let text = verify(&session);
    assert!(text.contains("sound, sealed"), "{text}");
    let before = journal(&session).unwrap();
    let text = expect(resume(&session), 0);
    assert!(
        text.contains("3 presses from press 10 to press 12"),
        "{text}"
    );
    assert_complete(&session, &before);
    let legs = SessionReader::open(&session).unwrap().legs().unwrap();
    assert_eq!(legs.len(), 2);
    assert!(legs.iter().all(|leg| {
        leg.end
            .as_ref()
            .is_some_and(|(_, end)| end.name() == "completed")
    }));
    // No presses remain to be repeated.
    let text = expect(resume(&session), 2);
    assert!(text.contains("there is nothing to resume"), "{text}");
}

/// The rig is not repaired: the leg ends like the run did, and the next leg can repeat the presses.
#[test]
fn a_rig_that_is_not_mended_costs_them_again() {
    let folder = tempfile::tempdir().unwrap();
    let session = session_with_rig_losses(folder.path());
    let before = journal(&session).unwrap();
    let mut repeated = resume(&session);
    // After the two sync presses of the leg.
    repeated.args(["--fault", "camera2-stalled@approach:4"]);
    let text = expect(repeated, 3);
    assert!(text.contains("2 of 12 presses are invalid"), "{text}");
    expect(resume(&session), 0);
    assert_complete(&session, &before);
}

/// Kills at the start, in the middle and before the seal of the leg that repeats the presses.
#[test]
fn killed_during_retakes() {
    for fault in ["killed@journal:1", "killed@journal:12", "killed@seal"] {
        let folder = tempfile::tempdir().unwrap();
        let session = session_with_rig_losses(folder.path());
        let before = journal(&session).unwrap();
        let mut killed = resume(&session);
        let killed = killed.args(["--fault", fault]).output().unwrap();
        assert_eq!(
            killed.status.code(),
            None,
            "{fault}: {}",
            output_text(&killed)
        );
        verify(&session);
        expect(resume(&session), 0);
        assert_complete(&session, &before);
    }
}
