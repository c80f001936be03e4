//! A session that is moved, removed or replaced while it is written: the loss is detected, and all records are saved in one file that
//! can be resumed. The lock file alone does not keep a second writer out.
#![cfg(target_os = "linux")]

use std::path::{Path, PathBuf};

use skinrig_model::*;
use skinrig_recorder::{RecorderError, SessionReader, SessionWriter, verify, writer_of};

use crate::common::{Evt2, further_leg, records, sealed};

const PRESSES: u32 = 5;

/// A session in progress with two outcomes.
struct Run {
    root: tempfile::TempDir,
    path: PathBuf,
    writer: SessionWriter,
    rest: Vec<Record>,
}

fn sibling(path: &Path, ending: &str) -> PathBuf {
    PathBuf::from(format!("{}{ending}", path.display()))
}

fn begin() -> Run {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("sessions/a.session.sqlite");
    std::fs::create_dir(path.parent().unwrap()).unwrap();
    let mut writer = SessionWriter::create(&path).unwrap();
    let all = records(PRESSES);
    let outcomes = |r: &Record| matches!(r, Record::Outcome(_));
    let second = all.iter().position(outcomes).unwrap() + 1;
    let rest = all[second..].to_vec();
    for record in &all[..second] {
        writer.accept(record.clone()).unwrap();
    }
    writer.check().unwrap();
    Run {
        root,
        path,
        writer,
        rest,
    }
}

impl Run {
    fn folder(&self) -> PathBuf {
        self.path.parent().unwrap().to_owned()
    }

    /// Checks that the displacement is detected, and that the session is written to its end and saved in one file that can be
    /// resumed. Returns its path.
    #[track_caller]
    fn into_rescued(mut self, found: &str) -> (tempfile::TempDir, PathBuf) {
        let error = self.writer.check().unwrap_err();
        assert!(matches!(error, RecorderError::Displaced { .. }), "{error}");
        assert!(error.to_string().contains(found), "{error}");
        for record in std::mem::take(&mut self.rest) {
            self.writer.accept(record).unwrap();
        }
        let rescued = match self.writer.finish() {
            Err(RecorderError::Rescued { to, displaced }) => {
                assert_eq!(displaced.to_string(), error.to_string());
                to
            }
            other => panic!("{other:?}"),
        };
        assert!(!sibling(&rescued, "-wal").exists());
        let report = verify::<Evt2>(&rescued).unwrap();
        assert_eq!((report.problems, report.sealed), (vec![], false));
        let reader = SessionReader::open(&rescued).unwrap();
        assert!(matches!(
            reader.end().unwrap(),
            Some((_, RunEnd::Stopped(_)))
        ));
        let known = reader.history().unwrap();
        drop(reader);
        let mut leg = SessionWriter::resume::<Evt2>(&rescued).unwrap();
        for record in further_leg(&known) {
            leg.accept(record).unwrap();
        }
        leg.finish().unwrap();
        let report = verify::<Evt2>(&rescued).unwrap();
        assert_eq!((report.problems, report.sealed), (vec![], true));
        (self.root, rescued)
    }
}

#[test]
fn a_renamed_file_is_detected() {
    let run = begin();
    let new = run.folder().join("b.session.sqlite");
    std::fs::rename(&run.path, &new).unwrap();
    let (root, rescued) = run.into_rescued("moved to");
    assert_eq!(rescued, new);
    // No log file is left under the old name.
    let left = std::fs::read_dir(root.path().join("sessions")).unwrap();
    let left: Vec<_> = left.map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["b.session.sqlite"]);
}

#[test]
fn a_removed_file_is_copied() {
    let run = begin();
    std::fs::remove_file(&run.path).unwrap();
    let expected = run.folder().join("a.rescued.session.sqlite");
    let (_root, rescued) = run.into_rescued("it was removed");
    assert_eq!(rescued, expected);
}

#[test]
fn a_renamed_folder_is_followed() {
    let run = begin();
    let new = run.root.path().join("elsewhere");
    std::fs::rename(run.folder(), &new).unwrap();
    // The folder is created again.
    std::fs::create_dir(run.folder()).unwrap();
    let (_root, rescued) = run.into_rescued("moved to");
    assert_eq!(rescued, new.join("a.session.sqlite"));
}

