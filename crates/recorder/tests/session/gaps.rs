//! Time lost with bytes: stored in its own row, and checked against the times around it.

use crate::common::{Evt2, change, header};
use skinrig_model::*;
use skinrig_recorder::{ChunkScanner, SessionReader, SessionWriter, verify};

const CAMERA: CameraId = CameraId::Two;

/// A chunk after `lost` bytes with these time base words, in µs.
fn chunk(seq: u64, lost: u64, times_us: &[u64], scanner: &mut Evt2) -> RawChunk {
    let words = times_us.iter().map(|t| 0x8000_0000 | (t >> 6) as u32);
    let bytes: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
    if lost > 0 {
        scanner.lost(lost);
    }
    let (facts, triggers) = scanner.scan(&bytes);
    RawChunk {
        camera: CAMERA,
        seq,
        host_time: HostTime(seq as i64 * 1_000_000),
        lost_before: lost,
        lost_from_us: None,
        bytes,
        facts,
        triggers,
    }
}

/// A session in which camera 2 lost bytes four times: between two times, before an empty chunk and again after it, at a time reported
/// by the device as earlier, and at the end.
fn lossy(path: &std::path::Path) {
    let mut writer = SessionWriter::create(path).unwrap();
    let mut accept = |record| writer.accept(record).unwrap();
    accept(Record::Started(Box::new(header(1))));
    let mut scanner = Evt2::default();
    for (seq, (lost, times_us)) in (0..).zip([
        (0, &[640, 1280][..]),
        (8, &[6400]),
        (16, &[]),
        (4, &[]),
        (0, &[64_000, 128_000]),
        (4, &[192_000]),
        (12, &[]),
    ]) {
        let mut chunk = chunk(seq, lost, times_us, &mut scanner);
        if seq == 5 {
            chunk.lost_from_us = Some(32_000);
        }
        accept(Record::Chunk(chunk));
    }
    drop(writer);
}

fn time(from_us: u64, to_us: impl Into<Option<u64>>) -> LostTime {
    LostTime {
        from_us: Some(from_us),
        to_us: to_us.into(),
    }
}

#[test]
fn lost_time_extends_from_the_last_time_to_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    lossy(&path);
    let reader = SessionReader::open(&path).unwrap();
    let losses = reader.losses(CAMERA).unwrap();
    let reported: Vec<_> = losses.iter().map(|l| (l.seq, l.bytes, l.time)).collect();
    assert_eq!(
        reported,
        [
            (1, 8, time(1_280, 6_400)),
            (2, 20, time(6_400, 64_000)),
            (5, 4, time(32_000, 192_000)),
            (6, 12, time(192_000, None)),
        ]
    );
    assert_eq!(losses[0].time.span_us(), Some(5_120));
    assert_eq!(reader.gaps(CAMERA).unwrap()[3], (192_000, u64::MAX));
    let rows: Vec<_> = reader
        .chunk_index(CAMERA)
        .unwrap()
        .iter()
        .map(|m| m.lost_time)
        .collect();
    assert_eq!(
        rows,
        [
            None,
            Some(time(1_280, 6_400)),
            Some(time(6_400, 64_000)),
            Some(time(6_400, 64_000)),
            None,
            Some(time(32_000, 192_000)),
            Some(time(192_000, None)),
        ]
    );
    let report = verify::<Evt2>(&path).unwrap();
    assert_eq!(report.problems, []);
}

#[test]
fn a_gap_that_contradicts_its_surroundings_is_detected() {
    for (statement, words) in [
        ("UPDATE gap SET to_us = 70000 WHERE seq = 1", "to end with"),
        ("UPDATE gap SET to_us = NULL WHERE seq = 1", "to end with"),
        (
            "UPDATE gap SET from_us = NULL WHERE seq = 5",
            "to begin with",
        ),
        (
            "INSERT INTO gap VALUES (2, 4, 640, 6400)",
            "expected lost bytes",
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.session.sqlite");
        lossy(&path);
        change(&path, &[statement]);
        let problems = verify::<Evt2>(&path).unwrap().problems;
        assert!(
            problems.iter().any(|p| p.to_string().contains(words)),
            "{statement}: {problems:?}"
        );
    }
}

/// In a session of an older schema, losses are inferred from the chunks, whose facts are unchanged.
#[test]
fn gaps_of_an_older_session_are_inferred() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    lossy(&path);
    change(
        &path,
        &[
            "DROP TABLE gap",
            "DELETE FROM _sqlx_migrations WHERE version = 20261121170000",
            "PRAGMA user_version = 5",
        ],
    );
    let reader = SessionReader::open(&path).unwrap();
    let gaps = [
        (1_280, 6_400),
        (6_400, 64_000),
        (128_000, 192_000),
        (192_000, u64::MAX),
    ];
    assert_eq!(reader.gaps(CAMERA).unwrap(), gaps);
    let index = reader.chunk_index(CAMERA).unwrap();
    assert!(index.iter().all(|m| m.lost_time.is_none()));
    let report = verify::<Evt2>(&path).unwrap();
    assert_eq!(report.problems, []);
}
