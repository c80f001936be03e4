//! Salvage of a session whose last rows are only in the write-ahead log.

use std::collections::{BTreeMap, BTreeSet};

use skinrig_model::Record;
use skinrig_recorder::{SalvageReport, SessionWriter, salvage};

use super::{PAGE, tables};
use crate::common::records;

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
