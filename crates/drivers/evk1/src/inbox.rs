//! Bounded queue of received bytes: filled by the USB event thread, emptied by the driver. The producer never blocks.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use skinrig_device::newest_words;
use skinrig_model::HostTime;

use crate::error::UsbError;

/// Bytes per word; blocks begin and end at word boundaries.
pub const WORD: usize = 4;

/// Contiguous received bytes, in whole words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// The bytes; empty if the block only reports a loss.
    pub bytes: Vec<u8>,
    /// Arrival of the last byte, or time of the loss.
    pub arrived: HostTime,
    /// Loss just before these bytes.
    pub lost_before: Option<Loss>,
}

/// Received bytes that were dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loss {
    /// Number of bytes.
    pub bytes: u64,
    /// Arrival of the last bytes before the loss, kept or already reported as lost; otherwise arrival of the first lost ones.
    pub since: HostTime,
    /// Arrival of the last lost bytes.
    pub until: HostTime,
}

/// The queue between the USB event thread and the driver.
///
/// Its producer never blocks: if the driver is too slow and the backlog is full, further bytes are counted and dropped until the driver
/// has taken half of the backlog.
#[derive(Debug)]
pub struct Inbox {
    chunk_bytes: usize,
    backlog_bytes: usize,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    ready: VecDeque<Block>,
    /// Bytes in `ready`.
    waiting: usize,
    /// The block being filled; may end within a word.
    open: Vec<u8>,
    /// Arrival of the last bytes, kept or dropped.
    last_arrival: Option<HostTime>,
    /// Loss before `open`, possibly continuing.
    loss: Option<Loss>,
    /// Whether bytes are being dropped.
    losing: bool,
    /// Bytes since the start modulo the word size, kept or dropped.
    phase: usize,
    error: Option<UsbError>,
    /// Failed transfers that were counted as losses.
    failed_transfers: u64,
}

/// Data taken from the queue.
#[derive(Debug, Default)]
pub struct QueuedData {
    /// Blocks in order of arrival.
    pub blocks: VecDeque<Block>,
    /// Error that ended the stream. All data before it is in `blocks`.
    pub error: Option<UsbError>,
}

impl Inbox {
    /// An empty queue with blocks of `chunk_bytes` and a capacity of about `backlog_bytes`.
    #[must_use]
    pub fn new(chunk_bytes: usize, backlog_bytes: usize) -> Self {
        Self {
            chunk_bytes,
            backlog_bytes,
            state: Mutex::default(),
        }
    }

    /// Ignores poisoning: the state is valid after every statement.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds bytes that arrived at `at`.
    pub fn push(&self, bytes: &[u8], at: HostTime) {
        if bytes.is_empty() {
            return;
        }
        let mut state = self.state();
        state.room(bytes.len(), self.chunk_bytes, self.backlog_bytes);
        if state.losing {
            state.lose(bytes.len(), at);
        } else {
            state.append(bytes, at, self.chunk_bytes);
        }
    }

    /// Counts a failed transfer at `at` as a loss of one word, because the amount is unknown. The next byte begins a word.
    pub fn lose_some(&self, at: HostTime) {
        let mut state = self.state();
        state.close();
        state.lose(WORD, at);
        state.phase = 0;
        state.failed_transfers += 1;
    }

    /// Number of failed transfers with losses.
    #[must_use]
    pub fn failed_transfers(&self) -> u64 {
        self.state().failed_transfers
    }

    /// Records the error that ended the stream; the first one stays.
    pub fn fail(&self, error: UsbError) {
        self.state().error.get_or_insert(error);
    }

    /// Takes the complete blocks.
    #[must_use]
    pub fn take_full(&self) -> QueuedData {
        let mut state = self.state();
        if state.error.is_some() {
            state.close();
        }
        state.take()
    }

    /// Takes all whole words; an incomplete word stays.
    #[must_use]
    pub fn take_all(&self) -> QueuedData {
        let mut state = self.state();
        state.close();
        state.take()
    }

    /// A copy of the newest whole words of the block being filled, at most `most` bytes.
    #[must_use]
    pub fn newest(&self, most: usize) -> Vec<u8> {
        newest_words(&self.state().open, most)
    }

    /// Looks at the block being filled; `None` if blocks wait before it, or bytes were lost.
    pub fn with_open<T>(&self, look: impl FnOnce(&[u8]) -> T) -> Option<T> {
        let state = self.state();
        let follows = state.ready.is_empty() && state.loss.is_none();
        follows.then(|| look(&state.open))
    }

    /// Takes everything at the end of a stream; an incomplete word counts as lost.
    #[must_use]
    pub fn finish(&self) -> QueuedData {
        let mut state = self.state();
        state.close();
        let rest = state.open.len();
        if rest > 0
            && let Some(at) = state.last_arrival
        {
            state.open.clear();
            state.add_loss(rest, at);
            state.close();
        }
        state.take()
    }
}

impl State {
    /// Decides whether `n` more bytes are kept.
    fn room(&mut self, n: usize, chunk_bytes: usize, backlog_bytes: usize) {
        let held = self.waiting + self.open.len();
        if self.losing {
            self.losing = held > backlog_bytes / 2;
        } else if held + n > backlog_bytes {
            self.losing = true;
            self.close();
        }
        if !self.losing && !self.open.is_empty() && self.open.len() + n > chunk_bytes {
            self.close();
        }
    }

    fn append(&mut self, bytes: &[u8], at: HostTime, chunk_bytes: usize) {
        // After a loss, also drop the rest of a word whose beginning was lost.
        let cut = match self.open.len() {
            0 => (WORD - self.phase) % WORD,
            _ => 0,
        }
        .min(bytes.len());
        if cut > 0 {
            self.lose(cut, at);
        }
        if self.open.capacity() < chunk_bytes {
            self.open.reserve_exact(chunk_bytes.max(bytes.len()) + WORD);
        }
        self.open.extend_from_slice(&bytes[cut..]);
        self.phase = (self.phase + bytes.len() - cut) % WORD;
        self.last_arrival = Some(at);
    }

    /// Drops `n` bytes, and the word that they split.
    fn lose(&mut self, n: usize, at: HostTime) {
        let torn = std::mem::take(&mut self.open).len();
        self.phase = (self.phase + n) % WORD;
        self.add_loss(torn + n, at);
        // A loss that continues after being reported starts where the reported one ended.
        self.last_arrival = Some(at);
    }

    fn add_loss(&mut self, n: usize, at: HostTime) {
        let since = self.last_arrival.unwrap_or(at);
        let loss = self.loss.get_or_insert(Loss {
            bytes: 0,
            since,
            until: at,
        });
        loss.bytes += n as u64;
        loss.until = at;
    }

    /// Closes the open block if it has content. An incomplete word moves to the next block.
    fn close(&mut self) {
        let whole = self.open.len() - self.open.len() % WORD;
        let arrived = match (whole, self.loss) {
            (0, None) => return,
            (0, Some(loss)) => Some(loss.until),
            _ => self.last_arrival,
        };
        let Some(arrived) = arrived else { return };
        let rest = self.open.split_off(whole);
        let mut bytes = std::mem::replace(&mut self.open, rest);
        if bytes.len() < bytes.capacity() / 2 {
            bytes.shrink_to_fit();
        }
        self.waiting += bytes.len();
        self.ready.push_back(Block {
            bytes,
            arrived,
            lost_before: self.loss.take(),
        });
    }

    fn take(&mut self) -> QueuedData {
        self.waiting = 0;
        QueuedData {
            blocks: std::mem::take(&mut self.ready),
            error: self.error.clone(),
        }
    }
}
