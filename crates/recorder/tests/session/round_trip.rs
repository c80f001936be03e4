//! Round trips of sealed, growing, interrupted and rejected sessions.

use crate::common::{Evt2, change, header, records, sealed, stopped, touches};
use skinrig_model::*;
use skinrig_recorder::{
    Codec, RecorderError, SessionReader, SessionState, SessionWriter, WriteFailure, list, verify,
};

#[test]
fn all_records_round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let seal = sealed(&path, 6);
    assert!(std::fs::metadata(&path).unwrap().permissions().readonly());
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "one file remains"
    );
    let reader = SessionReader::open(&path).unwrap();
    assert_eq!(reader.header().unwrap(), header(6));
    assert_eq!(reader.session_id().unwrap().len(), 32);
    assert_eq!(reader.seal().unwrap().unwrap().totals, seal.totals);
    let expected = records(6);
    let preflight = expected.iter().find_map(|r| match r {
        Record::Preflight(checks) => Some(checks.clone()),
        _ => None,
    });
    assert_eq!(Some(reader.preflight().unwrap()), preflight);
    let mut chunks = Vec::new();
    for camera in CameraId::ALL {
        let edges = reader.trigger_edges(camera).unwrap();
        let mut requested = Vec::new();
        reader
            .for_each_chunk(camera, 0, |meta, bytes| {
                assert_eq!(
                    reader.chunk_bytes(camera, meta.seq).unwrap(),
                    bytes,
                    "the reader is free"
                );
                chunks.push((
                    meta.camera,
                    meta.seq,
                    meta.host_time,
                    meta.lost_before,
                    meta.facts,
                    bytes.to_vec(),
                ));
            })
            .unwrap();
        for record in &expected {
            if let Record::Chunk(c) = record
                && c.camera == camera
            {
                requested.extend_from_slice(&c.triggers);
                let found = chunks
                    .iter()
                    .find(|f| (f.0, f.1) == (c.camera, c.seq))
                    .unwrap();
                assert_eq!(
                    (found.2, found.3, found.4, &found.5),
                    (c.host_time, c.lost_before, c.facts, &c.bytes)
                );
            }
        }
        assert_eq!(edges, requested);
        assert!(
            reader
                .chunk_index(camera)
                .unwrap()
                .iter()
                .all(|m| m.codec == Codec::TimeHighRuns)
        );
    }
    assert_eq!(chunks.len() as u64, seal.totals.chunks);
    let poses = reader.poses(HostTime(0), HostTime(i64::MAX)).unwrap();
    let all: Vec<PoseSample> = expected
        .iter()
        .filter_map(|r| match r {
            Record::Poses(p) => Some(p.clone()),
            _ => None,
        })
        .flatten()
        .collect();
    assert_eq!(poses.len(), all.len());
    assert!(
        poses
            .iter()
            .zip(&all)
            .all(
                |(a, b)| (a.t, a.commanded, a.measured) == (b.t, b.commanded, b.measured)
                    && a.force_n.is_nan()
            )
    );
    assert_eq!(
        reader
            .poses(HostTime(21_000_000), HostTime(24_000_000))
            .unwrap()
            .len(),
        4
    );
    let outcomes: Vec<_> = expected
        .iter()
        .filter_map(|r| match r {
            Record::Outcome(o) => Some(o.clone()),
            _ => None,
        })
        .collect();
    let presses = reader.presses().unwrap();
    let stored: Vec<_> = presses
        .iter()
        .flat_map(|(_, a)| a)
        .filter(|a| a.intent.is_some())
        .filter_map(|a| a.outcome.clone())
        .collect();
    assert_eq!(stored, outcomes);
    assert_eq!(presses[4].1[1].previous, Some(1));
    let last = reader.last_outcomes().unwrap();
    assert_eq!(last[4].as_ref().unwrap().verdict, PressVerdict::Valid);
    assert_eq!(
        last[5].as_ref().unwrap().verdict,
        PressVerdict::Missed(MissedReason::RunEnded(stopped()))
    );
    assert_eq!(reader.devices().unwrap().len(), 2);
    assert_eq!(reader.devices().unwrap()[1].settings[0].name, "bias_fo");
    assert_eq!(reader.commands().unwrap().len(), 6);
    assert_eq!(reader.marks_sent().unwrap().len(), 6);
    let reports: Vec<_> = expected
        .iter()
        .filter_map(|r| match r {
            Record::BoxReports { t, reports } => Some(reports.iter().map(|output| (*t, *output))),
            _ => None,
        })
        .flatten()
        .collect();
    assert_eq!(reports.len(), 30);
    assert_eq!(reader.box_reports().unwrap(), reports);
    assert_eq!(reader.notes().unwrap()[0].text, "tip cleaned");
    assert_eq!(reader.touches().unwrap(), touches());
    assert_eq!(
        reader.notifications().unwrap(),
        crate::common::notifications()
    );
    assert_eq!(
        reader.interruptions().unwrap()[0].kind,
        InterruptionKind::Stop
    );
    assert_eq!(reader.end().unwrap().unwrap().1, stopped());
    assert_eq!(reader.totals().unwrap(), seal.totals);
    let t = seal.totals;
    assert_eq!(
        (
            t.presses.planned,
            t.presses.valid,
            t.presses.missed,
            t.sync.valid
        ),
        (5, 4, 1, 1)
    );
    assert_eq!((t.lost_bytes, t.pose_samples), (12, 120));
    assert_eq!(reader.gaps(CameraId::One).unwrap(), []);
    let gaps = reader.gaps(CameraId::Two).unwrap();
    assert_eq!(gaps.len(), 1);
    assert!(gaps[0].0 < 5_040_000 && gaps[0].1 >= 5_039_936, "{gaps:?}");
    let report = verify::<Evt2>(&path).unwrap();
    assert_eq!(report.problems, []);
    assert!(report.sealed);
}

