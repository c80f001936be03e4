//! Copy of the cameras' newest bytes, made only while another terminal looks at them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use skinrig_device::newest_words;
use skinrig_model::{CameraId, RawChunk};

/// Bytes are copied for this long after a question.
const WATCHED_FOR: Duration = Duration::from_secs(2);
/// Shortest time between two copies of a camera's bytes.
const COPY_EVERY: Duration = Duration::from_millis(40);
/// Most bytes of a camera that are in no chunk yet, and as many of its chunks.
const MOST_BYTES: usize = 64 * 1024;

/// Newest bytes of one camera.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct CameraTail {
    /// End of the chunks so far, followed by the bytes that are in no chunk yet.
    pub bytes: Vec<u8>,
    /// When they were copied, s since 1970; 0 before the first copy.
    pub unix_s: f64,
}

#[derive(Debug, Default)]
struct Tail {
    chunks: Vec<u8>,
    open: Vec<u8>,
    copied: Option<(Instant, SystemTime)>,
}

/// The newest bytes of both cameras; the controller's thread writes, callers read.
#[derive(Debug)]
pub(super) struct NewestBytes {
    began: Instant,
    /// Time of the last question after `began`, ms; 0 without one.
    asked_ms: AtomicU64,
    tails: Mutex<[Tail; 2]>,
}

impl NewestBytes {
    pub(super) fn new() -> Self {
        Self {
            began: Instant::now(),
            asked_ms: AtomicU64::new(0),
            tails: Mutex::default(),
        }
    }

    fn now_ms(&self) -> u64 {
        self.began.elapsed().as_millis() as u64
    }

    /// True while a program asks for the newest bytes.
    pub(super) fn is_watched(&self) -> bool {
        let asked_ms = self.asked_ms.load(Ordering::Relaxed);
        asked_ms > 0 && self.now_ms() < asked_ms + WATCHED_FOR.as_millis() as u64
    }

    /// Most bytes to copy now; `None` while nobody looks, and shortly after a copy.
    pub(super) fn wants(&self) -> Option<usize> {
        if !self.is_watched() {
            return None;
        }
        // A caller that reads is not waited for.
        let tails = self.tails.try_lock().ok()?;
        let is_due = |tail: &Tail| tail.copied.is_none_or(|(t, _)| t.elapsed() >= COPY_EVERY);
        tails.iter().any(is_due).then_some(MOST_BYTES)
    }

    /// Adds bytes that are in no chunk yet.
    pub(super) fn copy(&self, camera: CameraId, bytes: Vec<u8>) {
        if let Ok(mut tails) = self.tails.try_lock() {
            let tail = &mut tails[camera.index()];
            tail.open = bytes;
            tail.copied = Some((Instant::now(), SystemTime::now()));
        }
    }

    /// Adds the end of a chunk, which holds the bytes copied so far.
    pub(super) fn chunk(&self, chunk: &RawChunk) {
        if !self.is_watched() {
            return;
        }
        let mut tails = self.tails.lock().unwrap_or_else(PoisonError::into_inner);
        let tail = &mut tails[chunk.camera.index()];
        if chunk.lost_before > 0 {
            tail.chunks.clear();
        }
        tail.open.clear();
        tail.chunks.extend(newest_words(&chunk.bytes, MOST_BYTES));
        tail.chunks = newest_words(&tail.chunks, MOST_BYTES);
    }

    /// Answers a caller, and lets bytes be copied for a while.
    pub(super) fn ask(&self) -> [CameraTail; 2] {
        let was_watched = self.is_watched();
        self.asked_ms.store(self.now_ms().max(1), Ordering::Relaxed);
        let mut tails = self.tails.lock().unwrap_or_else(PoisonError::into_inner);
        if !was_watched {
            // Chunks were missed meanwhile.
            *tails = Default::default();
        }
        tails.each_ref().map(|tail| {
            let since = tail.copied.map(|(_, t)| t.duration_since(UNIX_EPOCH));
            // Between the chunks and a longer copy, bytes are missing.
            let is_whole = tail.open.len() < MOST_BYTES;
            let chunks = if is_whole { &tail.chunks[..] } else { &[] };
            CameraTail {
                bytes: [chunks, &tail.open].concat(),
                unix_s: since.map_or(0.0, |s| s.unwrap_or_default().as_secs_f64()),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::{ChunkFacts, HostTime};

    use super::*;

    fn chunk(bytes: &[u8], lost_before: u64) -> RawChunk {
        RawChunk {
            camera: CameraId::One,
            seq: 0,
            host_time: HostTime::ZERO,
            lost_before,
            lost_from_us: None,
            bytes: bytes.to_vec(),
            facts: ChunkFacts::default(),
            triggers: Vec::new(),
        }
    }

    #[test]
    fn bytes_are_copied_only_while_somebody_looks() {
        let newest = NewestBytes::new();
        assert_eq!(newest.wants(), None);
        newest.chunk(&chunk(b"old.", 0));
        assert_eq!(newest.ask()[0], CameraTail::default());
        assert_eq!(newest.wants(), Some(MOST_BYTES));
        newest.copy(CameraId::One, b"aaaa".to_vec());
        assert_eq!(newest.ask()[0].bytes, b"aaaa");
        // The chunk repeats what was copied.
        newest.chunk(&chunk(b"aaaabbbb", 0));
        newest.copy(CameraId::One, b"cccc".to_vec());
        assert_eq!(newest.ask()[0].bytes, b"aaaabbbbcccc");
        assert!(newest.ask()[0].unix_s > 0.0 && newest.ask()[1].unix_s == 0.0);
        // Bytes before a loss do not continue.
        newest.chunk(&chunk(b"dddd", 8));
        assert_eq!(newest.ask()[0].bytes, b"dddd");
    }

    #[test]
    fn what_is_kept_is_bounded() {
        let newest = NewestBytes::new();
        newest.ask();
        for _ in 0..3 {
            newest.chunk(&chunk(&vec![1; MOST_BYTES + 4], 0));
        }
        assert_eq!(newest.ask()[0].bytes.len(), MOST_BYTES);
    }
}
