//! Throughput from camera bytes to the session file, compared with a plain file.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::error::Error;
use std::hint::black_box;
use std::path::Path;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use skinrig_bench::Table;
use skinrig_bench::session::{header, plain_file};
use skinrig_formats::codec;
use skinrig_model::{AttemptId, CameraId, ChunkFacts, HostTime, PressId, RawChunk, Record};
use skinrig_recorder::SessionWriter;

const CHUNK: usize = 1 << 20;
const CHUNKS: u64 = 256;

const METHOD: &str = "bytes as they came per second until all are durable (WAL, synchronous=FULL, closed);
  the limit of busy streams is the one thread in SQLite: every byte goes into the log and from there into the file,
  with an fsync after each, while another thread hashes (SHA-256, CRC-32) and folds what comes next";

/// EVT2 words: a time word every 16 µs and `events` random events between two of them.
fn evt2(events: u32, bytes: usize) -> Vec<u8> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut words: Vec<u32> = Vec::with_capacity(bytes / 4);
    let mut t = 1_000_000u32;
    while words.len() < bytes / 4 {
        words.push(0x8000_0000 | t >> 6);
        words.extend((0..events).map(|_| random.next_u32() & 0x1FFF_FFFF));
        t += 16;
    }
    words.truncate(bytes / 4);
    words.into_iter().flat_map(u32::to_le_bytes).collect()
}

fn session(path: &Path, chunk: &[u8]) -> Result<(), Box<dyn Error>> {
    if path.exists() {
        std::fs::remove_file(path)?;
    }
    let mut writer = SessionWriter::create(path)?;
    writer.accept(Record::Started(Box::new(header())))?;
    for n in 0..CHUNKS {
        writer.accept(Record::Chunk(RawChunk {
            camera: CameraId::ALL[(n % 2) as usize],
            seq: n / 2,
            host_time: HostTime(n as i64),
            lost_before: 0,
            lost_from_us: None,
            bytes: chunk.to_vec(),
            facts: ChunkFacts::default(),
            triggers: vec![],
        }))?;
    }
    // Returns when all previous records are on the disk.
    let attempt = AttemptId {
        press: PressId::from_index(0),
        number: 1,
    };
    writer.accept(Record::Intent {
        attempt,
        t: HostTime(0),
    })?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let (busy, idle) = (evt2(160, CHUNK), evt2(0, CHUNK));
    let megabytes = (CHUNKS as usize * CHUNK) as f64 / 1e6;
    for (name, chunk) in [("busy", &busy), ("idle", &idle)] {
        let title = format!("ingest of two {name} EVT2 streams: {CHUNKS} chunks of 1 MiB in turn");
        let mut table = Table::new(&title, "MB", METHOD);
        let (file, database) = (folder.path().join("plain"), folder.path().join("session"));
        table.baseline("plain file, one fsync at the end", megabytes, move || {
            plain_file(&file, chunk, CHUNKS).expect("the temporary folder takes a file");
        });
        table.row("session file, one commit per 8 MiB", megabytes, move || {
            session(&database, chunk).expect("the temporary folder takes a session");
        });
        println!("{}", table.run(5));
    }
    let folded = codec::fold(&idle).ok_or("an idle stream folds")?;
    let mut table = Table::new(
        "th-rle in memory, 1 MiB chunks",
        "MB",
        "bytes as they came per second, one core",
    );
    let mb = CHUNK as f64 / 1e6;
    table.baseline("copy", mb, || drop(black_box(idle.clone())));
    table.row("fold, idle", mb, || drop(black_box(codec::fold(&idle))));
    table.row("fold, busy", mb, || drop(black_box(codec::fold(&busy))));
    table.row("unfold, idle", mb, || {
        drop(black_box(codec::unfold(&folded, CHUNK)))
    });
    println!("{}", table.run(100));
    Ok(())
}