#[test]
fn a_removed_folder_leads_to_a_copy_above_it() {
    let run = begin();
    std::fs::remove_dir_all(run.folder()).unwrap();
    let (root, rescued) = run.into_rescued("it was removed");
    assert_eq!(rescued, root.path().join("a.rescued.session.sqlite"));
}

#[test]
fn a_removed_log_loses_nothing() {
    for ending in ["-wal", "-shm"] {
        let run = begin();
        std::fs::remove_file(sibling(&run.path, ending)).unwrap();
        let path = run.path.clone();
        let (_root, rescued) =
            run.into_rescued(&format!("{ending}: the file of the current run is missing"));
        assert_eq!(rescued, path);
    }
}

#[test]
fn another_file_in_its_place_is_left_alone() {
    for own_is_kept in [true, false] {
        let run = begin();
        let new = run.folder().join("b.session.sqlite");
        if own_is_kept {
            std::fs::rename(&run.path, &new).unwrap();
        }
        let other = run.root.path().join("other.session.sqlite");
        sealed(&other, PRESSES);
        let bytes = std::fs::read(&other).unwrap();
        std::fs::rename(&other, &run.path).unwrap();
        // The log still belongs to the run: the file now under this name must not be resumed.
        let refused = SessionWriter::resume::<Evt2>(&run.path);
        assert!(
            matches!(refused, Err(RecorderError::InUse { .. })),
            "{refused:?}"
        );
        let path = run.path.clone();
        let copy = run.folder().join("a.rescued.session.sqlite");
        let (_root, rescued) = run.into_rescued("another file in its place");
        assert_eq!(rescued, if own_is_kept { new } else { copy });
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
        let report = verify::<Evt2>(&path).unwrap();
        assert_eq!((report.problems, report.sealed), (vec![], true));
    }
}

#[test]
fn the_next_free_name_is_used() {
    let run = begin();
    let first = run.folder().join("a.rescued.session.sqlite");
    std::fs::write(&first, "precious").unwrap();
    std::fs::remove_file(&run.path).unwrap();
    let (_root, rescued) = run.into_rescued("removed");
    assert!(
        rescued.ends_with("a.rescued-2.session.sqlite"),
        "{}",
        rescued.display()
    );
    assert_eq!(std::fs::read_to_string(first).unwrap(), "precious");
}

#[test]
fn a_second_writer_is_rejected_without_the_lock_file() {
    for replaced in [false, true] {
        let mut run = begin();
        let lock = sibling(&run.path, "-lock");
        std::fs::remove_file(&lock).unwrap();
        if replaced {
            std::fs::write(&lock, "anything").unwrap();
        }
        for refused in [
            SessionWriter::resume::<Evt2>(&run.path),
            SessionWriter::open_ended::<Evt2>(&run.path),
        ] {
            assert!(
                matches!(refused, Err(RecorderError::InUse { .. })),
                "{refused:?}"
            );
        }
        assert!(writer_of(&run.path).is_some());
        run.writer.check().unwrap();
        for record in std::mem::take(&mut run.rest) {
            run.writer.accept(record).unwrap();
        }
        run.writer.finish().unwrap();
        assert_eq!(writer_of(&run.path), None);
        let report = verify::<Evt2>(&run.path).unwrap();
        assert_eq!((report.problems, report.sealed), (vec![], true));
    }
}

/// A sealed session is read-only and has no log; a leg of it is locked from its first instant.
#[test]
fn a_leg_is_locked_before_it_begins() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    sealed(&path, PRESSES);
    let known = SessionReader::open(&path).unwrap().history().unwrap();
    let mut leg = SessionWriter::resume::<Evt2>(&path).unwrap();
    std::fs::remove_file(sibling(&path, "-lock")).unwrap();
    // Under another name, without a lock file.
    let link = folder.path().join("b.session.sqlite");
    std::fs::hard_link(&path, &link).unwrap();
    let refused = || {
        for path in [&path, &link] {
            let refused = SessionWriter::resume::<Evt2>(path);
            assert!(
                matches!(refused, Err(RecorderError::InUse { .. })),
                "{refused:?}"
            );
        }
    };
    refused();
    for record in further_leg(&known) {
        leg.accept(record).unwrap();
        refused();
    }
    leg.finish().unwrap();
}
