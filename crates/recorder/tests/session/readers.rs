//! Concurrent readers of a session that is being written: none is blocked, and none blocks sealing permanently.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::SeqCst};

use skinrig_model::*;
use skinrig_recorder::{RecorderError, SessionReader, SessionState, SessionWriter, list, verify};

use crate::common::{Evt2, records};

const READERS: usize = 8;

fn read_everything(path: &Path) -> Result<(), RecorderError> {
    let reader = SessionReader::open(path)?;
    reader.header()?;
    reader.devices()?;
    reader.presses()?;
    reader.totals()?;
    reader.notes()?;
    reader.notifications()?;
    reader.touches()?;
    reader.interruptions()?;
    reader.seal()?;
    reader.for_each_pose_block(HostTime(i64::MIN), HostTime(i64::MAX), |_| ())?;
    for camera in CameraId::ALL {
        reader.for_each_chunk(camera, 0, |_, _| ())?;
        reader.trigger_edges(camera)?;
    }
    Ok(())
}

#[test]
fn eight_readers_are_never_blocked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    let mut all = records(20).into_iter();
    writer.accept(all.next().unwrap()).unwrap();
    let (done, rounds) = (AtomicBool::new(false), AtomicU64::new(0));
    let (sealed, errors) = std::thread::scope(|scope| {
        let readers: Vec<_> = (0..READERS)
            .map(|_| {
                scope.spawn(|| {
                    let mut errors = Vec::new();
                    while !done.load(SeqCst) {
                        errors.extend(read_everything(&path).err().map(|e| e.to_string()));
                        match &list(folder.path()).unwrap()[..] {
                            [only] => {
                                if let SessionState::Broken { reason } = &only.state {
                                    errors.push(reason.clone());
                                }
                            }
                            other => errors.push(format!("{other:?}")),
                        }
                        rounds.fetch_add(1, SeqCst);
                    }
                    errors
                })
            })
            .collect();
        for record in all {
            // The slowest readers see some of it.
            if matches!(record, Record::Ended { .. }) {
                while rounds.load(SeqCst) < 2 * READERS as u64 {
                    std::thread::yield_now();
                }
            }
            writer.accept(record).unwrap();
        }
        let sealed = writer.finish();
        done.store(true, SeqCst);
        let errors: Vec<String> = readers
            .into_iter()
            .flat_map(|r| r.join().unwrap())
            .collect();
        (sealed, errors)
    });
    assert_eq!(errors, [""; 0]);
    // Without a pause between two readers, sealing waits for the last one.
    if let Err(refused) = sealed {
        assert_next_step(&refused);
        SessionWriter::open_ended::<Evt2>(&path)
            .unwrap()
            .finish()
            .unwrap();
    }
    let report = verify::<Evt2>(&path).unwrap();
    assert!(report.sealed && report.is_sound(), "{report:?}");
}

fn assert_next_step(refused: &RecorderError) {
    let message = refused.to_string();
    for part in [
        "complete, but not sealed",
        "another program kept it open",
        "skinrig resume",
    ] {
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn a_reader_that_stays_open_only_delays_the_seal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let mut writer = SessionWriter::create(&path).unwrap();
    let mut all = records(3);
    let rest = all.split_off(4);
    for record in all {
        writer.accept(record).unwrap();
    }
    let reader = SessionReader::open(&path).unwrap();
    for record in rest {
        writer.accept(record).unwrap();
    }
    // The timeout is a setting; 60 s for a run.
    writer.set_seal_timeout(std::time::Duration::from_millis(100));
    let mut notices = 0;
    let refused = writer.finish_with_notice(|| notices += 1).unwrap_err();
    assert_next_step(&refused);
    assert_eq!(notices, 1);
    // The reader still reads everything, and so do others.
    assert_eq!(reader.presses().unwrap().len(), 3);
    read_everything(&path).unwrap();
    assert!(reader.end().unwrap().is_some() && reader.seal().unwrap().is_none());
    drop(reader);
    SessionWriter::open_ended::<Evt2>(&path)
        .unwrap()
        .finish()
        .unwrap();
    let report = verify::<Evt2>(&path).unwrap();
    assert!(report.sealed && report.is_sound(), "{report:?}");
}
