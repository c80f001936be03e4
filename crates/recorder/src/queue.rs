//! The way of a record: accepted, prepared, written, durable; in order, in bounded memory.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use skinrig_model::Record;

use crate::error::RecorderError;
use crate::held::Refuge;
use crate::prepared::{Prepared, is_durable};

/// Bytes of records that may wait to be written; beyond, [`accept`](crate::SessionWriter::accept) waits.
const QUEUE_BYTES: usize = 64 << 20;

/// Longest time for which a caller waits for the disk.
const PATIENCE: Duration = Duration::from_secs(30);

/// How long sealing waits for other programs that have the session open, unless told otherwise.
const SEAL_PATIENCE: Duration = Duration::from_secs(60);

/// What the caller, the preparing and the writing thread share.
#[derive(Debug)]
pub struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
    patience: Duration,
}

impl Default for Shared {
    fn default() -> Self {
        Self {
            queue: Mutex::default(),
            changed: Condvar::new(),
            patience: PATIENCE,
        }
    }
}

#[derive(Debug, Default)]
struct Queue {
    accepted: VecDeque<(Record, usize)>,
    /// One record is neither in `accepted` nor in `prepared`: it is being prepared.
    preparing: bool,
    prepared: VecDeque<(Prepared, usize)>,
    /// Bytes accepted and not yet written.
    bytes: usize,
    /// The most of them at any time, and how often a caller waited for room.
    most_bytes: usize,
    waits: u64,
    /// Records accepted, and how many of them are durable, since the beginning.
    taken: u64,
    durable: u64,
    failed: Option<String>,
    closed: Option<Close>,
    /// Another program keeps the session from being sealed.
    held_open: bool,
    seal_patience: Option<Duration>,
}

/// How full the queue of records has been.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueLoad {
    /// The most bytes that waited to be written at any time.
    pub most_bytes: usize,
    /// How many may wait.
    pub limit_bytes: usize,
    /// How often the run waited for room. Meanwhile data wait in the drivers, which count what they lose.
    pub waits: u64,
}

/// How a session is left.
#[derive(Debug, Clone)]
pub enum Close {
    /// Committed, readable, not sealed.
    AsItIs,
    /// Sealed.
    Seal,
    /// Brought to where it can be found: it was moved or removed.
    Rescue(Refuge),
}

/// What the writing thread does next.
pub enum Next {
    /// Writes these, each with its bytes in the queue.
    Write(VecDeque<(Prepared, usize)>),
    /// Commits: nothing came in time.
    Commit,
    /// Ends: everything is written.
    Close(Close),
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a change; gives up on a disk that took nothing since `since`: an arm must not wait for it in the skin.
    fn wait_for_disk<'a>(
        &self,
        queue: MutexGuard<'a, Queue>,
        since: Instant,
    ) -> Result<MutexGuard<'a, Queue>, String> {
        let left = self.patience.saturating_sub(since.elapsed());
        if left.is_zero() {
            return Err(format!(
                "expected the disk to take a record within {} s, found that it did not",
                self.patience.as_secs_f64()
            ));
        }
        let (queue, _) = self
            .changed
            .wait_timeout(queue, left)
            .unwrap_or_else(PoisonError::into_inner);
        Ok(queue)
    }

    fn wait<'a>(&self, queue: MutexGuard<'a, Queue>) -> MutexGuard<'a, Queue> {
        self.changed
            .wait(queue)
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a record when there is room for it, and returns when it is durable if it has to be; or says why
    /// nothing is written any more.
    ///
    /// # Errors
    /// [`RecorderError::Failed`] when it was not taken, [`RecorderError::Late`] when it was, and is not known to be durable.
    pub fn accept(&self, record: Record) -> Result<(), RecorderError> {
        let (bytes, durable) = (size_of(&record), is_durable(&record));
        let mut queue = self.lock();
        let full = |q: &Queue| q.failed.is_none() && q.bytes > 0 && q.bytes + bytes > QUEUE_BYTES;
        queue.waits += u64::from(full(&queue));
        let since = Instant::now();
        while full(&queue) {
            let waited = self.wait_for_disk(queue, since);
            queue = waited.map_err(RecorderError::Failed)?;
        }
        if let Some(detail) = &queue.failed {
            return Err(RecorderError::Failed(detail.clone()));
        }
        queue.accepted.push_back((record, bytes));
        queue.bytes += bytes;
        queue.most_bytes = queue.most_bytes.max(queue.bytes);
        queue.taken += 1;
        let mine = queue.taken;
        self.changed.notify_all();
        while durable && queue.durable < mine {
            if let Some(detail) = &queue.failed {
                return Err(RecorderError::Failed(detail.clone()));
            }
            let waited = self.wait_for_disk(queue, since);
            queue = waited.map_err(RecorderError::Late)?;
        }
        Ok(())
    }

    /// How full the queue has been.
    pub fn load(&self) -> QueueLoad {
        let queue = self.lock();
        QueueLoad {
            most_bytes: queue.most_bytes,
            limit_bytes: QUEUE_BYTES,
            waits: queue.waits,
        }
    }

    /// The next record to prepare, with its bytes; `None` when there will be no more.
    pub(crate) fn next_to_prepare(&self) -> Option<(Record, usize)> {
        let mut queue = self.lock();
        loop {
            if let Some(next) = queue.accepted.pop_front() {
                queue.preparing = true;
                return Some(next);
            }
            if queue.closed.is_some() {
                return None;
            }
            queue = self.wait(queue);
        }
    }

    /// Hands on what [`next_to_prepare`](Self::next_to_prepare) gave out.
    pub fn prepared(&self, prepared: Prepared, bytes: usize) {
        let mut queue = self.lock();
        queue.preparing = false;
        if queue.failed.is_none() {
            queue.prepared.push_back((prepared, bytes));
        }
        self.changed.notify_all();
    }

    /// What the writing thread does next; it has something to commit at `commit_at`.
    pub fn next(&self, commit_at: Option<Instant>) -> Next {
        let mut queue = self.lock();
        loop {
            if !queue.prepared.is_empty() {
                return Next::Write(std::mem::take(&mut queue.prepared));
            }
            if let Some(close) = queue.closed.clone()
                && queue.accepted.is_empty()
                && !queue.preparing
            {
                return Next::Close(close);
            }
            match commit_at.filter(|_| queue.failed.is_none()) {
                None => queue = self.wait(queue),
                Some(at) => {
                    let left = at.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        return Next::Commit;
                    }
                    queue = self
                        .changed
                        .wait_timeout(queue, left)
                        .unwrap_or_else(PoisonError::into_inner)
                        .0;
                }
            }
        }
    }

    /// Makes room: a record of so many bytes was written.
    pub fn written(&self, bytes: usize) {
        let mut queue = self.lock();
        queue.bytes = queue.bytes.saturating_sub(bytes);
        self.changed.notify_all();
    }

    /// The first `records` records are on the disk.
    pub fn durable(&self, records: u64) {
        self.lock().durable = records;
        self.changed.notify_all();
    }

    /// Nothing is written any more. The first reason stays.
    pub fn fail(&self, detail: String) {
        let mut queue = self.lock();
        queue.failed.get_or_insert(detail);
        queue.accepted.clear();
        queue.preparing = false; // what still comes is dropped, and nobody waits for it
        queue.prepared.clear();
        queue.bytes = 0;
        self.changed.notify_all();
    }

    /// Why nothing is written any more.
    pub fn failure(&self) -> Option<String> {
        self.lock().failed.clone()
    }

    /// How long sealing waits for other programs.
    pub(crate) fn seal_patience(&self) -> Duration {
        self.lock().seal_patience.unwrap_or(SEAL_PATIENCE)
    }

    /// Sets that time.
    pub(crate) fn set_seal_patience(&self, patience: Duration) {
        self.lock().seal_patience = Some(patience);
    }

    /// Another program keeps the session from being sealed; that is waited for.
    pub(crate) fn held_open(&self) {
        self.lock().held_open = true;
    }

    /// Whether one does.
    pub(crate) fn is_held_open(&self) -> bool {
        self.lock().held_open
    }

    /// No record follows.
    pub fn close(&self, how: Close) {
        self.lock().closed = Some(how);
        self.changed.notify_all();
    }
}

