//! Checkpoints beside commits: the log of a busy stream stays short, and the file has what was committed.

use skinrig_model::*;
use skinrig_recorder::{ChunkMeta, SessionReader, SessionWriter};

use crate::common::header;

const CHUNK: usize = 4 << 20;
const CHUNKS: u64 = 26;
/// More than the log may hold before the writer waits, less than all chunks.
const MOST_LOG_BYTES: u64 = 80 << 20;

/// Words that do not fold, different in each chunk.
fn busy(seq: u64) -> Vec<u8> {
    let word = |k: u64| {
        (k + (seq << 32))
            .wrapping_mul(0x9E37_79B9_7F4A_7C15)
            .to_le_bytes()
    };
    (0..CHUNK as u64 / 8).flat_map(word).collect()
}

#[test]
fn the_log_of_a_busy_stream_starts_anew() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    let log = folder.path().join("a.session.sqlite-wal");
    let mut writer = SessionWriter::create(&path).unwrap();
    writer.accept(Record::Started(Box::new(header(4)))).unwrap();
    let mut most = 0;
    for seq in 0..CHUNKS {
        let chunk = RawChunk {
            camera: CameraId::One,
            seq,
            host_time: HostTime(seq as i64),
            lost_before: 0,
            lost_from_us: None,
            bytes: busy(seq),
            facts: ChunkFacts::default(),
            triggers: vec![],
        };
        writer.accept(Record::Chunk(chunk)).unwrap();
        most = most.max(log.metadata().unwrap().len());
    }
    let attempt = AttemptId {
        press: PressId::from_index(0),
        number: 1,
    };
    let t = HostTime(1);
    writer.accept(Record::Intent { attempt, t }).unwrap();
    most = most.max(log.metadata().unwrap().len());
    assert!(CHUNKS * CHUNK as u64 > MOST_LOG_BYTES);
    assert!(most < MOST_LOG_BYTES, "{most}");
    // Most of it is in the file while the session is open.
    assert!(path.metadata().unwrap().len() > MOST_LOG_BYTES / 2);
    drop(writer);
    assert!(!log.exists());
    let reader = SessionReader::open(&path).unwrap();
    let mut seq = 0;
    let each = |meta: ChunkMeta, bytes: &[u8]| {
        assert!(meta.seq == seq && bytes == busy(seq));
        seq += 1;
    };
    reader.for_each_chunk(CameraId::One, 0, each).unwrap();
    assert_eq!(seq, CHUNKS);
}
