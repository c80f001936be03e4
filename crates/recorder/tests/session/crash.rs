//! A writer killed in mid-operation: acknowledged records are stored, and the file marks what was cut off.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use skinrig_model::*;
use skinrig_recorder::{ChunkScanner, RecorderError, SessionReader, SessionWriter, verify};

use crate::common::{ALIGNMENT_US, Evt2, further_leg, records, stream};

const PRESSES: u32 = 8;
/// Set in the child: number of acknowledged records to write, and the session file.
const CHILD: &str = "SKINRIG_TEST_KILLED_WRITER";

/// The records up to the `acknowledged`th acknowledged one.
fn beginning(acknowledged: usize) -> Vec<Record> {
    let mut left = acknowledged;
    let mut out = Vec::new();
    for record in records(PRESSES) {
        let durable = matches!(
            record,
            Record::Started(_) | Record::Intent { .. } | Record::Outcome(_)
        );
        out.push(record);
        left -= usize::from(durable);
        if left == 0 {
            return out;
        }
    }
    panic!("fewer than {acknowledged} acknowledged records");
}

fn chunks(records: &[Record], camera: CameraId) -> impl Iterator<Item = &RawChunk> {
    records.iter().filter_map(move |r| match r {
        Record::Chunk(chunk) if chunk.camera == camera => Some(chunk),
        _ => None,
    })
}

/// Bytes of the chunks after the acknowledged records, about 150 kB each.
fn later_bytes(seq: u64) -> Vec<u8> {
    (0..16)
        .flat_map(|k| stream(ALIGNMENT_US + (16 * seq + k) * 20_000, 1250))
        .collect()
}

/// Writes the acknowledged records, then chunks of both cameras, reporting each on standard output, until it is killed.
fn write_until_killed(path: &Path, acknowledged: usize) -> Result<(), RecorderError> {
    let mut writer = SessionWriter::create(path)?;
    let mut scanners = <[Evt2; 2]>::default();
    let beginning = beginning(acknowledged);
    let first = CameraId::ALL.map(|camera| chunks(&beginning, camera).count() as u64);
    for record in beginning {
        writer.accept(record)?;
    }
    for n in 0.. {
        for camera in CameraId::ALL {
            let seq = first[camera.index()] + n;
            let bytes = later_bytes(seq);
            let (facts, triggers) = scanners[camera.index()].scan(&bytes);
            writer.accept(Record::Chunk(RawChunk {
                camera,
                seq,
                host_time: HostTime(1_000_000_000 + n as i64),
                lost_before: 0,
                lost_from_us: None,
                bytes,
                facts,
                triggers,
            }))?;
        }
        // A closed pipe: the test is over.
        if writeln!(std::io::stdout(), "sent").is_err() {
            break;
        }
    }
    Ok(())
}

fn kill_after(path: &Path, acknowledged: usize, sent: usize) {
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args([
            "--exact",
            "crash::a_killed_writer_leaves_all_acknowledged_records",
            "--nocapture",
        ])
        .env(CHILD, format!("{acknowledged} {}", path.display()))
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    let observed = output
        .by_ref()
        .lines()
        .filter(|line| line.as_ref().unwrap() == "sent")
        .take(sent)
        .count();
    child.kill().unwrap();
    assert_eq!(observed, sent, "the child ended by itself");
    assert_eq!(child.wait().unwrap().code(), None, "killed by a signal");
}

#[test]
fn a_killed_writer_leaves_all_acknowledged_records() {
    if let Ok(task) = std::env::var(CHILD) {
        let (acknowledged, path) = task.split_once(' ').unwrap();
        return write_until_killed(Path::new(path), acknowledged.parse().unwrap()).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    // Kills after 1 to 17 acknowledged records and up to 80 rounds of chunks (20 MB: beyond commits and checkpoints).
    for seed in 0..8u64 {
        let random = (seed + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let acknowledged = 1 + (random >> 32) as usize % 17;
        let sent = 1 + (random >> 48) as usize % 80;
        let path = folder.path().join(format!("{seed}.session.sqlite"));
        kill_after(&path, acknowledged, sent);

        let place = format!("seed {seed}: {acknowledged} acknowledged, {sent} sent");
        let beginning = beginning(acknowledged);
        let report = verify::<Evt2>(&path).unwrap();
        assert_eq!((report.problems, report.sealed), (vec![], false), "{place}");
        let reader = SessionReader::open(&path).unwrap();
        assert!(reader.end().unwrap().is_none(), "{place}");
        let attempts: Vec<_> = reader
            .presses()
            .unwrap()
            .into_iter()
            .flat_map(|(_, attempts)| attempts)
            .map(|a| (a.id, a.outcome))
            .collect();
        let mut expected = Vec::new();
        let (mut commands, mut poses) = (0, 0);
        for record in &beginning {
            match record {
                Record::Intent { attempt, .. } => expected.push((*attempt, None)),
                Record::Outcome(o) => expected.last_mut().unwrap().1 = Some(o.clone()),
                Record::Command { .. } => commands += 1,
                Record::Poses(samples) => poses += samples.len() as u64,
                _ => {}
            }
        }
        assert_eq!(attempts, expected, "{place}");
        assert_eq!(reader.commands().unwrap().len(), commands, "{place}");
        assert_eq!(reader.totals().unwrap().pose_samples, poses, "{place}");
        for camera in CameraId::ALL {
            let mut acknowledged = chunks(&beginning, camera);
            reader
                .for_each_chunk(camera, 0, |meta, bytes| match acknowledged.next() {
                    Some(chunk) => assert_eq!(chunk.bytes, bytes, "{place}"),
                    None => assert_eq!(later_bytes(meta.seq), bytes, "{place}"),
                })
                .unwrap();
            assert!(acknowledged.next().is_none(), "{place}");
        }
        let known = reader.history().unwrap();
        drop(reader);
        let mut writer = SessionWriter::resume::<Evt2>(&path).unwrap();
        for record in further_leg(&known) {
            writer.accept(record).unwrap();
        }
        let totals = writer.finish().unwrap().totals;
        assert_eq!(totals.presses.valid, u64::from(PRESSES) - 1, "{place}");
        let report = verify::<Evt2>(&path).unwrap();
        assert_eq!((report.problems, report.sealed), (vec![], true), "{place}");
    }
}