/// About how much memory a record takes.
fn size_of(record: &Record) -> usize {
    const SMALL: usize = 256;
    SMALL
        + match record {
            Record::Started(h) => {
                h.protocol_text.len() + h.plan_json.len() + h.rig_json.len() + 64 * h.presses.len()
            }
            Record::Chunk(chunk) => chunk.bytes.len() + 24 * chunk.triggers.len(),
            Record::Poses(samples) => 64 * samples.len(),
            _ => 0,
        }
}

#[cfg(test)]
mod tests {
    use skinrig_model::{CameraId, ChunkFacts, HostTime, RawChunk};

    use super::*;

    fn chunk(bytes: usize) -> Record {
        Record::Chunk(RawChunk {
            camera: CameraId::One,
            seq: 0,
            host_time: HostTime::ZERO,
            lost_before: 0,
            lost_from_us: None,
            bytes: vec![0; bytes],
            facts: ChunkFacts::default(),
            triggers: Vec::new(),
        })
    }

    #[test]
    fn who_finds_no_room_waits_and_is_counted() {
        let shared = Shared::default();
        let most = QUEUE_BYTES / 4 * 3;
        assert!(shared.accept(chunk(most)).is_ok());
        let before = shared.load();
        assert!(before.most_bytes >= most && before.waits == 0, "{before:?}");
        std::thread::scope(|scope| {
            let second = scope.spawn(|| shared.accept(chunk(most)));
            // It cannot be accepted before there is room, whenever it comes.
            while shared.load().waits == 0 {
                std::thread::yield_now();
            }
            assert!(!second.is_finished());
            shared.written(before.most_bytes);
            assert!(second.join().is_ok_and(|accepted| accepted.is_ok()));
        });
        let after = shared.load();
        assert_eq!((after.most_bytes, after.waits), (before.most_bytes, 1));
    }

    /// A disk that hangs ends the run while the arm can still be retracted.
    #[test]
    fn nobody_waits_for_a_disk_for_ever() {
        assert_eq!(Shared::default().patience, Duration::from_secs(30));
        let shared = Shared {
            patience: Duration::from_millis(50),
            ..Shared::default()
        };
        let end = Record::Ended {
            t: HostTime::ZERO,
            end: skinrig_model::RunEnd::Completed,
        };
        let refused = shared.accept(end);
        assert!(
            matches!(&refused, Err(RecorderError::Late(e)) if e.contains("expected the disk")),
            "{refused:?}"
        );
    }
}
