//! The record queue, in order and in bounded memory: accepted, prepared, written, durable.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use skinrig_model::Record;

use crate::error::{RecorderError, WriteFailure};
use crate::file_lock::RescueTargets;
use crate::prepared::{PreparedResult, is_durable};

/// Most bytes of records that may wait to be written; beyond that, [`accept`](crate::SessionWriter::accept) blocks.
const QUEUE_BYTES: usize = 64 << 20;

/// Longest time that a caller waits for the disk.
const DISK_TIMEOUT: Duration = Duration::from_secs(30);

/// Default time that sealing waits for other programs that have the session open.
const SEAL_TIMEOUT: Duration = Duration::from_secs(60);

/// No record reached the disk for this time.
struct DiskTimeout(Duration);

/// State shared by the caller, the preparation thread and the writer thread.
#[derive(Debug)]
pub(crate) struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
    disk_timeout: Duration,
}

impl Default for Shared {
    fn default() -> Self {
        Self {
            queue: Mutex::default(),
            changed: Condvar::new(),
            disk_timeout: DISK_TIMEOUT,
        }
    }
}

#[derive(Debug, Default)]
struct Queue {
    accepted: VecDeque<(Record, usize)>,
    /// True while a record is being prepared; it is then in neither `accepted` nor `prepared`.
    preparing: bool,
    prepared: VecDeque<(PreparedResult, usize)>,
    /// Bytes accepted and not yet written.
    bytes: usize,
    /// Highest value of `bytes`, and how often a caller waited for space.
    most_bytes: usize,
    waits: u64,
    /// Records accepted, and how many of them are durable, since the session was opened.
    taken: u64,
    durable: u64,
    failed: Option<WriteFailure>,
    closed: Option<CloseMode>,
    /// Another program has the session open and delays sealing.
    held_open: bool,
    seal_timeout: Option<Duration>,
}

/// Load of the record queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueLoad {
    /// Highest number of bytes that waited to be written.
    pub most_bytes: usize,
    /// Most bytes that may wait.
    pub limit_bytes: usize,
    /// How often the run waited for space. Data then accumulate in the drivers, which count what they drop.
    pub waits: u64,
}

/// How to close a session.
#[derive(Debug, Clone)]
pub(crate) enum CloseMode {
    /// Commit and leave it unsealed.
    Unsealed,
    /// Seal it.
    Seal,
    /// Save it elsewhere: it was moved or removed.
    Rescue(RescueTargets),
}