#[test]
fn durable_records_are_readable_immediately_and_a_dropped_writer_leaves_a_session() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    let mut intents = 0;
    for record in records(4) {
        if matches!(record, Record::Ended { .. }) {
            break;
        }
        let intent = matches!(record, Record::Intent { .. });
        let outcome = matches!(record, Record::Outcome(_));
        writer.accept(record).unwrap();
        if intent {
            intents += 1;
            let reader = SessionReader::open(&path).unwrap();
            let attempts: Vec<_> = reader
                .presses()
                .unwrap()
                .into_iter()
                .flat_map(|(_, a)| a)
                .collect();
            assert_eq!(attempts.len(), intents);
            assert!(attempts.last().unwrap().outcome.is_none());
        }
        if outcome {
            let reader = SessionReader::open(&path).unwrap();
            assert_eq!(reader.chunk_index(CameraId::Two).unwrap().len(), intents);
            assert_eq!(reader.totals().unwrap().pose_samples, 20 * intents as u64);
        }
    }
    drop(writer);
    let report = verify::<Evt2>(&path).unwrap();
    assert_eq!((report.problems, report.sealed), (vec![], false));
    let reader = SessionReader::open(&path).unwrap();
    assert_eq!(
        reader.notes().unwrap().len(),
        1,
        "including the last records"
    );
    assert!(reader.end().unwrap().is_none() && reader.seal().unwrap().is_none());
}

