//! Any changed byte of a sealed session is detected, and no damaged file causes a panic.

use std::path::Path;

use crate::chain::writable;
use crate::common::{Evt2, change, header, outcome, sealed, sha, with_file};
use skinrig_model::{AttemptId, CameraId, HostTime, PressId, PressVerdict, Record};
use skinrig_recorder::{RecorderError, SessionReader, SessionWriter, list, salvage, verify};

/// Bytes of a page of a session file.
const PAGE: usize = 65536;

/// Reads everything that a reader can read; errors are allowed.
fn read_all(path: &Path) {
    let Ok(reader) = SessionReader::open(path) else {
        return;
    };
    let _ = (
        reader.header(),
        reader.devices(),
        reader.presses(),
        reader.marks_sent(),
        reader.box_reports(),
    );
    let _ = (
        reader.commands(),
        reader.notes(),
        reader.notifications(),
        reader.touches(),
        reader.interruptions(),
        reader.end(),
        reader.totals(),
    );
    let _ = reader.poses(HostTime(i64::MIN), HostTime(i64::MAX));
    for camera in CameraId::ALL {
        let _ = (reader.trigger_edges(camera), reader.gaps(camera));
        let _ = reader.for_each_chunk(camera, 0, |_, _| {});
    }
}

fn check(original: &[u8], offsets: impl Iterator<Item = usize>, bit: impl Fn(usize) -> u8) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.session.sqlite");
    let mut bytes = original.to_vec();
    for offset in offsets {
        bytes[offset] ^= bit(offset);
        std::fs::write(&path, &bytes).unwrap();
        let report = verify::<Evt2>(&path).unwrap();
        assert!(!report.is_sound(), "byte {offset} was changed undetected");
        if offset % 7 == 0 {
            read_all(&path);
            list(folder.path()).unwrap();
        }
        bytes[offset] = original[offset];
    }
}

/// The root of a table points to its other pages: after a change, a search may find one of them again and again.
#[test]
fn a_page_that_points_elsewhere_ends_the_reading() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    sealed(&path, 450);
    let original = std::fs::read(&path).unwrap();
    for table in ["pose_block", "chunk"] {
        let root = with_file(&path, async |conn| {
            let sql = "SELECT rootpage FROM sqlite_schema WHERE name = ?";
            let page = sqlx::query_scalar::<_, i64>(sql).bind(table);
            page.fetch_one(conn).await.unwrap() as usize
        });
        // sqlite.org/fileformat.html section 1.6: an interior page of a table, its last child, and offsets of cells that begin with
        // the others; page numbers are big-endian.
        let page = (root - 1) * PAGE;
        assert_eq!(original[page], 5, "{table} has a single page");
        let cell = |n: usize| {
            let at = page + 12 + 2 * n;
            page + usize::from(u16::from_be_bytes([original[at], original[at + 1]]))
        };
        let children = [cell(0), cell(1), page + 8];
        for bit in 0..4 {
            let low_bytes = children.iter().map(|at| at + 3);
            check(&original, low_bytes, |_| 1 << bit);
        }
    }
}

/// Digests outlive a seal that was removed: rows that differ from them are damage, and are not sealed again.
#[test]
fn rows_that_differ_from_digests_without_a_seal_are_not_sealed_again() {
    let folder = tempfile::tempdir().unwrap();
    let original = folder.path().join("a.session.sqlite");
    sealed(&original, 4);
    writable(&original);
    change(&original, &["DELETE FROM seal"]);
    for (n, (statement, table)) in [
        ("UPDATE mark SET t_ns = t_ns + 1500000", "mark"),
        ("UPDATE device SET serial = '999'", "device"),
        ("UPDATE setting SET read_back = read_back + 1", "setting"),
        (
            "UPDATE robot_from_skin SET t_mm = t_mm + 1",
            "robot_from_skin",
        ),
        ("DELETE FROM preflight", "preflight"),
        ("DELETE FROM table_digest WHERE name = 'note'", "note"),
    ]
    .into_iter()
    .enumerate()
    {
        let path = folder.path().join(format!("{n}.session.sqlite"));
        std::fs::copy(&original, &path).unwrap();
        change(&path, &[statement]);
        let problems = verify::<Evt2>(&path).unwrap().problems;
        assert!(
            problems.iter().any(|p| p.place == table),
            "{statement}: {problems:?}"
        );
        match SessionWriter::open_ended::<Evt2>(&path) {
            Err(RecorderError::Unsound { .. }) => {}
            other => panic!("{statement}: {:?}", other.err()),
        }
    }
    // The session itself gets its seal again.
    assert!(verify::<Evt2>(&original).unwrap().is_sound());
    let writer = SessionWriter::open_ended::<Evt2>(&original).unwrap();
    writer.finish().unwrap();
    assert!(verify::<Evt2>(&original).unwrap().sealed);
}

