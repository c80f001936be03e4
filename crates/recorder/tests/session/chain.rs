//! Resuming sealed sessions: no damage is sealed again, and every earlier seal can be verified from the rows.

use std::path::Path;

use skinrig_recorder::{RecorderError, SessionReader, SessionWriter, verify};
use sqlx::ConnectOptions;
use sqlx::sqlite::SqliteConnectOptions;

use crate::common::{Evt2, further_leg, records, sealed};

const PRESSES: u32 = 4;

/// Small seeded generator (SplitMix64).
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

pub(crate) fn writable(path: &Path) {
    let mut permissions = std::fs::metadata(path).unwrap().permissions();
    #[expect(clippy::permissions_set_readonly_false, reason = "a file of this test")]
    permissions.set_readonly(false);
    std::fs::set_permissions(path, permissions).unwrap();
}

/// Continues the session; the writer is left unsealed unless `seal`.
fn resume(path: &Path, stop_after: usize, seal: bool) {
    let known = SessionReader::open(path).unwrap().history().unwrap();
    let mut writer = SessionWriter::resume::<Evt2>(path).unwrap();
    for record in further_leg(&known).into_iter().take(stop_after) {
        writer.accept(record).unwrap();
    }
    if seal {
        writer.finish().unwrap();
    }
}

fn change(path: &Path, statement: &'static str) {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    runtime.block_on(async {
        let options = SqliteConnectOptions::new()
            .filename(path)
            .foreign_keys(false);
        let mut conn = options.connect().await.unwrap();
        let changed = sqlx::query(statement).execute(&mut conn).await.unwrap();
        assert!(changed.rows_affected() > 0, "{statement}");
    });
}

/// One flipped bit anywhere in a sealed, stopped session: resuming is rejected, and the file stays unchanged.
#[test]
fn no_flipped_bit_is_sealed_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    sealed(&path, PRESSES);
    let whole = std::fs::read(&path).unwrap();
    let mut seed = 15;
    let used: Vec<usize> = (0..whole.len()).filter(|at| whole[*at] != 0).collect();
    for n in 0..48 {
        let bad = folder.path().join(format!("{n}.session.sqlite"));
        let mut bytes = whole.clone();
        // Every third offset anywhere, since most of a small session is empty; the others in non-zero bytes.
        let at = match n % 3 {
            0 => next(&mut seed) as usize % bytes.len(),
            _ => used[next(&mut seed) as usize % used.len()],
        };
        bytes[at] ^= 1 << (next(&mut seed) % 8);
        std::fs::write(&bad, &bytes).unwrap();
        let place = format!("byte {at}");
        match SessionWriter::resume::<Evt2>(&bad) {
            Err(
                RecorderError::Unsound { .. }
                | RecorderError::NotASession { .. }
                | RecorderError::NewerSchema { .. },
            ) => {}
            other => panic!("{place}: {other:?}"),
        }
        assert_eq!(std::fs::read(&bad).unwrap(), bytes, "{place}");
        assert!(!bad.with_extension("sqlite-lock").exists());
        std::fs::remove_file(&bad).unwrap();
    }
    resume(&path, usize::MAX, true);
}