#[test]
fn wrong_order_is_rejected_and_a_failed_write_is_permanent() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    assert!(matches!(
        SessionWriter::create(&path),
        Err(RecorderError::Exists { .. })
    ));
    let note = || Record::Note {
        t: HostTime(0),
        text: "x".into(),
    };
    assert!(matches!(
        writer.accept(note()),
        Err(RecorderError::Record { .. })
    ));
    let mut wrong = header(3);
    wrong.plan_json.push(' ');
    let refused = writer.accept(Record::Started(Box::new(wrong))).unwrap_err();
    assert!(
        refused.to_string().starts_with("plan_sha256: expected "),
        "{refused}"
    );
    writer.accept(Record::Started(Box::new(header(3)))).unwrap();
    writer.accept(note()).unwrap();
    // An outcome without its intent.
    let id = AttemptId {
        press: PressId::from_index(1),
        number: 1,
    };
    let orphan = Record::Outcome(crate::common::outcome(id, 0, PressVerdict::Valid));
    let failed = writer.accept(orphan).unwrap_err();
    assert!(
        matches!(&failed, RecorderError::WriteFailed(WriteFailure::InvalidRecord { place, .. }) if place == "press 2 (attempt 1)"),
        "{failed}"
    );
    assert!(matches!(
        writer.accept(note()),
        Err(RecorderError::WriteFailed(_))
    ));
    assert!(matches!(
        writer.finish(),
        Err(RecorderError::WriteFailed(_))
    ));
    assert_eq!(
        SessionReader::open(&path).unwrap().header().unwrap(),
        header(3)
    );
}

#[test]
fn missing_chunks_and_nan_positions_are_rejected() {
    let bad_chunk = RawChunk {
        camera: CameraId::One,
        seq: 1,
        host_time: HostTime(0),
        lost_before: 0,
        lost_from_us: None,
        bytes: vec![],
        facts: ChunkFacts::default(),
        triggers: vec![],
    };
    let target = Point3::new(f64::NAN, 0.0, 0.0);
    let bad_command = MotionCommand {
        target,
        speed_mm_s: 1.0,
    };
    for record in [
        Record::Chunk(bad_chunk),
        Record::Command {
            t: HostTime(0),
            command: bad_command,
        },
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let mut writer = SessionWriter::create(&path).unwrap();
        let is_chunk = matches!(record, Record::Chunk(_));
        writer.accept(Record::Started(Box::new(header(3)))).unwrap();
        let (t, text) = (HostTime(0), "before".to_owned());
        writer.accept(Record::Note { t, text }).unwrap();
        writer.accept(record).unwrap();
        let id = AttemptId {
            press: PressId::from_index(0),
            number: 1,
        };
        let intent = Record::Intent {
            attempt: id,
            t: HostTime(0),
        };
        assert!(matches!(
            writer.accept(intent),
            Err(RecorderError::WriteFailed(_))
        ));
        drop(writer);
        if is_chunk {
            let notes = SessionReader::open(&path).unwrap().notes().unwrap();
            assert_eq!(notes.len(), 1, "earlier records are kept");
        }
    }
}

#[test]
fn a_session_is_sealed_only_when_it_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    for (name, without) in [("no-end", "end"), ("no-verdict", "verdict")] {
        let path = folder.path().join(name);
        let mut writer = SessionWriter::create(&path).unwrap();
        for record in records(3) {
            let skipped = match without {
                "end" => matches!(record, Record::Ended { .. }),
                _ => matches!(record, Record::Missed(..)),
            };
            if !skipped {
                writer.accept(record).unwrap();
            }
        }
        let refused = writer.finish().unwrap_err().to_string();
        assert!(
            refused.contains("cannot seal") && refused.contains(without),
            "{refused}"
        );
        assert!(
            SessionReader::open(&path)
                .unwrap()
                .seal()
                .unwrap()
                .is_none()
        );
    }
}

#[test]
fn other_files_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    assert!(matches!(
        SessionReader::open(at("none")),
        Err(RecorderError::Missing { .. })
    ));
    std::fs::write(at("short"), b"x").unwrap();
    std::fs::write(at("text"), vec![b'x'; 500]).unwrap();
    for path in [at("short"), at("text"), folder.path().to_owned()] {
        assert!(matches!(
            SessionReader::open(path),
            Err(RecorderError::NotASession { .. })
        ));
    }
    sealed(&at("good"), 3);
    let mut bytes = std::fs::read(at("good")).unwrap();
    bytes[63] = 99;
    std::fs::write(at("newer"), &bytes).unwrap();
    let newer = SessionReader::open(at("newer")).unwrap_err();
    assert!(
        matches!(newer, RecorderError::NewerSchema { found: 99, .. }),
        "{newer}"
    );
    bytes[68] = 0;
    std::fs::write(at("other"), &bytes).unwrap();
    assert!(matches!(
        SessionReader::open(at("other")),
        Err(RecorderError::NotASession { .. })
    ));
}

