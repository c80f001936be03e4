//! Salvage: intact rows of a damaged session are recovered, and losses are reported.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use skinrig_model::CameraId;
use skinrig_recorder::{RecorderError, SalvageReport, SessionReader, salvage, verify};
use sqlx::{ConnectOptions, Row};

use crate::common::{Evt2, sealed};

mod log;
mod rows;

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

    /// Salvages a damaged copy. Every row is recovered or reported as lost; returns the number of recovered rows.
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
            assert!(
                !lost || !report.is_whole(),
                "{what}: {name} lost without a report"
            );
        }
        let found = chunks(&to);
        let mut lost_chunks = false;
        for ((camera, seq), bytes) in &self.chunks {
            let reported = report
                .lost
                .iter()
                .any(|l| l.camera == *camera && (l.first_seq..=l.last_seq).contains(seq));
            lost_chunks |= reported;
            match found.get(&(*camera, *seq)) {
                Some(came) if reported => assert!(came.is_empty(), "{what}"),
                Some(came) => {
                    assert!(came == bytes, "{what}: {camera} chunk {seq} altered");
                    back += 1;
                }
                // The loss of the end of a stream is visible only in the digest of the table.
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
fn an_intact_session_is_recovered_completely() {
    let (case, bytes) = Case::new(5);
    let (report, _, hurt) = case.check(&bytes, "sound");
    let report = report.unwrap();
    assert!(report.is_whole(), "{report:?}");
    assert_eq!(hurt, 0);
    let to = case.folder.path().join("to");
    assert_eq!(verify::<Evt2>(&to).unwrap().problems, []);
    let notes = SessionReader::open(&to).unwrap().notes().unwrap();
    assert!(
        notes.last().unwrap().text.ends_with("no known losses"),
        "{notes:?}"
    );
    // Existing files are not overwritten.
    let repeated = salvage(&case.folder.path().join("from"), &to);
    assert!(
        matches!(repeated, Err(RecorderError::Exists { .. })),
        "{repeated:?}"
    );
}

#[test]
fn a_damaged_byte_costs_one_table_at_most() {
    let (case, original) = Case::new(4);
    let mut bytes = original.clone();
    // The head of every page, and offsets all over the file; with a step that is coprime to the page size.
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
fn a_missing_page_loses_only_its_own_rows() {
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
fn a_longer_part_yields_more_rows() {
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

#[test]
fn a_damaged_byte_of_the_file_header_costs_nothing() {
    let (case, original) = Case::new(3);
    for at in 0..100 {
        let mut bytes = original.clone();
        bytes[at] ^= 0xFF;
        let (report, _, hurt) = case.check(&bytes, &format!("byte {at}"));
        let report = report.unwrap();
        assert!(report.is_whole() && hurt == 0, "byte {at}: {report:?}");
    }
}

#[test]
fn other_files_yield_nothing() {
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
