//! The operator's hand on a run: pause, resume, stop, abort, halt, remarks; and what it shows of itself.

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

/// Remarks that may wait for the controller.
const MOST_NOTES: usize = 16;

/// Sends requests to a running controller, which looks for them at every tick. Clones share one run.
///
/// Requests and the state are lock-free, so that they may be used from any thread; the controller never waits for the remarks.
/// Counting ctrl-C (once: [`stop`](Self::stop), twice: [`abort`](Self::abort), three times: [`halt`](Self::halt)) is the
/// caller's business.
#[derive(Debug, Clone, Default)]
pub struct ControlHandle {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    bits: AtomicU8,
    /// Requests made, and how many of them the controller has heard.
    asked: AtomicU64,
    heard: AtomicU64,
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

/// So many remarks wait that no further one is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected at most {MOST_NOTES} notes that wait to be written, found as many")]
pub struct NotesFull;

/// What was asked for since the controller last looked, the gravest first.
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
    /// A handle with no request pending.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Wait at clearance height once the press under way is done. Replaces a pending [`resume`](Self::resume).
    pub fn pause(&self) {
        self.replace(PAUSE, RESUME);
    }

    /// Break the press under way off, leave the skin and wait at clearance height. Replaces a pending
    /// [`resume`](Self::resume).
    pub fn pause_now(&self) {
        self.replace(PAUSE_NOW, RESUME);
    }

    /// Go on after a pause. Replaces a pending [`pause`](Self::pause) or [`pause_now`](Self::pause_now).
    pub fn resume(&self) {
        self.replace(RESUME, PAUSE | PAUSE_NOW);
    }

    /// End the run once the press under way is done.
    pub fn stop(&self) {
        self.replace(STOP, 0);
    }

    /// End the run now: retract, disarm, keep the data.
    pub fn abort(&self) {
        self.replace(ABORT, 0);
    }

    /// Motors off now, wherever the tip is: no retraction, not even one under way goes on. Cannot be taken back.
    pub fn halt(&self) {
        self.replace(HALT, 0);
    }

    /// How many requests were made. One is heard, that is, has had the effect that `docs/reference/runs.md` says or has none, when
    /// [`heard`](Self::heard) is at least what this gave after it.
    #[must_use]
    pub fn asked(&self) -> u64 {
        self.shared.asked.load(Ordering::Acquire)
    }

    /// How many of the requests the controller has heard.
    #[must_use]
    pub fn heard(&self) -> u64 {
        self.shared.heard.load(Ordering::Acquire)
    }

    /// Where the run is.
    #[must_use]
    pub fn state(&self) -> State {
        let index = usize::from(self.shared.state.load(Ordering::Acquire));
        State::ALL.get(index).copied().unwrap_or(State::Planned)
    }

    /// Hands the controller a remark, which it writes at its next tick. Gives the remark's number; it is in the session's
    /// hands once [`noted`](Self::noted) is as high.
    ///
    /// # Errors
    /// [`NotesFull`]: try again.
    pub fn note(&self, text: String) -> Result<u64, NotesFull> {
        let shared = &self.shared;
        let mut notes = shared.notes.lock().unwrap_or_else(PoisonError::into_inner);
        if notes.waiting.len() >= MOST_NOTES {
            return Err(NotesFull);
        }
        notes.waiting.push_back(text);
        notes.taken_in += 1;
        shared.has_notes.store(true, Ordering::Release);
        Ok(notes.taken_in)
    }

    /// How many remarks were written.
    #[must_use]
    pub fn noted(&self) -> u64 {
        self.shared.noted.load(Ordering::Acquire)
    }

    /// The remarks that wait; none when another thread is just handing one in, so that nobody is waited for.
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

    /// One more remark was written.
    pub(crate) fn note_written(&self) {
        self.shared.noted.fetch_add(1, Ordering::AcqRel);
    }

    /// The controller has heard the first `asked` requests.
    pub(crate) fn hear_up_to(&self, asked: u64) {
        self.shared.heard.fetch_max(asked, Ordering::AcqRel);
    }

    /// The run is in `state` from now on.
    pub(crate) fn show(&self, state: State) {
        let index = State::ALL.iter().position(|s| *s == state).unwrap_or(0);
        self.shared.state.store(index as u8, Ordering::Release);
    }

    /// True once [`halt`](Self::halt) was asked for.
    #[must_use]
    pub(crate) fn is_halted(&self) -> bool {
        self.shared.bits.load(Ordering::Acquire) & HALT != 0
    }

    fn replace(&self, set: u8, clear: u8) {
        // The closure always gives a value, so the update always succeeds.
        let bits = &self.shared.bits;
        let _ = bits.fetch_update(Ordering::AcqRel, Ordering::Acquire, |b| {
            Some((b & !clear) | set)
        });
        // After the bit, so that who sees the number finds the request.
        self.shared.asked.fetch_add(1, Ordering::AcqRel);
    }

    /// Takes all pending requests, the gravest first. A halt stays: whoever looks next must see it, too.
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
    fn requests_are_taken_once_and_the_later_of_pause_and_resume_wins() {
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
    fn a_halt_is_not_taken_back() {
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
    fn remarks_are_bounded_and_never_taken_twice() {
        let hand = ControlHandle::new();
        for n in 1..=MOST_NOTES {
            assert_eq!(hand.note(n.to_string()), Ok(n as u64));
        }
        assert_eq!(hand.note("one more".into()), Err(NotesFull));
        let taken = hand.take_notes();
        assert_eq!(taken.len(), MOST_NOTES);
        assert_eq!((hand.take_notes().len(), hand.noted()), (0, 0));
        for _ in taken {
            hand.note_written();
        }
        assert_eq!(hand.noted(), MOST_NOTES as u64);
        assert_eq!(hand.note("next".into()), Ok(MOST_NOTES as u64 + 1));
        // Somebody is handing one in: the controller comes back later.
        let held = hand.shared.notes.lock().unwrap();
        assert_eq!(hand.take_notes().len(), 0);
        drop(held);
        assert_eq!(hand.take_notes(), ["next"]);
    }

    #[test]
    fn the_state_is_seen_by_every_clone() {
        let hand = ControlHandle::new();
        for state in State::ALL {
            hand.clone().show(state);
            assert_eq!(hand.state(), state);
        }
    }
}
