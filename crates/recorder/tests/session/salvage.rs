//! What is whole of a damaged session comes back, and what does not is told.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use skinrig_model::{CameraId, Record};
use skinrig_recorder::{
    RecorderError, SalvageReport, SessionReader, SessionWriter, salvage, verify,
};
use sqlx::{ConnectOptions, Row};

use crate::common::{Evt2, records, sealed};

const PAGE: usize = 65536;

/// Every table but `chunk`, whose rows are compared through the reader.
const TABLES: [(&str, &str); 14] = [
    (
        "session",
        "SELECT session_id || plan_json || seed || command_line AS row FROM session",
    ),
    (
        "robot_from_skin",
        "SELECT axis || ' ' || r_x || ' ' || t_mm AS row FROM robot_from_skin",
    ),
    ("device", "SELECT id || role || serial AS row FROM device"),
    (
        "setting",
        "SELECT device || name || read_back AS row FROM setting",
    ),
    (
        "preflight",
        "SELECT id || name || found AS row FROM preflight",
    ),
    ("press", "SELECT id || role || x_mm AS row FROM press"),
    (
        "attempt",
        "SELECT press || ' ' || number || coalesce(verdict, '') || coalesce(contact_ns, '') AS row FROM attempt",
    ),
    (
        "command",
        "SELECT id || ' ' || t_ns || x_mm AS row FROM command",
    ),
    (
        "pose_block",
        "SELECT id || hex(sha256) AS row FROM pose_block",
    ),
    ("mark", "SELECT id || ' ' || t_ns || kind AS row FROM mark"),
    (
        "box_report",
        "SELECT id || what || coalesce(box_us, '') AS row FROM box_report",
    ),
    (
        "trigger_edge",
        "SELECT camera || ' ' || seq || ' ' || t_us AS row FROM trigger_edge",
    ),
    (
        "run_end",
        "SELECT t_ns || status || reason AS row FROM run_end",
    ),
    (
        "interruption",
        "SELECT t_ns || kind || reason AS row FROM interruption",
    ),
];

fn tables(path: &Path) -> BTreeMap<&'static str, BTreeSet<String>> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    runtime.block_on(async {
        let options = sqlx::sqlite::SqliteConnectOptions::new()
            .filename(path)
            .read_only(true);
        let mut conn = options.connect().await.unwrap();
        let mut out = BTreeMap::new();
        for (name, sql) in TABLES {
            let rows = sqlx::query(sql).fetch_all(&mut conn).await.unwrap();
            out.insert(
                name,
                rows.iter().map(|r| r.get::<String, _>("row")).collect(),
            );
        }
        out
    })
}

fn chunks(path: &Path) -> BTreeMap<(CameraId, u64), Vec<u8>> {
    let reader = SessionReader::open(path).unwrap();
    let mut out = BTreeMap::new();
    for camera in CameraId::ALL {
        let read = reader.for_each_chunk(camera, 0, |meta, bytes| {
            out.insert((camera, meta.seq), bytes.to_vec());
        });
        read.unwrap();
    }
    out
}

struct Case {
    folder: tempfile::TempDir,
    tables: BTreeMap<&'static str, BTreeSet<String>>,
    chunks: BTreeMap<(CameraId, u64), Vec<u8>>,
}

impl Case {
    fn new(presses: u32) -> (Self, Vec<u8>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("good.session.sqlite");
        sealed(&path, presses);
        let bytes = std::fs::read(&path).unwrap();
        let (tables, chunks) = (tables(&path), chunks(&path));
        (
            Self {
                folder,
                tables,
                chunks,
            },
            bytes,
        )
    }

    /// Salvages a damaged copy. Every row is in the new file or told to be lost; gives the number of rows that came back.
    fn check(
        &self,
        damaged: &[u8],
        what: &str,
    ) -> (Result<SalvageReport, RecorderError>, usize, usize) {
        let [from, to] = ["from", "to"].map(|n| self.folder.path().join(n));
        let _ = std::fs::remove_file(&to);
        std::fs::write(&from, damaged).unwrap();
        let answer = salvage(&from, &to);
        let Ok(report) = &answer else {
            assert!(!to.exists(), "{what}");
            return (answer, 0, TABLES.len());
        };
        let (mut back, mut hurt) = (0, 0);
        for (name, rows) in tables(&to) {
            let lost = self.tables[name] != rows;
            hurt += usize::from(lost);
            back += rows.len();
            assert!(!lost || !report.is_whole(), "{what}: {name} in silence");
        }
        let found = chunks(&to);
        let mut lost_chunks = false;
        for ((camera, seq), bytes) in &self.chunks {
            let told = report
                .lost
                .iter()
                .any(|l| l.camera == *camera && (l.first_seq..=l.last_seq).contains(seq));
            lost_chunks |= told;
            match found.get(&(*camera, *seq)) {
                Some(came) if told => assert!(came.is_empty(), "{what}"),
                Some(came) => {
                    assert!(came == bytes, "{what}: {camera} chunk {seq} altered");
                    back += 1;
                }
                // The end of a stream cannot be missed by itself; the digest of the table tells.
                None => assert!(
                    !report.is_whole(),
                    "{what}: {camera} chunk {seq} in silence"
                ),
            }
        }
        (answer, back, hurt + usize::from(lost_chunks))
    }
}

