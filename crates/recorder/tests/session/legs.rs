//! Sessions of several legs: one continuous time line, every press counted once, and sound at every instant.

use proptest::prelude::*;
use sha2::{Digest as _, Sha256};
use skinrig_model::*;
use skinrig_recorder::{LegRow, RecorderError, SessionReader, SessionWriter, verify};

use crate::common::{Evt2, execute, further_leg, header, records, sealed, stopped, with_file};

const PRESSES: u32 = 5;

fn assert_sound(path: &std::path::Path, sealed: bool) {
    let report = verify::<Evt2>(path).unwrap();
    assert_eq!((report.problems, report.sealed), (vec![], sealed));
}

/// Resumes to the end and seals.
fn resume(path: &std::path::Path) -> Vec<Record> {
    let known = SessionReader::open(path).unwrap().history().unwrap();
    let leg = further_leg(&known);
    let mut writer = SessionWriter::resume::<Evt2>(path).unwrap();
    for record in &leg {
        writer.accept(record.clone()).unwrap();
    }
    let totals = writer.finish().unwrap().totals;
    let all = (
        totals.presses.planned,
        totals.presses.valid,
        totals.sync.valid,
    );
    assert_eq!(all, (u64::from(PRESSES) - 1, u64::from(PRESSES) - 1, 1));
    leg
}

fn is_sorted(times: impl IntoIterator<Item = HostTime>) -> bool {
    times.into_iter().is_sorted()
}

/// Checks that the records of a leg are read back, shifted by its origins only.
fn check_round_trip(reader: &SessionReader, leg: &LegRow, written: &[Record]) {
    let moved = |t: HostTime| HostTime(t.0 + leg.origin.0);
    let mut outcomes = Vec::new();
    let mut chunks = 0;
    for record in written {
        match record {
            Record::Outcome(o) => outcomes.push(o.clone()),
            Record::Chunk(c) => {
                chunks += 1;
                let k = c.camera.index();
                let seq = c.seq + leg.first_seq[k];
                let index = reader.chunk_index(c.camera).unwrap();
                let meta = index[seq as usize];
                assert_eq!(meta.host_time, moved(c.host_time));
                let later = |t: Option<u64>| t.map(|t| t + leg.camera_origin_us[k]);
                assert_eq!(meta.facts.first_us, later(c.facts.first_us));
                assert_eq!(meta.facts.last_us, later(c.facts.last_us));
                assert_eq!(reader.chunk_bytes(c.camera, seq).unwrap(), c.bytes);
                let restart = (leg.number > 1 && c.seq == 0).then_some(leg.camera_origin_us[k]);
                assert_eq!(meta.restart_us, restart);
            }
            _ => {}
        }
    }
    assert!(chunks > 0);
    let presses = reader.presses().unwrap();
    for mut written in outcomes {
        let attempts = &presses[written.attempt.press.index() as usize].1;
        let attempt = &attempts[written.attempt.number as usize - 1];
        let timing = written.timing.as_mut().unwrap();
        assert_eq!(
            attempt.intent,
            Some(moved(HostTime(timing.approach.0 - 1_000_000)))
        );
        for moment in [
            &mut timing.approach,
            &mut timing.contact,
            &mut timing.at_depth,
            &mut timing.retract,
            &mut timing.release,
            &mut timing.clear,
        ] {
            *moment = moved(*moment);
        }
        assert_eq!(attempt.outcome.as_ref(), Some(&written));
    }
}

