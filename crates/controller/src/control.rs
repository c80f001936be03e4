//! Requests from the operator (pause, resume, stop, abort, halt, notes), and the visible state of a run.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::states::State;

const PAUSE: u8 = 1;
const RESUME: u8 = 2;
const STOP: u8 = 4;
const ABORT: u8 = 8;
const PAUSE_NOW: u8 = 16;
const HALT: u8 = 32;

/// Most notes that may wait for the controller.
const MAX_NOTES: usize = 16;

/// Sends requests to a running controller, which checks for them at every tick. Clones refer to the same run.
///
/// Requests and state are lock-free, so that any thread may use them; the controller never waits for notes. The caller
/// counts ctrl-C: once for [`stop`](Self::stop), twice for [`abort`](Self::abort), three times for
/// [`halt`](Self::halt).
#[derive(Debug, Clone, Default)]
pub struct ControlHandle {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    bits: AtomicU8,
    /// Number of requests made, and of those that the controller has acknowledged.
    made: AtomicU64,
    acknowledged: AtomicU64,
    /// Index of the state in [`State::ALL`].
    state: AtomicU8,
    notes: Mutex<Notes>,
    has_notes: AtomicBool,
    noted: AtomicU64,
}

#[derive(Debug, Default)]
struct Notes {
    waiting: VecDeque<String>,
    taken_in: u64,
}

/// The queue of notes is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the queue of {MAX_NOTES} notes is full; try again")]
pub struct NoteQueueFull;

/// A request since the controller last checked, most urgent first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Request {
    Halt,
    Abort,
    Stop,
    PauseNow,
    Pause,
    Resume,
}

impl ControlHandle {
    /// A handle without pending requests.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Waits at clearance height after the current press. Replaces a pending [`resume`](Self::resume).
    pub fn pause(&self) {
        self.replace(PAUSE, RESUME);
    }

    /// Interrupts the current press, leaves the skin and waits at clearance height. Replaces a pending
    /// [`resume`](Self::resume).
    pub fn pause_now(&self) {
        self.replace(PAUSE_NOW, RESUME);
    }

    /// Continues after a pause. Replaces a pending [`pause`](Self::pause) or [`pause_now`](Self::pause_now).
    pub fn resume(&self) {
        self.replace(RESUME, PAUSE | PAUSE_NOW);
    }

    /// Ends the run after the current press.
    pub fn stop(&self) {
        self.replace(STOP, 0);
    }

    /// Ends the run now: retract, disarm, keep the data.
    pub fn abort(&self) {
        self.replace(ABORT, 0);
    }

    /// Switches the motors off now, wherever the tip is, and cancels any retraction. Cannot be undone.
    pub fn halt(&self) {
        self.replace(HALT, 0);
    }

    /// Number of requests made. A request has been handled (see `docs/reference/runs.md`), or has no effect, once
    /// [`requests_acknowledged`](Self::requests_acknowledged) has reached the value that this returned after it.
    #[must_use]
    pub fn requests_made(&self) -> u64 {
        self.shared.made.load(Ordering::Acquire)
    }

    /// Number of requests that the controller has handled.
    #[must_use]
    pub fn requests_acknowledged(&self) -> u64 {
        self.shared.acknowledged.load(Ordering::Acquire)
    }

    /// Current state of the run.
    #[must_use]
    pub fn state(&self) -> State {
        let index = usize::from(self.shared.state.load(Ordering::Acquire));
        State::ALL.get(index).copied().unwrap_or(State::Planned)
    }

    /// Queues a note, which the controller records at its next tick. Returns the note's number; it is recorded
    /// once [`notes_recorded`](Self::notes_recorded) has reached that number.
    ///
    /// # Errors
    /// [`NoteQueueFull`] if too many notes are queued: try again.
    pub fn note(&self, text: String) -> Result<u64, NoteQueueFull> {
        let shared = &self.shared;
        let mut notes = shared.notes.lock().unwrap_or_else(PoisonError::into_inner);
        if notes.waiting.len() >= MAX_NOTES {
            return Err(NoteQueueFull);
        }
        notes.waiting.push_back(text);
        notes.taken_in += 1;
        shared.has_notes.store(true, Ordering::Release);
        Ok(notes.taken_in)
    }

    /// Number of notes recorded.
    #[must_use]
    pub fn notes_recorded(&self) -> u64 {
        self.shared.noted.load(Ordering::Acquire)
    }

