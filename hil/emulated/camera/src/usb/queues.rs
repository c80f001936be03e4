//! Transfers of one device: queued, finished, and the bytes that are ready.
//!
//! As in Linux's usbfs, every open file has its own transfers, an interface belongs to one file, and results are fetched by the file that
//! submitted the transfer.

use std::collections::{BTreeMap, VecDeque};
use std::mem;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rustix::io::Errno;
use serde::{Deserialize, Serialize};

use super::readiness::Readiness;
use super::usbfs::Urb;

/// A submitted transfer: the URB and its address in the process under test.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SubmittedTransfer {
    pub address: u64,
    pub urb: Urb,
}

/// A finished transfer with its data and target address in the process.
#[derive(Debug)]
pub(crate) struct FinishedTransfer {
    pub address: u64,
    pub urb: Urb,
    pub to: u64,
    pub bytes: Vec<u8>,
    /// Number of bytes from the data endpoint, without control requests.
    pub data: bool,
}

/// Data delivered to the host from the data endpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct DeliveryTotals {
    /// Bytes.
    pub bytes: u64,
    /// CRC-32 (IEEE 802.3) over all of them.
    pub crc32: u32,
    /// Transfers.
    pub transfers: u64,
}

#[derive(Debug, Default)]
struct OpenFile {
    /// Transfers that wait for bytes.
    waiting: VecDeque<SubmittedTransfer>,
    /// Control requests that are never answered.
    unanswered: Vec<SubmittedTransfer>,
    done: VecDeque<FinishedTransfer>,
}

#[derive(Debug)]
struct State {
    files: BTreeMap<u64, OpenFile>,
    next_file: u64,
    claimed_by: Option<u64>,
    unplugged: bool,
    halted: bool,
    /// Bytes not yet taken by a transfer, oldest first; the first `head` are gone.
    fifo: VecDeque<Vec<u8>>,
    head: usize,
    level: usize,
    /// Whether the last byte of the FIFO ends a packet.
    ended: bool,
    /// Bytes by which the next transfer ends early.
    cut: Option<usize>,
    /// Transfers until one fails.
    broken: Option<u32>,
    resets_fail: bool,
    delivered: DeliveryTotals,
    ready: Readiness,
}

/// Queues of one device. `room` is signalled when a transfer is queued.
#[derive(Debug)]
pub(crate) struct Queues {
    state: Mutex<State>,
    room: Condvar,
    capacity: usize,
}

/// ID of a program outside the processes under test that has claimed the interface of a busy
/// device.
const OTHER_PROGRAM: u64 = 0;