/// Checks that times are continuous from the first leg to the last.
fn check_times(reader: &SessionReader) {
    let everything = (HostTime(i64::MIN), HostTime(i64::MAX));
    let poses = reader.poses(everything.0, everything.1).unwrap();
    assert!(is_sorted(poses.iter().map(|p| p.t)));
    assert!(is_sorted(reader.commands().unwrap().iter().map(|c| c.t)));
    assert!(is_sorted(reader.marks_sent().unwrap().iter().map(|m| m.t)));
    assert!(is_sorted(reader.box_reports().unwrap().iter().map(|r| r.0)));
    for camera in CameraId::ALL {
        let index = reader.chunk_index(camera).unwrap();
        assert!(index.iter().map(|m| m.seq).eq(0..index.len() as u64));
        let times = index
            .iter()
            .flat_map(|m| [m.facts.first_us, m.facts.last_us]);
        assert!(times.flatten().is_sorted());
        let edges = reader.trigger_edges(camera).unwrap();
        assert!(edges.is_sorted_by_key(|e| e.t_us));
        assert_eq!(
            reader.gaps(camera).unwrap().len(),
            usize::from(camera == CameraId::Two)
        );
    }
}

#[test]
fn a_stopped_and_sealed_session_is_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let first = sealed(&path, PRESSES);
    let known = SessionReader::open(&path).unwrap().history().unwrap();
    let counted: Vec<_> = known
        .iter()
        .map(|k| (k.attempts, k.verdict.clone()))
        .collect();
    let missed = PressVerdict::Missed(MissedReason::RunEnded(stopped()));
    let valid = || Some(PressVerdict::Valid);
    assert_eq!(
        counted,
        [
            (1, valid()),
            (1, valid()),
            (1, valid()),
            (2, valid()),
            (1, Some(missed))
        ]
    );
    // Opened and closed without a record: still the sealed session.
    drop(SessionWriter::resume::<Evt2>(&path).unwrap());
    assert_sound(&path, true);

    let second = resume(&path);
    assert_sound(&path, true);
    assert!(std::fs::metadata(&path).unwrap().permissions().readonly());
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "one file remains"
    );

    let reader = SessionReader::open(&path).unwrap();
    assert_eq!(reader.header().unwrap(), header(PRESSES));
    let legs = reader.legs().unwrap();
    assert_eq!(legs.len(), 2);
    assert_eq!(legs[0].end.as_ref().map(|e| &e.1), Some(&stopped()));
    assert_eq!(legs[0].tree_sha256, Some(first.tree_sha256));
    assert_eq!(legs[1].began.operator, "another tester");
    assert_eq!((legs[1].devices_before, legs[1].preflight_before), (2, 3));
    assert_eq!(legs[1].origin.0 % 1_000_000_000, 0);
    assert_eq!(legs[1].end, reader.end().unwrap());
    check_round_trip(&reader, &legs[0], &records(PRESSES));
    check_round_trip(&reader, &legs[1], &second);
    check_times(&reader);
    let resets = reader
        .box_reports()
        .unwrap()
        .into_iter()
        .filter(|(t, output)| {
            *t == legs[1].origin
                && *output
                    == BoxReport::Reset {
                        noticed: legs[1].origin,
                    }
        });
    assert!(resets.count() >= 1);
    match SessionWriter::resume::<Evt2>(&path) {
        Err(RecorderError::AlreadyCompleted { .. }) => {}
        other => panic!("{other:?}"),
    }
}

#[test]
fn one_writer_at_a_time_and_the_header_of_a_leg_first() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    match SessionWriter::resume::<Evt2>(&path) {
        Err(RecorderError::Missing { .. }) => {}
        other => panic!("{other:?}"),
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let mut writer = SessionWriter::create(&path).unwrap();
    for record in records(PRESSES).into_iter().take(9) {
        writer.accept(record).unwrap();
    }
    match SessionWriter::resume::<Evt2>(&path) {
        Err(RecorderError::InUse { by, .. }) => assert!(by.starts_with("process "), "{by}"),
        other => panic!("{other:?}"),
    }
    drop(writer);
    let mut writer = SessionWriter::resume::<Evt2>(&path).unwrap();
    assert!(matches!(
        SessionWriter::resume::<Evt2>(&path),
        Err(RecorderError::InUse { .. })
    ));
    let note = Record::Note {
        t: HostTime(0),
        text: "too early".into(),
    };
    assert!(matches!(
        writer.accept(note),
        Err(RecorderError::Record { .. })
    ));
    assert!(matches!(
        writer.finish(),
        Err(RecorderError::Unsealable { .. })
    ));
    assert_sound(&path, false);
}

