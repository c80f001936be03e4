//! Salvage: intact rows of a damaged session are recovered, and losses are reported.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use skinrig_model::{CameraId, Record};
use skinrig_recorder::{
    RecorderError, SalvageReport, SessionReader, SessionWriter, salvage, verify,
};
use sqlx::{ConnectOptions, Row};

use crate::common::{Evt2, further_leg, records, sealed};

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
    assert_eq!(verify::<Evt2>(&to).unwrap().problems, Vec::<String>::new());
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

/// A run as left by a killed process: the last outcome is on disk, and the log was not checkpointed.
struct KilledRun {
    folder: tempfile::TempDir,
    file: Vec<u8>,
    log: Vec<u8>,
    attempts: BTreeSet<String>,
}

const FRAME: usize = PAGE + 24;

impl KilledRun {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.session.sqlite");
        let mut writer = SessionWriter::create(&path).unwrap();
        let before_end = |r: &Record| !matches!(r, Record::Interruption { .. });
        for record in records(6).into_iter().take_while(before_end) {
            writer.accept(record).unwrap();
        }
        let file = std::fs::read(&path).unwrap();
        let log = std::fs::read(folder.path().join("x.session.sqlite-wal")).unwrap();
        drop(writer);
        assert!(log.len() > 8 * FRAME, "{} bytes", log.len());
        Self {
            attempts: tables(&path)["attempt"].clone(),
            folder,
            file,
            log,
        }
    }

    fn salvage(
        &self,
        log: &[u8],
        name: &str,
    ) -> (SalvageReport, BTreeMap<&'static str, BTreeSet<String>>) {
        let from = self.folder.path().join("cut.session.sqlite");
        std::fs::write(&from, &self.file).unwrap();
        std::fs::write(self.folder.path().join("cut.session.sqlite-wal"), log).unwrap();
        let to = self.folder.path().join(name);
        let report = salvage(&from, &to).unwrap();
        (report, tables(&to))
    }

    /// A frame of the log for page `number`, chained to `before`, with `commit` as the size after the commit.
    fn frame(&self, before: [u32; 2], number: u32, commit: u32, page: &[u8]) -> Vec<u8> {
        let head = [number.to_be_bytes(), commit.to_be_bytes()].concat();
        let [mut a, mut b] = before;
        let both = [head.as_slice(), page].concat();
        for pair in both.chunks_exact(8) {
            let word = |i: usize| {
                let four: [u8; 4] = pair[i..i + 4].try_into().unwrap();
                if self.log[3] & 1 == 1 {
                    u32::from_be_bytes(four)
                } else {
                    u32::from_le_bytes(four)
                }
            };
            a = a.wrapping_add(word(0)).wrapping_add(b);
            b = b.wrapping_add(word(4)).wrapping_add(a);
        }
        let sum = [a.to_be_bytes(), b.to_be_bytes()].concat();
        [head.as_slice(), &self.log[16..24], &sum, page].concat()
    }
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap())
}

#[test]
fn a_damaged_byte_of_the_log_header_costs_nothing() {
    let cut = KilledRun::new();
    let (_, whole) = cut.salvage(&cut.log, "whole");
    for (at, bits) in (0..32).flat_map(|at| [(at, 0xFF), (at, 1)]) {
        let mut log = cut.log.clone();
        log[at] ^= bits;
        let (report, left) = cut.salvage(&log, &format!("{at}.{bits}"));
        assert!(report.is_whole(), "byte {at}: {report:?}");
        assert_eq!(left, whole, "byte {at}");
    }
}

#[test]
fn uncommitted_pages_are_ignored() {
    let cut = KilledRun::new();
    let (_, whole) = cut.salvage(&cut.log, "whole");
    // The page with the results of the preflight, altered: its last image is in the log, its only one in the file.
    let holds = |page: &[u8]| page.windows(4).any(|w| w == b"2 GB");
    let in_log = cut.log[32..]
        .chunks_exact(FRAME)
        .map(|f| (word(f, 0), &f[24..]));
    let in_file = (1..).zip(cut.file.chunks_exact(PAGE));
    let (number, page) = in_file
        .chain(in_log)
        .filter(|(_, p)| holds(p))
        .last()
        .unwrap();
    let mut page = page.to_vec();
    let at = page.windows(4).position(|w| w == b"2 GB").unwrap();
    page[at] = b'9';
    let last = &cut.log[cut.log.len() - FRAME..];
    let end = [word(last, 16), word(last, 20)];
    let with = |before, commits: [u32; 3]| {
        let (mut log, mut before) = (cut.log.clone(), before);
        for commit in commits {
            let frame = cut.frame(before, number, commit, &page);
            before = [word(&frame, 16), word(&frame, 20)];
            log.extend(frame);
        }
        log
    };
    // Written ahead of a commit that was never made.
    let (report, left) = cut.salvage(&with(end, [0, 0, 0]), "ahead");
    assert!(report.is_whole(), "{report:?}");
    assert_eq!(left, whole);
    // The same with an overwritten beginning: the current frames do not chain to it.
    let (report, left) = cut.salvage(&with([1, 2], [0, 0, 0]), "over");
    assert_eq!(report.findings.len(), 1, "{report:?}");
    assert_eq!(left, whole);
    // A commit makes it part of the session.
    let (report, left) = cut.salvage(&with(end, [0, 0, 40]), "committed");
    assert!(report.is_whole(), "{report:?}");
    assert_ne!(left["preflight"], whole["preflight"]);
}

/// An interrupted run is partly in the log. A damaged page there costs its own rows, not the later ones.
#[test]
fn a_damaged_log_costs_a_page() {
    let cut = KilledRun::new();
    let (report, whole) = cut.salvage(&cut.log, "whole");
    assert!(report.findings.is_empty(), "{report:?}");
    assert_eq!(whole["attempt"], cut.attempts);
    for n in (0..cut.log.len() / FRAME).step_by(5) {
        let mut damaged = cut.log.clone();
        damaged[32 + n * FRAME + 24 + 77] ^= 1;
        let (report, left) = cut.salvage(&damaged, &format!("damaged{n}"));
        assert!(!report.findings.is_empty(), "{report:?}");
        let differ = left
            .iter()
            .filter(|(name, rows)| whole[*name] != **rows)
            .count();
        // The last frame is the commit of all frames written with it.
        let is_commit = n + 1 == cut.log.len() / FRAME;
        assert!(differ <= 1 || is_commit, "frame {n} cost {differ} tables");
    }
    let (report, left) = cut.salvage(&cut.log[..cut.log.len() - 1000], "cut");
    assert!(
        report.findings[0].contains("after the last whole page"),
        "{report:?}"
    );
    assert!(left["attempt"].len() + 1 >= cut.attempts.len());
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
        !problems.iter().any(|p| p.contains("host time")),
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
