//! Others read a session while it is written: nobody meets a lock, and nobody is kept from the session for good.

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
fn eight_readers_read_a_whole_session_and_none_meets_a_lock() {
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
            // The slowest of readers sees some of it.
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
    // With no instant between two readers the seal has to wait for the last of them.
    if let Err(refused) = sealed {
        assert_refusal_says_what_to_do(&refused);
        SessionWriter::open_ended(&path, &mut Evt2::default())
            .unwrap()
            .finish()
            .unwrap();
    }
    let report = verify(&path, &mut Evt2::default()).unwrap();
    assert!(report.sealed && report.is_sound(), "{report:?}");
}

fn assert_refusal_says_what_to_do(refused: &RecorderError) {
    let said = refused.to_string();
    for part in [
        "complete, but not sealed",
        "another program kept it open",
        "skinrig resume",
    ] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn a_reader_that_stays_puts_the_seal_off_and_no_more() {
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
    // How long it waits is a setting; 60 s for a run.
    writer.set_seal_timeout(std::time::Duration::from_millis(100));
    let mut told = 0;
    let refused = writer.finish_with_notice(|| told += 1).unwrap_err();
    assert_refusal_says_what_to_do(&refused);
    assert_eq!(told, 1);
    // It reads on what is all there, and so does everybody else.
    assert_eq!(reader.presses().unwrap().len(), 3);
    read_everything(&path).unwrap();
    assert!(reader.end().unwrap().is_some() && reader.seal().unwrap().is_none());
    drop(reader);
    SessionWriter::open_ended(&path, &mut Evt2::default())
        .unwrap()
        .finish()
        .unwrap();
    let report = verify(&path, &mut Evt2::default()).unwrap();
    assert!(report.sealed && report.is_sound(), "{report:?}");
}