#[test]
fn a_session_that_ended_without_its_seal_is_sealed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    for record in records(PRESSES) {
        writer.accept(record).unwrap();
    }
    assert!(matches!(
        SessionWriter::open_ended::<Evt2>(&path),
        Err(RecorderError::InUse { .. })
    ));
    drop(writer);
    assert_sound(&path, false);
    SessionWriter::open_ended::<Evt2>(&path)
        .unwrap()
        .finish()
        .unwrap();
    assert_sound(&path, true);
    assert!(matches!(
        SessionWriter::open_ended::<Evt2>(&path),
        Err(RecorderError::AlreadyCompleted { .. })
    ));
}

/// A process that ends between the rows of the seal and the file hash leaves the placeholder.
#[test]
fn a_half_written_seal_is_detected_and_rewritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let whole = sealed(&path, PRESSES);
    let mut bytes = std::fs::read(&path).unwrap();
    let hash = whole.file_sha256;
    let at = bytes.windows(32).position(|w| w == hash).unwrap();
    let placeholder = Sha256::new()
        .chain_update(b"skinrig: the file hash goes here")
        .chain_update(whole.tree_sha256)
        .finalize();
    bytes[at..at + 32].copy_from_slice(&placeholder);
    // Still writable at that point.
    std::fs::remove_file(&path).unwrap();
    std::fs::write(&path, &bytes).unwrap();
    let report = verify::<Evt2>(&path).unwrap();
    assert!(report.is_sound() && !report.sealed, "{report:?}");
    assert!(
        report
            .remarks
            .iter()
            .any(|r| r.contains("sealing was interrupted")),
        "{report:?}"
    );
    SessionWriter::open_ended::<Evt2>(&path)
        .unwrap()
        .finish()
        .unwrap();
    assert_sound(&path, true);
    let seal = SessionReader::open(&path).unwrap().seal().unwrap().unwrap();
    assert_eq!(
        seal.tree_sha256, whole.tree_sha256,
        "the content is the same"
    );
}

/// A process that ends while it removes the seal leaves a file with pages of both states, and a journal beside it that
/// restores them.
#[test]
fn a_half_begun_leg_is_rolled_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    sealed(&path, 40);
    let before = std::fs::read(&path).unwrap();
    let (work, left) = (
        folder.path().join("w.sqlite"),
        folder.path().join("b.session.sqlite"),
    );
    std::fs::write(&work, &before).unwrap();
    with_file(&work, async |conn| {
        // A cache of one page: changed pages reach the file before the end.
        execute(
            conn,
            &[
                "PRAGMA cache_size = 1",
                "BEGIN IMMEDIATE",
                "DELETE FROM seal",
                "UPDATE chunk SET stored = zeroblob(length(stored) + 65536)",
            ],
        )
        .await;
        std::fs::copy(&work, &left).unwrap();
        let journal = |path: &std::path::Path| format!("{}-journal", path.display());
        std::fs::copy(journal(&work), journal(&left)).unwrap();
    });
    assert_ne!(
        std::fs::read(&left).unwrap(),
        before,
        "the file is changed already"
    );
    assert_sound(&left, true);
    assert_eq!(std::fs::read(&left).unwrap(), before);
}

#[test]
fn a_session_of_an_older_schema_is_resumed() {
    for was_sealed in [false, true] {
        check_older_schema(was_sealed);
    }
}