/// A sealed session whose rows changed gives no results; it can still be looked at.
#[test]
fn changed_rows_of_a_sealed_session_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    sealed(&path, 4);
    SessionReader::open_checked(&path).unwrap();
    writable(&path);
    for (n, (statement, table)) in [
        (
            "UPDATE attempt SET measured_x_mm = measured_x_mm + 1 WHERE press = 1",
            "attempt",
        ),
        ("UPDATE press SET role = 'calibrate' WHERE id = 2", "press"),
        (
            "UPDATE chunk SET host_ns = host_ns + 1 WHERE seq = 0",
            "chunk",
        ),
        ("UPDATE seal SET tree_sha256 = zeroblob(32)", "seal"),
    ]
    .into_iter()
    .enumerate()
    {
        let changed = folder.path().join(format!("{n}.session.sqlite"));
        std::fs::copy(&path, &changed).unwrap();
        change(&changed, &[statement]);
        SessionReader::open(&changed).unwrap().presses().unwrap();
        match SessionReader::open_checked(&changed) {
            Err(RecorderError::Changed { tables, .. }) => assert_eq!(tables, [table]),
            other => panic!("{statement}: {other:?}"),
        }
        // What is salvaged has those values, too, and says so.
        let to = folder.path().join(format!("{n}.salvaged.session.sqlite"));
        let report = salvage(&changed, &to).unwrap();
        let sealed_rows = table != "seal";
        assert_eq!(
            report.changed.contains(&table.to_owned()),
            sealed_rows,
            "{statement}"
        );
        assert_eq!(report.is_whole(), !sealed_rows, "{statement}");
    }
    // The digests of a seal that is gone, as after a power cut, still hold.
    change(&path, &["DELETE FROM seal"]);
    SessionReader::open_checked(&path).unwrap();
    let role = "UPDATE press SET role = 'calibrate' WHERE id = 2";
    change(&path, &[role]);
    match SessionReader::open_checked(&path) {
        Err(RecorderError::Changed { tables, .. }) => assert_eq!(tables, ["press"]),
        other => panic!("{other:?}"),
    }
    // Without them, rows can only contradict each other.
    change(
        &path,
        &[
            "DELETE FROM table_digest",
            "UPDATE press SET role = 'score' WHERE id = 2",
        ],
    );
    SessionReader::open_checked(&path).unwrap();
    for (n, statement) in [
        "UPDATE run_end SET status = 'completed', reason = NULL, cause = NULL",
        "UPDATE run_end SET status = 'completed', reason = NULL",
        "UPDATE attempt SET cause = '\"never_attempted\"' WHERE verdict = 'valid'",
    ]
    .into_iter()
    .enumerate()
    {
        let changed = folder.path().join(format!("end{n}.session.sqlite"));
        std::fs::copy(&path, &changed).unwrap();
        change(&changed, &[statement]);
        let refused = SessionReader::open_checked(&changed);
        assert!(
            matches!(&refused, Err(RecorderError::Contradictory { .. })),
            "{statement}: {refused:?}"
        );
    }
    change(
        &path,
        &["UPDATE session SET protocol_text = protocol_text || '#'"],
    );
    let refused = SessionReader::open_checked(&path);
    assert!(
        matches!(
            &refused,
            Err(RecorderError::Contradictory { problems: 1, .. })
        ),
        "{refused:?}"
    );
}