#[test]
fn a_sound_session_comes_back_whole() {
    let (case, bytes) = Case::new(5);
    let (report, _, hurt) = case.check(&bytes, "sound");
    let report = report.unwrap();
    assert!(report.is_whole(), "{report:?}");
    assert_eq!(hurt, 0);
    let to = case.folder.path().join("to");
    assert_eq!(
        verify(&to, &mut Evt2::default()).unwrap().problems,
        Vec::<String>::new()
    );
    let notes = SessionReader::open(&to).unwrap().notes().unwrap();
    assert!(
        notes
            .last()
            .unwrap()
            .text
            .ends_with("nothing known to be lost"),
        "{notes:?}"
    );
    // Nothing is overwritten.
    let again = salvage(&case.folder.path().join("from"), &to);
    assert!(
        matches!(again, Err(RecorderError::Exists { .. })),
        "{again:?}"
    );
}

#[test]
fn a_damaged_byte_costs_one_table_at_most() {
    let (case, original) = Case::new(4);
    let mut bytes = original.clone();
    // The head of every page, and places all over the file; a step that is coprime to the page.
    let heads = (0..original.len() / PAGE).map(|n| n * PAGE);
    let heads = heads.flat_map(|at| [at, at + 4, at + 9, at + 100]);
    for at in heads.chain((0..original.len()).step_by(39_119)) {
        bytes[at] ^= 0x55;
        let (report, _, hurt) = case.check(&bytes, &format!("byte {at}"));
        report.unwrap();
        assert!(hurt <= 1, "byte {at} cost {hurt} tables");
        bytes[at] = original[at];
    }
}

#[test]
fn a_page_that_is_gone_costs_its_own_rows_only() {
    let (case, original) = Case::new(4);
    for page in 0..original.len() / PAGE {
        let mut bytes = original.clone();
        bytes[page * PAGE..(page + 1) * PAGE].fill(0);
        let (report, _, hurt) = case.check(&bytes, &format!("page {}", page + 1));
        report.unwrap();
        assert!(hurt <= 1, "page {} cost {hurt} tables", page + 1);
    }
}

#[test]
fn more_comes_back_of_a_longer_piece() {
    let (case, original) = Case::new(4);
    let (mut before, mut last) = (0, 0);
    for cut in (0..original.len())
        .step_by(PAGE / 2 + 7)
        .chain([original.len()])
    {
        let (report, back, _) = case.check(&original[..cut], &format!("cut at {cut}"));
        assert!(report.is_ok() || back == 0, "cut at {cut}");
        assert!(back >= before, "cut at {cut}: {back} rows after {before}");
        (before, last) = (back, cut);
    }
    assert_eq!(last, original.len());
    let all: usize = case.tables.values().map(BTreeSet::len).sum();
    assert_eq!(before, all + case.chunks.len());
}

/// A run that was cut off lies partly in the log. A damaged page there costs what it held, not what was written after it.
#[test]
fn a_damaged_log_costs_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.session.sqlite");
    let log = folder.path().join("x.session.sqlite-wal");
    let mut writer = SessionWriter::create(&path).unwrap();
    let all = records(6);
    for record in all
        .into_iter()
        .take_while(|r| !matches!(r, Record::Interruption { .. }))
    {
        writer.accept(record).unwrap();
    }
    // As a killed process leaves it: the last outcome is on the disk, nothing is moved out of the log.
    let (file, logged) = (std::fs::read(&path).unwrap(), std::fs::read(&log).unwrap());
    drop(writer);
    let attempts = tables(&path)["attempt"].clone();
    let frame = PAGE + 24;
    assert!(logged.len() > 8 * frame, "{} bytes", logged.len());
    let from = folder.path().join("cut.session.sqlite");
    let try_with = |logged: &[u8], name: &str| {
        std::fs::write(&from, &file).unwrap();
        std::fs::write(folder.path().join("cut.session.sqlite-wal"), logged).unwrap();
        let to = folder.path().join(name);
        let report = salvage(&from, &to).unwrap();
        (report, tables(&to))
    };
    let (report, whole) = try_with(&logged, "whole");
    assert!(report.findings.is_empty(), "{report:?}");
    assert_eq!(whole["attempt"], attempts);
    for n in (0..logged.len() / frame).step_by(5) {
        let mut damaged = logged.clone();
        damaged[32 + n * frame + 24 + 77] ^= 1;
        let (report, left) = try_with(&damaged, &format!("damaged{n}"));
        assert_eq!(report.findings.len(), 1, "{report:?}");
        let differ = left
            .iter()
            .filter(|(name, rows)| whole[*name] != **rows)
            .count();
        assert!(differ <= 1, "frame {n} cost {differ} tables");
    }
    let (report, cut) = try_with(&logged[..logged.len() - 1000], "cut");
    assert!(
        report.findings[0].contains("after the last whole page"),
        "{report:?}"
    );
    assert!(cut["attempt"].len() + 1 >= attempts.len());
}

#[test]
fn what_is_no_session_gives_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["from", "to"].map(|n| folder.path().join(n));
    assert!(matches!(
        salvage(&from, &to),
        Err(RecorderError::Missing { .. })
    ));
    for bytes in [
        Vec::new(),
        b"hello".to_vec(),
        vec![0x0D; 200_000],
        vec![0xFF; 70_000],
    ] {
        std::fs::write(&from, bytes).unwrap();
        let answer = salvage(&from, &to);
        assert!(
            matches!(answer, Err(RecorderError::NotASession { .. })),
            "{answer:?}"
        );
        assert!(!to.exists());
    }
}
