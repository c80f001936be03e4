//! Power loss: any part of the data not yet flushed to the disk may be missing or torn.

use std::path::{Path, PathBuf};

use super::lab::{
    Presses, SeededRandom, assert_resumes, campaign, journal, output_text, program, session_in,
};

/// Length of the header of a write-ahead log, and of each of its frames besides the page (sqlite.org/fileformat2.html, 4.1
/// and 4.2).
const LOG_HEADER: usize = 32;
const FRAME_HEADER: usize = 24;

fn log_of(session: &Path) -> PathBuf {
    let mut name = session.as_os_str().to_owned();
    name.push("-wal");
    name.into()
}

/// End of the last committed, and thus flushed, transaction of a log; 0 if there is none.
fn flushed(log: &[u8]) -> usize {
    let word = |at: usize| {
        let bytes = log.get(at..at + 4)?;
        Some(u32::from_be_bytes(bytes.try_into().ok()?))
    };
    let Some(page) = word(8) else { return 0 };
    let frame = FRAME_HEADER + page as usize;
    let salt = log.get(16..24);
    let mut last = 0;
    for at in (LOG_HEADER..).step_by(frame) {
        let (Some(pages), true) = (word(at + 4), at + frame <= log.len()) else {
            break;
        };
        if log.get(at + 8..at + 16) != salt {
            break; // of an earlier round of the log
        }
        if pages > 0 {
            last = at + frame;
        }
    }
    last
}

/// A campaign killed at a random journal write: its session, journal and log.
fn killed_campaign(random: &mut SeededRandom, folder: &Path) -> (PathBuf, Presses, Vec<u8>) {
    let n = 10 + random.below(20);
    let output = campaign(folder)
        .args(["--fault", &format!("killed@journal:{n}")])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), None, "{}", output_text(&output));
    let session = session_in(folder).unwrap();
    let log = std::fs::read(log_of(&session)).unwrap();
    let before = journal(&session).unwrap();
    (session, before, log)
}

#[test]
fn what_was_not_flushed_may_be_torn() {
    for seed in 0..4 {
        let mut random = SeededRandom(seed);
        let folder = tempfile::tempdir().unwrap();
        let (session, before, mut log) = killed_campaign(&mut random, folder.path());
        log.truncate(flushed(&log).max(LOG_HEADER));
        // Data in flight: any content, of any length.
        let length = random.below(20_000);
        log.extend(random.bytes(length));
        std::fs::write(log_of(&session), &log).unwrap();
        let case = format!("seed {seed}");
        assert_eq!(
            journal(&session).unwrap(),
            before,
            "{case}: what was flushed is there"
        );
        assert_resumes(&session, 1, &case);
    }
}

#[test]
fn a_truncated_log_yields_no_wrong_entry() {
    let mut sound = 0;
    for seed in 100..110 {
        let mut random = SeededRandom(seed);
        let folder = tempfile::tempdir().unwrap();
        let (session, before, mut log) = killed_campaign(&mut random, folder.path());
        let at = random.below(log.len() as u64) as usize;
        log.truncate(at);
        std::fs::write(log_of(&session), &log).unwrap();
        let case = format!("seed {seed}, cut at {at}");
        let verified = program(&["verify"]).arg(&session).output().unwrap();
        match verified.status.code() {
            Some(0) => {}
            // Detected: flushed pages are missing.
            Some(2 | 4) => continue,
            _ => panic!("{case}: {}", output_text(&verified)),
        }
        sound += 1;
        let now = journal(&session).unwrap();
        for ((_, now), (planned, before)) in now.iter().zip(&before) {
            for (is, was) in now.iter().zip(before) {
                // Unchanged, or an earlier state without the last outcome.
                let earlier = is.outcome.is_none() && is.id == was.id;
                assert!(is == was || earlier, "{case}: {}: {is:?}", planned.id);
            }
            assert!(now.len() <= before.len(), "{case}");
        }
        assert_resumes(&session, 1, &case);
    }
    assert!(sound > 0, "every cut was damage: the cuts are badly chosen");
}