impl Queues {
    /// The queues of a device that can hold `capacity` bytes.
    pub(crate) fn new(capacity: usize, ready: Readiness) -> Self {
        let state = State {
            files: BTreeMap::new(),
            next_file: OTHER_PROGRAM + 1,
            claimed_by: None,
            unplugged: false,
            halted: false,
            fifo: VecDeque::new(),
            head: 0,
            level: 0,
            ended: false,
            cut: None,
            broken: None,
            resets_fail: false,
            delivered: DeliveryTotals::default(),
            ready,
        };
        Self {
            state: Mutex::new(state),
            room: Condvar::new(),
            capacity,
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Marks the interface as claimed by another program.
    pub(crate) fn occupy(&self) {
        self.lock().claimed_by = Some(OTHER_PROGRAM);
    }

    // ---- from the process under test

    pub(crate) fn open(&self) -> u64 {
        let mut state = self.lock();
        let file = state.next_file;
        state.next_file += 1;
        state.files.insert(file, OpenFile::default());
        file
    }

    pub(crate) fn close(&self, file: u64) {
        let mut state = self.lock();
        state.files.remove(&file);
        if state.claimed_by == Some(file) {
            state.claimed_by = None;
        }
        state.update_readiness();
    }

    pub(crate) fn claim(&self, file: u64) -> Result<(), Errno> {
        let mut state = self.lock();
        state.plugged()?;
        if state.claimed_by.is_some_and(|by| by != file) {
            return Err(Errno::BUSY);
        }
        state.claimed_by = Some(file);
        Ok(())
    }

    pub(crate) fn release(&self, file: u64) -> Result<(), Errno> {
        let mut state = self.lock();
        state.plugged()?;
        if state.claimed_by != Some(file) {
            return Err(Errno::INVAL);
        }
        state.claimed_by = None;
        Ok(())
    }

    pub(crate) fn plugged(&self) -> Result<(), Errno> {
        self.lock().plugged()
    }

    /// A transfer from the data endpoint.
    pub(crate) fn submit(&self, file: u64, transfer: SubmittedTransfer) -> Result<(), Errno> {
        let mut state = self.lock();
        state.plugged()?;
        // The kernel claims the interface implicitly.
        match state.claimed_by {
            Some(by) if by != file => return Err(Errno::BUSY),
            _ => state.claimed_by = Some(file),
        }
        if state.halted {
            state.finish(file, transfer, Errno::PIPE.raw_os_error(), Vec::new());
            return Ok(());
        }
        if let Some(open) = state.files.get_mut(&file) {
            open.waiting.push_back(transfer);
        }
        state.serve();
        self.room.notify_all();
        Ok(())
    }

    /// A control request that has been answered already.
    pub(crate) fn complete_control(
        &self,
        file: u64,
        finished: FinishedTransfer,
    ) -> Result<(), Errno> {
        let mut state = self.lock();
        state.plugged()?;
        if let Some(open) = state.files.get_mut(&file) {
            open.done.push_back(finished);
        }
        state.update_readiness();
        Ok(())
    }

    /// A control request that the device does not answer.
    pub(crate) fn hold_control(&self, file: u64, transfer: SubmittedTransfer) -> Result<(), Errno> {
        let mut state = self.lock();
        state.plugged()?;
        if let Some(open) = state.files.get_mut(&file) {
            open.unanswered.push(transfer);
        }
        Ok(())
    }

    /// Cancels the transfer whose URB is at `address`; it returns with the data received so far.
    pub(crate) fn discard(&self, file: u64, address: u64) -> Result<(), Errno> {
        let mut state = self.lock();
        let Some(open) = state.files.get_mut(&file) else {
            return Err(Errno::INVAL);
        };
        if let Some(n) = open.unanswered.iter().position(|t| t.address == address) {
            let transfer = open.unanswered.remove(n);
            state.finish(file, transfer, Errno::NOENT.raw_os_error(), Vec::new());
            return Ok(());
        }
        let Some(n) = open.waiting.iter().position(|t| t.address == address) else {
            return Err(Errno::INVAL);
        };
        let Some(transfer) = open.waiting.remove(n) else {
            return Err(Errno::INVAL);
        };
        let bytes = if n == 0 {
            state.take(transfer.urb.length())
        } else {
            Vec::new()
        };
        state.finish(file, transfer, Errno::NOENT.raw_os_error(), bytes);
        Ok(())
    }

    /// The oldest finished transfer.
    pub(crate) fn reap(&self, file: u64) -> Result<FinishedTransfer, Errno> {
        let mut state = self.lock();
        let is_unplugged = state.unplugged;
        let open = state.files.get_mut(&file).ok_or(Errno::NODEV)?;
        let finished = open.done.pop_front();
        state.update_readiness();
        match finished {
            Some(finished) => Ok(finished),
            None if is_unplugged => Err(Errno::NODEV),
            None => Err(Errno::AGAIN),
        }
    }

    /// Counts the data of a reaped transfer.
    pub(crate) fn count(&self, bytes: &[u8]) {
        let before = self.lock().delivered;
        // Only the thread that serves the file counts, so this is not interrupted.
        let mut crc = crc32fast::Hasher::new_with_initial_len(before.crc32, before.bytes);
        crc.update(bytes);
        self.lock().delivered = DeliveryTotals {
            bytes: before.bytes + bytes.len() as u64,
            crc32: crc.finalize(),
            transfers: before.transfers + 1,
        };
    }

    /// Clears a stall of the data endpoint.
    pub(crate) fn clear_halt(&self) {
        self.lock().halted = false;
    }

    /// Resets the port: unfetched bytes are discarded. Returns false if the reset fails.
    pub(crate) fn reset(&self) -> bool {
        let mut state = self.lock();
        if state.resets_fail {
            return false;
        }
        state.halted = false;
        state.clear_fifo();
        true
    }

    // ---- from the device

    /// Adds bytes to the FIFO. `end`: the device ends a packet, which also ends a transfer.
    pub(crate) fn push(&self, bytes: Vec<u8>, end: bool) {
        let mut state = self.lock();
        if state.unplugged {
            return;
        }
        if !bytes.is_empty() {
            state.level += bytes.len();
            state.fifo.push_back(bytes);
        }
        state.ended = end;
        state.serve();
    }

    /// Bytes that fit into queued transfers and the FIFO.
    pub(crate) fn free(&self) -> usize {
        let state = self.lock();
        let waiting: usize = state
            .files
            .values()
            .flat_map(|f| &f.waiting)
            .map(|t| t.urb.length())
            .sum();
        (self.capacity + waiting).saturating_sub(state.level)
    }

    /// Waits until more than `bytes` are free, at most for `timeout`.
    pub(crate) fn wait_for_room(&self, bytes: usize, timeout: Duration) -> bool {
        if self.free() > bytes {
            return true;
        }
        let state = self.lock();
        let waited = self.room.wait_timeout(state, timeout);
        drop(waited);
        self.free() > bytes
    }

    // ---- fault injection

    /// Unplugs the cable: all transfers end, and new ones fail.
    pub(crate) fn unplug(&self) {
        let mut state = self.lock();
        state.unplugged = true;
        state.clear_fifo();
        state.abort(Errno::SHUTDOWN);
        self.room.notify_all();
    }

    /// Stalls the data endpoint until the host clears it.
    pub(crate) fn stall(&self) {
        let mut state = self.lock();
        state.halted = true;
        state.abort(Errno::PIPE);
    }

    /// Ends the next transfer that exceeds `bytes` by that many bytes early; the following transfer
    /// has the rest.
    pub(crate) fn cut_next(&self, bytes: usize) {
        self.lock().cut = Some(bytes);
    }

    /// Sets whether resets of the port fail.
    pub(crate) fn fail_resets(&self, on: bool) {
        self.lock().resets_fail = on;
    }

    /// Fails the data transfer after this many more `transfers`, and loses its data.
    pub(crate) fn break_after(&self, transfers: u32) {
        self.lock().broken = Some(transfers);
    }

    /// Data delivered to the host so far.
    pub(crate) fn delivered(&self) -> DeliveryTotals {
        self.lock().delivered
    }
}

impl State {
    fn plugged(&self) -> Result<(), Errno> {
        if self.unplugged {
            Err(Errno::NODEV)
        } else {
            Ok(())
        }
    }

    /// Completes queued transfers that are full or end with a packet.
    fn serve(&mut self) {
        while let Some((file, transfer)) = self.next_waiting() {
            let length = transfer.urb.length();
            let full = self.level >= length;
            if self.level == 0 || !(full || self.ended) {
                return;
            }
            let mut requested = self.level.min(length);
            if let Some(cut) = self.cut
                && requested > cut
            {
                requested -= cut;
                self.cut = None;
            }
            let bytes = self.take(requested);
            if let Some(open) = self.files.get_mut(&file) {
                open.waiting.pop_front();
            }
            match &mut self.broken {
                Some(0) => {
                    self.broken = None;
                    self.finish(file, transfer, Errno::PROTO.raw_os_error(), Vec::new());
                    continue;
                }
                Some(left) => *left -= 1,
                None => {}
            }
            self.finish(file, transfer, 0, bytes);
        }
    }

    fn next_waiting(&self) -> Option<(u64, SubmittedTransfer)> {
        self.files
            .iter()
            .find_map(|(file, open)| open.waiting.front().map(|t| (*file, *t)))
    }

    /// Takes up to `requested` bytes off the FIFO.
    fn take(&mut self, requested: usize) -> Vec<u8> {
        let requested = requested.min(self.level);
        self.level -= requested;
        if self.head == 0
            && let Some(first) = self.fifo.front()
            && first.len() == requested
        {
            return self.fifo.pop_front().unwrap_or_default();
        }
        let mut taken = Vec::with_capacity(requested);
        while taken.len() < requested {
            let Some(first) = self.fifo.front() else {
                break;
            };
            let end = first.len().min(self.head + requested - taken.len());
            taken.extend_from_slice(&first[self.head..end]);
            if end == first.len() {
                self.fifo.pop_front();
                self.head = 0;
            } else {
                self.head = end;
            }
        }
        taken
    }

    fn clear_fifo(&mut self) {
        self.fifo.clear();
        (self.head, self.level, self.cut) = (0, 0, None);
    }

    /// Ends a transfer of the data endpoint; `errno` 0 for success.
    fn finish(&mut self, file: u64, transfer: SubmittedTransfer, errno: i32, bytes: Vec<u8>) {
        let SubmittedTransfer { address, mut urb } = transfer;
        urb.finish(-errno, bytes.len());
        if let Some(open) = self.files.get_mut(&file) {
            open.done.push_back(FinishedTransfer {
                address,
                urb,
                to: urb.buffer(),
                data: !bytes.is_empty(),
                bytes,
            });
        }
        self.update_readiness();
    }

    /// Ends all transfers.
    fn abort(&mut self, errno: Errno) {
        let files: Vec<u64> = self.files.keys().copied().collect();
        for file in files {
            let Some(open) = self.files.get_mut(&file) else {
                continue;
            };
            let waiting = mem::take(&mut open.waiting);
            let unanswered = mem::take(&mut open.unanswered);
            for transfer in waiting.into_iter().chain(unanswered) {
                self.finish(file, transfer, errno.raw_os_error(), Vec::new());
            }
        }
        self.update_readiness();
    }

    fn update_readiness(&mut self) {
        let ready = self.unplugged || self.files.values().any(|f| !f.done.is_empty());
        self.ready.set(ready);
    }
}
