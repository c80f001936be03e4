//! Session files from an untrusted source.

use std::path::{Path, PathBuf};

use skinrig_formats::Scanner;
use skinrig_model::{
    CameraId, ChunkFacts, HostTime, Record, ResumeHeader, StreamFormat, TriggerEdge,
};
use skinrig_recorder::{ChunkScanner, RecorderError, SessionReader, SessionWriter};
use tempfile::TempDir;

/// Folder of one case, in memory if the system supports it.
pub struct Folder(TempDir);

impl Folder {
    #[expect(
        clippy::expect_used,
        reason = "a target without a place for files tests nothing"
    )]
    pub fn new() -> Self {
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() {
            TempDir::new_in(memory)
        } else {
            TempDir::new()
        };
        Self(folder.expect("a temporary folder"))
    }

    #[expect(
        clippy::expect_used,
        reason = "a target without a place for files tests nothing"
    )]
    pub fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("a temporary file");
        path
    }
}

/// Chunk decoder for `verify`.
struct Rescan(Scanner);

impl ChunkScanner for Rescan {
    fn new(format: StreamFormat) -> Self {
        Self(Scanner::new(format))
    }

    fn restart(&mut self, origin_us: u64) {
        self.0.restart(origin_us);
    }

    fn lost(&mut self, bytes: u64) {
        self.0.lost(bytes);
    }

    fn scan(&mut self, bytes: &[u8]) -> (ChunkFacts, Vec<TriggerEdge>) {
        self.0.push(bytes)
    }
}

/// Lists, reads, verifies, salvages and resumes a session file. It must stay a session, and only files that belong to it may
/// appear.
pub fn session(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.file("x.session.sqlite", bytes);
    let _ = skinrig_recorder::list(folder.0.path());
    let _ = read(&path);
    let _ = skinrig_recorder::verify::<Rescan>(&path);
    let saved = folder.0.path().join("saved.session.sqlite");
    if skinrig_recorder::salvage(&path, &saved).is_ok() {
        let _ = read(&saved);
    }
    let _ = go_on(&path);
}

/// Calls every method of the reader; an error of one does not prevent the next.
fn read(path: &Path) -> Result<(), RecorderError> {
    let reader = SessionReader::open(path)?;
    let _ = reader.session_id();
    let _ = reader.header();
    let _ = reader.seal();
    let _ = reader.devices();
    let _ = reader.totals();
    let _ = reader.presses();
    let _ = reader.last_outcomes();
    let _ = reader.preflight();
    let _ = reader.commands();
    let _ = reader.marks_sent();
    let _ = reader.box_reports();
    let _ = reader.interruptions();
    let _ = reader.notes();
    let _ = reader.end();
    let _ = reader.legs();
    let _ = reader.history();
    let _ = reader.for_each_pose_block(HostTime(i64::MIN), HostTime(i64::MAX), |_| ());
    for camera in CameraId::ALL {
        let _ = reader.chunk_index(camera);
        let _ = reader.for_each_chunk(camera, 0, |_, _| ());
        let _ = reader.gaps(camera);
        let _ = reader.trigger_edges(camera);
    }
    Ok(())
}

/// Begins a further leg, and abandons it.
fn go_on(path: &Path) -> Result<(), RecorderError> {
    let mut writer = SessionWriter::resume::<Rescan>(path)?;
    writer.accept(Record::Resumed(Box::new(ResumeHeader {
        operator: "stranger".into(),
        started_at: "2026-01-03T03:04:05Z".into(),
        host: "bench".into(),
        software: "0.1.0".into(),
        command_line: "skinrig resume".into(),
    })))?;
    writer.accept(Record::Note {
        t: HostTime(0),
        text: "here".into(),
    })
}