/// The rows of a sealed leg are compared with that seal permanently, even while a later leg is unsealed.
#[test]
fn earlier_legs_cannot_be_rewritten() {
    let folder = tempfile::tempdir().unwrap();
    let original = folder.path().join("a.session.sqlite");
    let first = sealed(&original, PRESSES);
    // Cut off in its third attempt.
    resume(&original, 14, false);
    let problems = |path: &Path| verify::<Evt2>(path).unwrap().problems;
    assert_eq!(problems(&original), []);
    let legs = SessionReader::open(&original).unwrap().legs().unwrap();
    assert_eq!(legs[0].tree_sha256, Some(first.tree_sha256));
    for (n, (statement, found)) in [
        ("UPDATE device SET model = 'another' WHERE id = 1", "device"),
        (
            "UPDATE attempt SET measured_x_mm = measured_x_mm + 0.001 WHERE press = 1 AND number = 1",
            "attempt",
        ),
        (
            "UPDATE attempt SET verdict = 'invalid', reason = 'x' WHERE press = 1 AND number = 1",
            "counts of the previous seal",
        ),
        ("UPDATE attempt SET leg = 2 WHERE press = 1 AND number = 1", "attempt"),
        ("UPDATE note SET text = 'tip not cleaned' WHERE id = 1", "note"),
        ("UPDATE touch SET t_ns = t_ns + 1 WHERE id = 2", "touch"),
        (
            "UPDATE notification SET reason = NULL, cause = NULL WHERE id = 2",
            "notification",
        ),
        (
            "UPDATE leg SET previous_tree_sha256 = zeroblob(32) WHERE number = 2",
            "tree hash",
        ),
        (
            "UPDATE leg SET previous_tree_sha256 = NULL WHERE number = 2",
            "only in previous_seal",
        ),
        (
            "UPDATE leg SET previous_reason = 'another' WHERE number = 2",
            "run_end",
        ),
        ("DELETE FROM previous_seal", "only in its row"),
        (
            "UPDATE previous_seal SET valid = valid - 1, invalid = invalid + 1",
            "counts of the previous seal",
        ),
        (
            "UPDATE previous_table_digest SET rows = rows + 1 WHERE name = 'device'",
            "device",
        ),
        ("DELETE FROM previous_table_digest WHERE name = 'gap'", "gap"),
        (
            "UPDATE chunk SET host_ns = host_ns + 1 WHERE camera = 1 AND seq = 1",
            "chunk",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let path = folder.path().join(format!("{n}.session.sqlite"));
        std::fs::copy(&original, &path).unwrap();
        change(&path, statement);
        let problems = problems(&path);
        assert!(
            problems
                .iter()
                .any(|p| p.place.starts_with("leg 2: ") && p.to_string().contains(found)),
            "{statement}: {problems:?}"
        );
        assert!(matches!(
            SessionWriter::resume::<Evt2>(&path),
            Err(RecorderError::Unsound { .. })
        ));
    }
    // Rows added by the new leg are not covered.
    change(
        &original,
        "UPDATE device SET model = 'another' WHERE id = 3",
    );
    assert_eq!(problems(&original), []);
}

/// Several legs, some sealed and some cut off: every seal is verified.
#[test]
fn every_seal_of_many_legs_is_verified() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let mut trees = vec![Some(sealed(&path, PRESSES).tree_sha256)];
    for leg in 2..6 {
        let cut_off = leg % 2 == 1;
        let known = SessionReader::open(&path).unwrap().history().unwrap();
        let mut writer = SessionWriter::resume::<Evt2>(&path).unwrap();
        let mut leg_records = further_leg(&known);
        leg_records.truncate(11);
        for record in leg_records {
            writer.accept(record).unwrap();
        }
        if cut_off {
            drop(writer);
            trees.push(None);
        } else {
            // As at the end of a stopped run: every attempt has a verdict, and the remaining presses are missed.
            drop(writer);
            let mut stopped = SessionWriter::resume::<Evt2>(&path).unwrap();
            trees.push(None);
            let resumed = further_leg(&known).remove(0);
            stopped.accept(resumed).unwrap();
            let t = skinrig_model::HostTime(5);
            let end = crate::common::stopped();
            stopped
                .accept(skinrig_model::Record::Ended { t, end })
                .unwrap();
            trees.push(Some(stopped.finish().unwrap().tree_sha256));
        }
    }
    let report = verify::<Evt2>(&path).unwrap();
    assert_eq!((report.problems, report.remarks), (vec![], vec![]));
    let legs = SessionReader::open(&path).unwrap().legs().unwrap();
    let hashes: Vec<_> = legs.iter().map(|leg| leg.tree_sha256).collect();
    assert_eq!(hashes, trees);
    assert!(trees.iter().flatten().count() >= 3);
}