/// Next task of the writer thread.
pub(crate) enum WriterTask {
    /// Write these records, each with its bytes in the queue.
    Write(VecDeque<(PreparedResult, usize)>),
    /// Commit: no record arrived in time.
    Commit,
    /// Close the session: everything is written.
    Close(CloseMode),
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a change. Fails if the disk has accepted nothing since `since`: the tip must not stay in the skin because of a slow disk.
    fn wait_for_disk<'a>(
        &self,
        queue: MutexGuard<'a, Queue>,
        since: Instant,
    ) -> Result<MutexGuard<'a, Queue>, DiskTimeout> {
        let left = self.disk_timeout.saturating_sub(since.elapsed());
        if left.is_zero() {
            return Err(DiskTimeout(self.disk_timeout));
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

    /// Queues a record as soon as there is space. Durable records return only when they are on disk. Fails once writing
    /// has failed.
    ///
    /// # Errors
    /// [`RecorderError::WriteFailed`] if the record was not queued; [`RecorderError::WriteTimeout`] if it was queued but may not be durable.
    pub(crate) fn accept(&self, record: Record) -> Result<(), RecorderError> {
        let (bytes, durable) = (size_of(&record), is_durable(&record));
        let mut queue = self.lock();
        let full = |q: &Queue| q.failed.is_none() && q.bytes > 0 && q.bytes + bytes > QUEUE_BYTES;
        queue.waits += u64::from(full(&queue));
        let since = Instant::now();
        while full(&queue) {
            let waited = self.wait_for_disk(queue, since);
            queue = waited.map_err(|DiskTimeout(limit)| {
                RecorderError::WriteFailed(WriteFailure::Timeout(limit))
            })?;
        }
        if let Some(failure) = &queue.failed {
            return Err(RecorderError::WriteFailed(failure.clone()));
        }
        queue.accepted.push_back((record, bytes));
        queue.bytes += bytes;
        queue.most_bytes = queue.most_bytes.max(queue.bytes);
        queue.taken += 1;
        let number = queue.taken;
        self.changed.notify_all();
        while durable && queue.durable < number {
            if let Some(failure) = &queue.failed {
                return Err(RecorderError::WriteFailed(failure.clone()));
            }
            let waited = self.wait_for_disk(queue, since);
            queue = waited.map_err(|DiskTimeout(limit)| RecorderError::WriteTimeout(limit))?;
        }
        Ok(())
    }

    /// Load of the queue so far.
    pub(crate) fn load(&self) -> QueueLoad {
        let queue = self.lock();
        QueueLoad {
            most_bytes: queue.most_bytes,
            limit_bytes: QUEUE_BYTES,
            waits: queue.waits,
        }
    }

    /// Next record to prepare, with its bytes; `None` once the queue is closed.
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

    /// Passes on the result for the record that [`next_to_prepare`](Self::next_to_prepare) returned.
    pub(crate) fn push_prepared(&self, prepared: PreparedResult, bytes: usize) {
        let mut queue = self.lock();
        queue.preparing = false;
        if queue.failed.is_none() {
            queue.prepared.push_back((prepared, bytes));
        }
        self.changed.notify_all();
    }

    /// Waits for the next task of the writer thread. Returns a commit at `commit_at`.
    pub(crate) fn next_task(&self, commit_at: Option<Instant>) -> WriterTask {
        let mut queue = self.lock();
        loop {
            if !queue.prepared.is_empty() {
                return WriterTask::Write(std::mem::take(&mut queue.prepared));
            }
            if let Some(close) = queue.closed.clone()
                && queue.accepted.is_empty()
                && !queue.preparing
            {
                return WriterTask::Close(close);
            }
            match commit_at.filter(|_| queue.failed.is_none()) {
                None => queue = self.wait(queue),
                Some(at) => {
                    let left = at.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        return WriterTask::Commit;
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

    /// Frees the space of a record that was written.
    pub(crate) fn release(&self, bytes: usize) {
        let mut queue = self.lock();
        queue.bytes = queue.bytes.saturating_sub(bytes);
        self.changed.notify_all();
    }

    /// Reports that the first `records` records are on disk.
    pub(crate) fn mark_durable(&self, records: u64) {
        self.lock().durable = records;
        self.changed.notify_all();
    }

    /// Stops all writing. The first reason is kept.
    pub(crate) fn fail(&self, failure: WriteFailure) {
        let mut queue = self.lock();
        queue.failed.get_or_insert(failure);
        queue.accepted.clear();
        queue.preparing = false; // a record still being prepared is dropped; nothing waits for it
        queue.prepared.clear();
        queue.bytes = 0;
        self.changed.notify_all();
    }

    /// Reason why writing stopped, if it has.
    pub(crate) fn failure(&self) -> Option<WriteFailure> {
        self.lock().failed.clone()
    }

    /// How long sealing waits for other programs.
    pub(crate) fn seal_timeout(&self) -> Duration {
        self.lock().seal_timeout.unwrap_or(SEAL_TIMEOUT)
    }

    /// Sets how long sealing waits for other programs.
    pub(crate) fn set_seal_timeout(&self, timeout: Duration) {
        self.lock().seal_timeout = Some(timeout);
    }

    /// Reports that sealing waits for another program that has the session open.
    pub(crate) fn mark_held_open(&self) {
        self.lock().held_open = true;
    }

    /// Whether sealing waits for another program.
    pub(crate) fn is_held_open(&self) -> bool {
        self.lock().held_open
    }

    /// Closes the queue: no record follows.
    pub(crate) fn close(&self, mode: CloseMode) {
        self.lock().closed = Some(mode);
        self.changed.notify_all();
    }
}

/// Approximate memory of a record, bytes.
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
    fn a_full_queue_blocks_the_caller_and_counts_the_wait() {
        let shared = Shared::default();
        let most = QUEUE_BYTES / 4 * 3;
        assert!(shared.accept(chunk(most)).is_ok());
        let before = shared.load();
        assert!(before.most_bytes >= most && before.waits == 0, "{before:?}");
        std::thread::scope(|scope| {
            let second = scope.spawn(|| shared.accept(chunk(most)));
            // Whenever it arrives, it cannot be accepted before there is space.
            while shared.load().waits == 0 {
                std::thread::yield_now();
            }
            assert!(!second.is_finished());
            shared.release(before.most_bytes);
            assert!(second.join().is_ok_and(|accepted| accepted.is_ok()));
        });
        let after = shared.load();
        assert_eq!((after.most_bytes, after.waits), (before.most_bytes, 1));
    }

    /// A hanging disk ends the run while the tip can still be retracted.
    #[test]
    fn waiting_for_the_disk_times_out() {
        assert_eq!(Shared::default().disk_timeout, Duration::from_secs(30));
        let shared = Shared {
            disk_timeout: Duration::from_millis(50),
            ..Shared::default()
        };
        let end = Record::Ended {
            t: HostTime::ZERO,
            end: skinrig_model::RunEnd::Completed,
        };
        let refused = shared.accept(end);
        assert!(
            matches!(&refused, Err(RecorderError::WriteTimeout(limit)) if *limit == shared.disk_timeout),
            "{refused:?}"
        );
    }
}