#[test]
fn a_folder_is_listed_with_its_broken_files() {
    let folder = tempfile::tempdir().unwrap();
    sealed(&folder.path().join("b.session.sqlite"), 3);
    let mut writer = SessionWriter::create(folder.path().join("a.session.sqlite")).unwrap();
    writer.accept(Record::Started(Box::new(header(3)))).unwrap();
    std::fs::write(folder.path().join("0.session.sqlite"), b"junk").unwrap();
    std::fs::write(folder.path().join("report.html"), b"x").unwrap();
    let sessions = list(folder.path()).unwrap();
    let names: Vec<_> = sessions
        .iter()
        .map(|s| s.path.file_name().unwrap().to_str().unwrap())
        .collect();
    assert_eq!(
        names,
        ["a.session.sqlite", "b.session.sqlite", "0.session.sqlite"]
    );
    let SessionState::Readable {
        sealed,
        end,
        totals,
        ..
    } = &sessions[1].state
    else {
        panic!()
    };
    let totals = totals.as_ref().unwrap();
    assert_eq!(
        (*sealed, end.as_deref(), totals.presses.planned),
        (true, Some("stopped"), 2)
    );
    let SessionState::Readable {
        sealed,
        end,
        presses,
        totals,
        ..
    } = &sessions[0].state
    else {
        panic!()
    };
    assert_eq!((*sealed, end, presses.open()), (false, &None, 2));
    assert_eq!(*totals, None, "rows of unsealed files are not counted");
    assert!(
        matches!(&sessions[2].state, SessionState::Broken { reason } if reason.contains("less than 108"))
    );
}

#[test]
fn sessions_of_the_first_schema_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    for record in records(4) {
        writer.accept(record).unwrap();
    }
    drop(writer);
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    runtime.block_on(async {
        use sqlx::{ConnectOptions, Connection, Executor, sqlite::SqliteConnectOptions};
        let options = SqliteConnectOptions::new().filename(&path);
        let mut conn = options.connect().await.unwrap();
        for sql in [
            "DROP TABLE preflight",
            "ALTER TABLE attempt DROP COLUMN touched_mm",
            "ALTER TABLE attempt DROP COLUMN faults",
            "ALTER TABLE attempt DROP COLUMN cause",
            "ALTER TABLE interruption DROP COLUMN cause",
            "ALTER TABLE run_end DROP COLUMN cause",
            "PRAGMA user_version = 1",
        ] {
            conn.execute(sql).await.unwrap();
        }
        conn.close().await.unwrap();
    });
    let reader = SessionReader::open(&path).unwrap();
    assert_eq!(reader.preflight().unwrap(), []);
    let outcomes = reader.last_outcomes().unwrap();
    let first = outcomes[0].as_ref().unwrap();
    assert_eq!(
        (first.measured_depth_mm, first.touched_mm),
        (Some(1.99), None)
    );
}

#[test]
fn touches_of_schema_13_have_no_depths() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    for record in records(4) {
        writer.accept(record).unwrap();
    }
    drop(writer);
    change(
        &path,
        &[
            "ALTER TABLE touch DROP COLUMN depth_within_mm",
            "ALTER TABLE touch DROP COLUMN depth_mm",
            "PRAGMA user_version = 13",
        ],
    );
    let without = touches().map(|touch| TouchEstimate {
        depth: None,
        ..touch
    });
    let reader = SessionReader::open(&path).unwrap();
    assert_eq!(reader.touches().unwrap(), without);
}