/// Some commands read the header of a sealed session alone.
#[test]
fn a_header_that_is_not_the_sealed_one_is_not_shown() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    sealed(&path, 4);
    let whole = SessionReader::open(&path).unwrap();
    whole.header().unwrap();
    whole.headline().unwrap();
    writable(&path);
    change(
        &path,
        &["UPDATE session SET prototype = 'mold 9', rig_kind = 'bench'"],
    );
    let reader = SessionReader::open(&path).unwrap();
    for read in [reader.header().map(|_| ()), reader.headline().map(|_| ())] {
        match read {
            Err(RecorderError::Changed { tables, .. }) => assert_eq!(tables, ["session"]),
            other => panic!("{other:?}"),
        }
    }
    let problems = verify::<Evt2>(&path).unwrap().problems;
    assert!(
        problems.iter().any(|p| p.place.contains("session")),
        "{problems:?}"
    );
}

#[test]
fn planned_presses_match_the_plan_even_without_a_seal() {
    let verify_with = |move_mm: f64| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.session.sqlite");
        let mut header = header(3);
        let mut planned = header.presses.clone();
        planned[1].at.x_mm += move_mm;
        header.plan_json = serde_json::json!({ "presses": planned }).to_string();
        header.plan_sha256 = sha(&header.plan_json);
        let mut writer = SessionWriter::create(&path).unwrap();
        writer.accept(Record::Started(Box::new(header))).unwrap();
        drop(writer);
        verify::<Evt2>(&path).unwrap().problems
    };
    assert_eq!(verify_with(0.0), []);
    let problems = verify_with(5.0);
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert_eq!(
        (problems[0].place.as_str(), problems[0].expected.as_str()),
        ("press 2", "the press of the stored plan")
    );
}

#[test]
fn a_repeated_valid_sync_press_within_one_leg_is_detected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    let started = Record::Started(Box::new(header(1)));
    let twice = [1, 2].into_iter().flat_map(|number| {
        let attempt = AttemptId {
            press: PressId::from_index(0),
            number,
        };
        let t = HostTime(i64::from(number) * 20_000_000);
        [
            Record::Intent { attempt, t },
            Record::Outcome(outcome(attempt, t.0, PressVerdict::Valid)),
        ]
    });
    for record in std::iter::once(started).chain(twice) {
        writer.accept(record).unwrap();
    }
    drop(writer);
    let problems = verify::<Evt2>(&path).unwrap().problems;
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert!(
        problems[0].found == "one after a valid or excluded attempt",
        "{problems:?}"
    );
}

#[test]
fn any_flipped_byte_is_detected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("good");
    sealed(&path, 3);
    let original = std::fs::read(&path).unwrap();
    let n = original.len();
    assert_eq!(original[16..18], [0, 1], "pages of 64 KiB");
    // Offsets of a fixed multiplicative walk over the file, then the whole file header and the ends of pages.
    let walk = (0..250u64).map(|k| (k.wrapping_mul(0x9E37_79B9_7F4A_7C15) % n as u64) as usize);
    check(&original, walk, |offset| 1 << (offset % 8));
    check(&original, 0..112, |_| 0x01);
    check(&original, (0..n / PAGE).map(|page| page * PAGE), |_| 0x40);
    check(
        &original,
        (0..n / PAGE).map(|page| page * PAGE + PAGE - 1),
        |_| 0x80,
    );
}

#[test]
fn the_seals_own_page_is_covered() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("good");
    let seal = sealed(&path, 3);
    let original = std::fs::read(&path).unwrap();
    let at = original
        .windows(32)
        .position(|w| w == seal.file_sha256)
        .unwrap();
    check(&original, at - 100..at + 32, |_| 0xFF);
}

#[test]
fn truncated_and_extended_files_are_detected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("good");
    sealed(&path, 3);
    let original = std::fs::read(&path).unwrap();
    let changed = folder.path().join("x.session.sqlite");
    // A file truncated to zero bytes is like one without records: no session, and not sound either.
    std::fs::write(&changed, "").unwrap();
    let empty = verify::<Evt2>(&changed);
    assert!(
        matches!(empty, Err(RecorderError::Empty { .. })),
        "{empty:?}"
    );
    for keep in [50, 100, PAGE, original.len() / 2, original.len() - 1] {
        std::fs::write(&changed, &original[..keep]).unwrap();
        assert!(
            !verify::<Evt2>(&changed).unwrap().is_sound(),
            "{keep} bytes"
        );
        read_all(&changed);
    }
    std::fs::write(&changed, [original.as_slice(), &[0]].concat()).unwrap();
    assert!(!verify::<Evt2>(&changed).unwrap().is_sound());
}
