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
    let said = expect(run, 3);
    for part in [
        "3 of 12 presses are invalid because of the rig, not the skin: press 10: camera 1 sent no bytes",
        "repeat these presses with `skinrig resume ",
    ] {
        assert!(said.contains(part), "expected {part:?} in {said}");
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
    let said = verify(session);
    assert!(said.contains("sound, sealed"), "{said}");
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
fn what_the_rig_cost_is_taken_again() {
    let folder = tempfile::tempdir().unwrap();
    let session = session_with_rig_losses(folder.path());
    let said = verify(&session);
    assert!(said.contains("sound, sealed"), "{said}");
    let before = journal(&session).unwrap();
    let said = expect(resume(&session), 0);
    assert!(
        said.contains("3 presses from press 10 to press 12"),
        "{said}"
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
    let said = expect(resume(&session), 2);
    assert!(said.contains("there is nothing to resume"), "{said}");
}

/// The rig is not repaired: the leg ends like the run did, and the next leg can repeat the presses.
#[test]
fn a_rig_that_is_not_mended_costs_them_again() {
    let folder = tempfile::tempdir().unwrap();
    let session = session_with_rig_losses(folder.path());
    let before = journal(&session).unwrap();
    let mut again = resume(&session);
    // After the two sync presses of the leg.
    again.args(["--fault", "camera2-stalled@approach:4"]);
    let said = expect(again, 3);
    assert!(said.contains("2 of 12 presses are invalid"), "{said}");
    expect(resume(&session), 0);
    assert_complete(&session, &before);
}

/// Kills at the start, in the middle and before the seal of the leg that repeats the presses.
#[test]
fn killed_while_they_are_taken_again() {
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
