//! Listing a folder reads the head of each session and not its plan, its journal or its camera bytes.
//!
//! A separate program, because the read bytes are counted for all threads of the process.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test")]

#[path = "session/common.rs"]
#[expect(dead_code, reason = "only part of it is used here")]
mod common;

use std::io::Read;

use sha2::{Digest, Sha256};
use skinrig_model::{Record, RunHeader};
use skinrig_recorder::{SessionState, SessionWriter, list};

const SESSIONS: usize = 300;
/// As in a campaign of thousands of presses.
const PLAN_BYTES: usize = 4 << 20;
/// Pages of 64 KiB: the first, the schema's, and one or two of each small table in a listing.
const MOST_PAGES: u64 = 16;
const PAGE_BYTES: u64 = 65_536;

/// Bytes read by system calls of this process so far.
fn read_so_far() -> u64 {
    let mut text = String::new();
    let mut counters = std::fs::File::open("/proc/self/io").unwrap();
    counters.read_to_string(&mut text).unwrap();
    let count = text.lines().find_map(|l| l.strip_prefix("rchar: "));
    count.unwrap().parse().unwrap()
}

#[test]
fn a_listing_reads_a_few_pages_per_session() {
    let folder = tempfile::tempdir().unwrap();
    let first = folder.path().join("0.session.sqlite");
    let mut writer = SessionWriter::create(&first).unwrap();
    for record in common::records(4) {
        let record = match record {
            Record::Started(header) => {
                let plan_json = format!("[\"{}\"]", "x".repeat(PLAN_BYTES));
                let digest = Sha256::digest(&plan_json);
                Record::Started(Box::new(RunHeader {
                    plan_sha256: digest.iter().map(|b| format!("{b:02x}")).collect(),
                    plan_json,
                    ..*header
                }))
            }
            other => other,
        };
        writer.accept(record).unwrap();
    }
    writer.finish().unwrap();
    for n in 1..SESSIONS {
        let name = format!("{n}.session.sqlite");
        std::fs::hard_link(&first, folder.path().join(name)).unwrap();
    }
    let before = read_so_far();
    let sessions = list(folder.path()).unwrap();
    let pages = (read_so_far() - before).div_ceil(PAGE_BYTES * SESSIONS as u64);
    assert_eq!(sessions.len(), SESSIONS);
    for session in &sessions {
        assert!(matches!(
            &session.state,
            SessionState::Readable { sealed: true, .. }
        ));
        assert!(session.size_bytes > PLAN_BYTES as u64);
    }
    assert!(
        (1..=MOST_PAGES).contains(&pages),
        "{pages} pages per session"
    );
}