/// Verification makes a sealed but writable file read-only, if it is sound.
#[test]
fn a_writable_sealed_file_is_made_read_only() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    sealed(&path, PRESSES);
    writable(&path);
    let report = verify::<Evt2>(&path).unwrap();
    assert!(report.is_sound() && report.sealed, "{report:?}");
    assert!(report.remarks[0].contains("is read-only now"), "{report:?}");
    assert!(std::fs::metadata(&path).unwrap().permissions().readonly());
    let report = verify::<Evt2>(&path).unwrap();
    assert!(report.remarks.is_empty(), "{report:?}");
}

/// The file hash torn anywhere, as by a power cut: not sealed, not damaged, and sealed again with the same content.
#[test]
fn a_torn_file_hash_is_an_unfinished_seal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let whole = sealed(&path, PRESSES);
    let bytes = std::fs::read(&path).unwrap();
    let at = bytes
        .windows(32)
        .position(|w| w == whole.file_sha256)
        .unwrap();
    let placeholder = {
        use sha2::Digest as _;
        let mut hash = sha2::Sha256::new();
        hash.update(b"skinrig: the file hash goes here");
        hash.update(whole.tree_sha256);
        hash.finalize()
    };
    for written in [0, 1, 17, 31] {
        let torn = folder.path().join(format!("{written}.session.sqlite"));
        let mut bytes = bytes.clone();
        bytes[at + written..at + 32].copy_from_slice(&placeholder[written..]);
        std::fs::write(&torn, bytes).unwrap();
        let report = verify::<Evt2>(&torn).unwrap();
        assert!(report.is_sound() && !report.sealed, "{written}: {report:?}");
        assert!(report.remarks[0].contains("interrupted"), "{report:?}");
        let reopened = SessionWriter::open_ended::<Evt2>(&torn).unwrap();
        assert_eq!(reopened.finish().unwrap().tree_sha256, whole.tree_sha256);
        let report = verify::<Evt2>(&torn).unwrap();
        assert!(report.is_sound() && report.sealed, "{report:?}");
    }
}

/// A writer that ends before its header leaves an empty session, at any step, which never counts as damaged.
#[test]
fn a_session_without_a_header_is_empty() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    drop(SessionWriter::create(&path).unwrap());
    let bare = folder.path().join("b.session.sqlite");
    std::fs::write(&bare, "").unwrap();
    let begun = folder.path().join("c.session.sqlite");
    std::fs::write(&begun, "").unwrap();
    change_none(&begun);
    for path in [&path, &bare, &begun] {
        let refused = [
            verify::<Evt2>(path).map(drop),
            SessionWriter::resume::<Evt2>(path).map(drop),
            SessionReader::open(path).and_then(|reader| reader.header().map(drop)),
        ];
        for refused in refused {
            let refused = refused.unwrap_err();
            assert!(matches!(refused, RecorderError::Empty { .. }), "{refused}");
            assert!(refused.to_string().contains("delete the file"), "{refused}");
        }
    }
    let listed = skinrig_recorder::list(folder.path()).unwrap();
    for session in listed {
        assert_eq!(session.state, skinrig_recorder::SessionState::Empty);
    }
    // A session that lost its header is damaged.
    let path = folder.path().join("d.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    for record in records(PRESSES).into_iter().take(9) {
        writer.accept(record).unwrap();
    }
    drop(writer);
    change(&path, "DELETE FROM session");
    let report = verify::<Evt2>(&path).unwrap();
    assert!(!report.is_sound());
}

/// A new file before its schema: an empty first page.
fn change_none(path: &Path) {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    runtime.block_on(async {
        let options = SqliteConnectOptions::new().filename(path).page_size(65_536);
        let mut conn = options
            .journal_mode(sqlx::sqlite::SqliteJournalMode::Wal)
            .connect()
            .await
            .unwrap();
        let none = "SELECT count(*) FROM sqlite_schema";
        sqlx::query(none).execute(&mut conn).await.unwrap();
        sqlx::Connection::close(conn).await.unwrap();
    });
}