    /// Takes the queued notes; none while another thread is adding one, so that the controller never waits.
    pub(crate) fn take_notes(&self) -> VecDeque<String> {
        let shared = &self.shared;
        if !shared.has_notes.load(Ordering::Acquire) {
            return VecDeque::new();
        }
        let Ok(mut notes) = shared.notes.try_lock() else {
            return VecDeque::new();
        };
        shared.has_notes.store(false, Ordering::Release);
        std::mem::take(&mut notes.waiting)
    }

    /// Counts a recorded note.
    pub(crate) fn count_note(&self) {
        self.shared.noted.fetch_add(1, Ordering::AcqRel);
    }

    /// Acknowledges the first `requests` requests.
    pub(crate) fn acknowledge(&self, made: u64) {
        self.shared.acknowledged.fetch_max(made, Ordering::AcqRel);
    }

    /// Publishes the state of the run.
    pub(crate) fn publish_state(&self, state: State) {
        let index = State::ALL.iter().position(|s| *s == state).unwrap_or(0);
        self.shared.state.store(index as u8, Ordering::Release);
    }

    /// True once a [`halt`](Self::halt) was requested.
    #[must_use]
    pub(crate) fn is_halted(&self) -> bool {
        self.shared.bits.load(Ordering::Acquire) & HALT != 0
    }

    fn replace(&self, set: u8, clear: u8) {
        // The closure always returns a value, so the update always succeeds.
        let bits = &self.shared.bits;
        let _ = bits.fetch_update(Ordering::AcqRel, Ordering::Acquire, |b| {
            Some((b & !clear) | set)
        });
        // After the bit, so that a reader of the number finds the request.
        self.shared.made.fetch_add(1, Ordering::AcqRel);
    }

    /// Takes all pending requests, most urgent first. A halt stays pending, so that every later check finds it.
    pub(crate) fn take(&self) -> impl Iterator<Item = Request> + use<> {
        let bits = self.shared.bits.fetch_and(HALT, Ordering::AcqRel);
        [
            (HALT, Request::Halt),
            (ABORT, Request::Abort),
            (STOP, Request::Stop),
            (PAUSE_NOW, Request::PauseNow),
            (PAUSE, Request::Pause),
            (RESUME, Request::Resume),
        ]
        .into_iter()
        .filter_map(move |(bit, request)| (bits & bit != 0).then_some(request))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_taken_once_and_a_later_pause_or_resume_wins() {
        let hand = ControlHandle::new();
        let other = hand.clone();
        other.pause();
        hand.resume();
        assert_eq!(hand.take().collect::<Vec<_>>(), [Request::Resume]);
        assert_eq!(other.take().count(), 0);
        hand.resume();
        hand.pause();
        hand.stop();
        hand.abort();
        assert_eq!(
            hand.take().collect::<Vec<_>>(),
            [Request::Abort, Request::Stop, Request::Pause]
        );
        hand.pause_now();
        hand.resume();
        assert_eq!(hand.take().collect::<Vec<_>>(), [Request::Resume]);
    }

    #[test]
    fn a_halt_cannot_be_undone() {
        let hand = ControlHandle::new();
        hand.pause_now();
        hand.halt();
        assert_eq!(
            hand.take().collect::<Vec<_>>(),
            [Request::Halt, Request::PauseNow]
        );
        hand.resume();
        assert_eq!(
            hand.take().collect::<Vec<_>>(),
            [Request::Halt, Request::Resume]
        );
        assert!(hand.is_halted());
    }

    #[test]
    fn notes_are_bounded_and_never_taken_twice() {
        let hand = ControlHandle::new();
        for n in 1..=MAX_NOTES {
            assert_eq!(hand.note(n.to_string()), Ok(n as u64));
        }
        assert_eq!(hand.note("one more".into()), Err(NoteQueueFull));
        let taken = hand.take_notes();
        assert_eq!(taken.len(), MAX_NOTES);
        assert_eq!((hand.take_notes().len(), hand.notes_recorded()), (0, 0));
        for _ in taken {
            hand.count_note();
        }
        assert_eq!(hand.notes_recorded(), MAX_NOTES as u64);
        assert_eq!(hand.note("next".into()), Ok(MAX_NOTES as u64 + 1));
        // Another thread is adding one: the controller tries again later.
        let guard = hand.shared.notes.lock().unwrap();
        assert_eq!(hand.take_notes().len(), 0);
        drop(guard);
        assert_eq!(hand.take_notes(), ["next"]);
    }

    #[test]
    fn every_clone_shows_the_state() {
        let hand = ControlHandle::new();
        for state in State::ALL {
            hand.clone().publish_state(state);
            assert_eq!(hand.state(), state);
        }
    }
}
