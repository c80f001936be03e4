//! Where arriving bytes wait: filled by the USB event thread, emptied by the driver. Bounded, and never in the way.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use skinrig_model::HostTime;

use crate::error::UsbError;

/// Bytes of one word; blocks begin and end between words.
pub const WORD: usize = 4;

/// Bytes that arrived one after the other, in whole words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// The bytes; none when a loss is all that there is to say.
    pub bytes: Vec<u8>,
    /// When the last of them arrived, or was lost.
    pub arrived: HostTime,
    /// What was lost just before them.
    pub lost_before: Option<Loss>,
}

/// Bytes that arrived and could not be kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loss {
    /// How many.
    pub bytes: u64,
    /// When the last bytes before the loss arrived, kept or told as lost; when the first lost ones did if there were
    /// none.
    pub since: HostTime,
    /// When the last lost ones arrived.
    pub until: HostTime,
}

/// The meeting point of the USB event thread and the driver.
///
/// Its producer never waits: when the driver lags by more than the backlog allows, further bytes are counted and let
/// go, until the driver has taken half of what waits.
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
    /// When the last bytes arrived, kept or lost.
    last_arrival: Option<HostTime>,
    /// What was lost before `open`, or is being lost.
    loss: Option<Loss>,
    /// Bytes are being let go.
    losing: bool,
    /// Bytes since the start, modulo the size of a word, kept or not.
    phase: usize,
    error: Option<UsbError>,
    /// Transfers that failed and were counted as a loss.
    failed_transfers: u64,
}

/// What the driver took out.
#[derive(Debug, Default)]
pub struct Taken {
    /// Blocks in the order of arrival.
    pub blocks: VecDeque<Block>,
    /// What ended the stream. Everything that came before is in `blocks`.
    pub error: Option<UsbError>,
}

impl Inbox {
    /// An empty inbox that closes blocks at `chunk_bytes` and keeps up to about `backlog_bytes`.
    #[must_use]
    pub fn new(chunk_bytes: usize, backlog_bytes: usize) -> Self {
        Self {
            chunk_bytes,
            backlog_bytes,
            state: Mutex::default(),
        }
    }

    /// A poisoned lock only says that a thread panicked; the state is valid after every statement.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes what arrived at `at`.
    pub fn push(&self, bytes: &[u8], at: HostTime) {
        if bytes.is_empty() {
            return;
        }
        let mut state = self.state();
        state.room(bytes.len(), self.chunk_bytes, self.backlog_bytes);
        if state.losing {
            state.lose(bytes.len(), at);
        } else {
            state.keep(bytes, at, self.chunk_bytes);
        }
    }

    /// A transfer failed and something was lost at `at`, nobody knows how much: it counts as one word, and what comes next begins a word.
    pub fn lose_some(&self, at: HostTime) {
        let mut state = self.state();
        state.close();
        state.lose(WORD, at);
        state.phase = 0;
        state.failed_transfers += 1;
    }

    /// How often a transfer failed and something was lost with it.
    #[must_use]
    pub fn failed_transfers(&self) -> u64 {
        self.state().failed_transfers
    }

    /// Notes what ended the stream; the first one counts.
    pub fn fail(&self, error: UsbError) {
        self.state().error.get_or_insert(error);
    }

    /// Takes the blocks that are full.
    #[must_use]
    pub fn take_full(&self) -> Taken {
        let mut state = self.state();
        if state.error.is_some() {
            state.close();
        }
        state.take()
    }

    /// Takes everything in whole words; the beginning of a word stays.
    #[must_use]
    pub fn take_all(&self) -> Taken {
        let mut state = self.state();
        state.close();
        state.take()
    }

    /// Takes everything at the end of a stream: the beginning of a word whose end never came is lost.
    #[must_use]
    pub fn finish(&self) -> Taken {
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

    fn keep(&mut self, bytes: &[u8], at: HostTime, chunk_bytes: usize) {
        // After a loss, the rest of a word whose beginning is lost is lost as well.
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

    /// Lets `n` bytes go, and with them the word that they tear.
    fn lose(&mut self, n: usize, at: HostTime) {
        let torn = std::mem::take(&mut self.open).len();
        self.phase = (self.phase + n) % WORD;
        self.add_loss(torn + n, at);
        // A loss that goes on after it was told begins where the told one ended.
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

    /// Closes the open block, if there is anything to say. The beginning of a word moves on to the next.
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

    fn take(&mut self) -> Taken {
        self.waiting = 0;
        Taken {
            blocks: std::mem::take(&mut self.ready),
            error: self.error.clone(),
        }
    }
}