fn check_older_schema(was_sealed: bool) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    let first = if was_sealed { usize::MAX } else { 20 };
    for record in records(PRESSES).into_iter().take(first) {
        writer.accept(record).unwrap();
    }
    drop(writer);
    // As in schema 2: later schemas added preflight and legs.
    with_file(&path, async |conn| {
        execute(
            conn,
            &[
                "DROP TABLE previous_table_digest",
                "DROP TABLE previous_seal",
                "DROP TABLE preflight",
                "DROP TABLE leg",
                "DROP TABLE gap",
                "DROP TABLE notification",
                "DROP TABLE touch",
                "ALTER TABLE attempt DROP COLUMN leg",
                "ALTER TABLE attempt DROP COLUMN touched_mm",
                "ALTER TABLE attempt DROP COLUMN faults",
                "ALTER TABLE attempt DROP COLUMN cause",
                "ALTER TABLE interruption DROP COLUMN cause",
                "ALTER TABLE run_end DROP COLUMN cause",
                "DELETE FROM _sqlx_migrations WHERE version > 20261121120000",
                "PRAGMA user_version = 2",
            ],
        )
        .await;
    });
    if was_sealed {
        let ended = SessionWriter::open_ended::<Evt2>(&path).unwrap();
        ended.finish().unwrap();
    }
    assert_sound(&path, was_sealed);
    assert_eq!(SessionReader::open(&path).unwrap().legs().unwrap().len(), 1);
    resume(&path);
    assert_sound(&path, true);
    let reader = SessionReader::open(&path).unwrap();
    let legs = reader.legs().unwrap();
    assert_eq!(legs.len(), 2);
    assert_eq!(legs[0].tree_sha256.is_some(), was_sealed);
    assert_eq!(reader.header().unwrap(), header(PRESSES));
    // The seal of the old schema is verified from the rows of the new one.
    let report = verify::<Evt2>(&path).unwrap();
    assert_eq!(report.remarks, [""; 0]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    /// Interrupted at any record, twice, and resumed each time.
    #[test]
    fn a_session_is_resumed_from_any_record(first in 1usize..70, second in 1usize..70) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.session.sqlite");
        let begun = records(PRESSES);
        let first = first.min(begun.len());
        let mut writer = SessionWriter::create(&path).unwrap();
        for record in &begun[..first] {
            writer.accept(record.clone()).unwrap();
        }
        drop(writer);
        assert_sound(&path, false);

        let reader = SessionReader::open(&path).unwrap();
        let open = |reader: &SessionReader| -> Vec<AttemptId> {
            let presses = reader.presses().unwrap().into_iter();
            let attempts = presses.flat_map(|(_, attempts)| attempts);
            attempts.filter(|a| a.outcome.is_none()).map(|a| a.id).collect()
        };
        let cut_off = open(&reader);
        prop_assert!(cut_off.len() <= 1);
        let leg = further_leg(&reader.history().unwrap());
        drop(reader);
        let second = second.min(leg.len() - 1);
        let mut writer = SessionWriter::resume::<Evt2>(&path).unwrap();
        for record in &leg[..second] {
            writer.accept(record.clone()).unwrap();
        }
        drop(writer);
        assert_sound(&path, false);
        let reader = SessionReader::open(&path).unwrap();
        if let Some(id) = cut_off.first() {
            let presses = reader.presses().unwrap();
            let attempt = &presses[id.press.index() as usize].1[id.number as usize - 1];
            let verdict = &attempt.outcome.as_ref().unwrap().verdict;
            prop_assert_eq!(verdict, &PressVerdict::cut_off(1));
            let known = &reader.history().unwrap()[id.press.index() as usize];
            prop_assert!(known.attempts > id.number || known.verdict.is_none());
        }

        drop(reader); // a session with a reader is not sealed
        let last = resume(&path);
        assert_sound(&path, true);
        let reader = SessionReader::open(&path).unwrap();
        prop_assert_eq!(open(&reader), vec![]);
        let legs = reader.legs().unwrap();
        prop_assert_eq!(legs.len(), 3);
        check_round_trip(&reader, &legs[2], &last);
        let index = reader.chunk_index(CameraId::One).unwrap();
        let restarts = index.iter().filter(|m| m.restart_us.is_some()).count();
        let with_chunks = legs[1..].iter().enumerate().filter(|(k, leg)| {
            let end = legs.get(k + 2).map_or(index.len() as u64, |next| next.first_seq[0]);
            leg.first_seq[0] < end
        });
        prop_assert_eq!(restarts, with_chunks.count());
    }
}
