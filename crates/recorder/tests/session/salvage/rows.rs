//! Salvage of sessions with missing or hostile rows.

use std::path::Path;

use skinrig_model::CameraId;
use skinrig_recorder::{SessionReader, SessionWriter, salvage, verify};
use sqlx::ConnectOptions;

use super::{Case, PAGE};
use crate::common::{Evt2, further_leg, sealed};

/// Runs statements on an unsealed session, and checkpoints the log.
fn alter(path: &Path, statements: &[&'static str]) {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    runtime.block_on(async {
        let options = sqlx::sqlite::SqliteConnectOptions::new().filename(path);
        let mut conn = options.foreign_keys(false).connect().await.unwrap();
        for statement in ["DELETE FROM seal", "DELETE FROM table_digest"]
            .iter()
            .chain(statements)
        {
            sqlx::query(*statement).execute(&mut conn).await.unwrap();
        }
        sqlx::Connection::close(conn).await.unwrap();
    });
}

#[test]
fn missing_rows_that_others_refer_to_are_reported() {
    let (case, bytes) = Case::new(5);
    let [from, to] = ["from", "to"].map(|n| case.folder.path().join(n));
    for (statement, finding) in [
        ("DELETE FROM session", "1 row of session"),
        ("DELETE FROM robot_from_skin", "3 row(s) of robot_from_skin"),
        (
            "DELETE FROM robot_from_skin WHERE axis = 2",
            "1 row(s) of robot_from_skin",
        ),
        (
            "UPDATE session SET plan_json = '{\"presses\":[1,2,3,4,5,6]}'",
            "1 press(es) of the plan",
        ),
        (
            "DELETE FROM press WHERE id = 4",
            "1 press(es) missing to which an attempt or a mark refers",
        ),
        (
            "DELETE FROM attempt WHERE press = 2",
            "1 press(es) with a mark but no attempt",
        ),
        (
            "DELETE FROM attempt WHERE press = 3 AND number = 1",
            "1 press(es) with a missing earlier attempt",
        ),
        (
            "UPDATE chunk SET seq = 9999999999 WHERE seq = 4",
            "chunk: 2 row(s) numbered too far",
        ),
    ] {
        std::fs::write(&from, &bytes).unwrap();
        let _ = std::fs::remove_file(&to);
        alter(&from, &[statement]);
        let report = salvage(&from, &to).unwrap();
        let reported = report.findings.iter().filter(|f| f.starts_with(finding));
        assert_eq!(reported.count(), 1, "{statement}: {report:?}");
        assert!(!report.is_whole());
    }
}

#[test]
fn missing_chunks_get_the_time_of_the_previous_one_within_their_leg() {
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["from", "to"].map(|n| folder.path().join(n));
    sealed(&from, 5);
    let known = SessionReader::open(&from).unwrap().history().unwrap();
    let mut writer = SessionWriter::resume::<Evt2>(&from).unwrap();
    for record in further_leg(&known) {
        writer.accept(record).unwrap();
    }
    writer.finish().unwrap();
    let reader = SessionReader::open(&from).unwrap();
    let before = reader.chunk_index(CameraId::One).unwrap();
    // Of the five chunks of the first leg and those of the second: one within, and two at the boundary of the legs.
    alter(
        &from,
        &["DELETE FROM chunk WHERE camera = 1 AND seq IN (2, 4, 5)"],
    );
    let report = salvage(&from, &to).unwrap();
    let reported = report.tables.iter().filter(|t| t.missing > 0);
    let reported: Vec<_> = reported.map(|t| (t.name.as_str(), t.missing)).collect();
    assert_eq!(reported, [("chunk", 3)]);
    let after = SessionReader::open(&to).unwrap();
    let after = after.chunk_index(CameraId::One).unwrap();
    assert_eq!(after[2].host_time, before[1].host_time);
    assert_eq!(after[4].host_time, before[3].host_time);
    assert!(after[5].host_time > before[4].host_time, "{after:?}");
    assert!(after[5].host_time <= before[5].host_time, "{after:?}");
    let problems = verify::<Evt2>(&to).unwrap().problems;
    assert!(
        !problems.iter().any(|p| p.expected.contains("host time")),
        "{problems:?}"
    );
}

/// A page with one row of `note`, most of which continues on page `next`.
fn note_with_overflow(id: u8, text_bytes: u32, next: u32) -> Vec<u8> {
    let varint = |n: u32| {
        [21, 14, 7]
            .map(|s| (n >> s) as u8 | 0x80)
            .into_iter()
            .chain([n as u8 & 0x7F])
    };
    let mut record = vec![7, 0, 1];
    record.extend(varint(2 * text_bytes + 13));
    record.push(0);
    let payload = record.len() as u32 + text_bytes;
    let least = (PAGE - 12) * 32 / 255 - 23;
    let even = least + (payload as usize - least) % (PAGE - 4);
    let local = if even <= PAGE - 35 { even } else { least };
    record.resize(local, b'a');
    let mut cell: Vec<u8> = varint(payload).collect();
    cell.push(id);
    cell.extend(record);
    cell.extend(next.to_be_bytes());
    let mut page = vec![0; PAGE];
    let at = PAGE - cell.len();
    page[..8].copy_from_slice(&[0x0D, 0, 0, 0, 1, (at >> 8) as u8, at as u8, 0]);
    page[8..10].copy_from_slice(&(at as u16).to_be_bytes());
    page[at..].copy_from_slice(&cell);
    page
}

/// An overflow page that continues on page `next`.
fn overflow_page(next: u32) -> Vec<u8> {
    let mut page = vec![b'a'; PAGE];
    page[..4].copy_from_slice(&next.to_be_bytes());
    page
}

#[test]
fn rows_with_endless_overflow_chains_are_omitted() {
    let (case, sound) = Case::new(3);
    let [from, to] = ["from", "to"].map(|n| case.folder.path().join(n));
    let pages = (sound.len() / PAGE) as u32;
    let last_note = |extra: Vec<Vec<u8>>| {
        std::fs::write(&from, [sound.clone(), extra.concat()].concat()).unwrap();
        let _ = std::fs::remove_file(&to);
        let report = salvage(&from, &to).unwrap();
        let notes = SessionReader::open(&to).unwrap().notes().unwrap();
        let longest = notes.iter().map(|n| n.text.len()).max();
        (report, longest.unwrap())
    };
    let whole = vec![
        note_with_overflow(9, 150_000, pages + 2),
        overflow_page(pages + 3),
        overflow_page(0),
    ];
    assert_eq!(last_note(whole).1, 150_000);
    let text_bytes = 30 << 16;
    let looping = vec![
        note_with_overflow(9, 10 << 16, pages + 2),
        overflow_page(pages + 2),
    ];
    assert!(last_note(looping).1 < 1000);
    let huge = vec![
        note_with_overflow(9, 100 << 20, pages + 2),
        overflow_page(pages + 2),
    ];
    assert!(last_note(huge).1 < 1000);
    // A hundred rows that share a chain of thirty pages.
    let mut shared: Vec<_> = (0..100)
        .map(|i| note_with_overflow(9 + i, text_bytes, pages + 101))
        .collect();
    shared.extend((1..=31).map(|i| overflow_page(pages + 101 + i)));
    let (report, _) = last_note(shared);
    assert!(
        report
            .findings
            .iter()
            .any(|f| f.contains("share overflow pages")),
        "{report:?}"
    );
}
