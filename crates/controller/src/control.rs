//! The operator's hand on a run: pause, resume, stop, abort, halt.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

const PAUSE: u8 = 1;
const RESUME: u8 = 2;
const STOP: u8 = 4;
const ABORT: u8 = 8;
const PAUSE_NOW: u8 = 16;
const HALT: u8 = 32;

/// Sends requests to a running controller, which looks for them at every tick. Clones share one run.
///
/// Lock-free, so that it may be used from any thread. Counting ctrl-C (once: [`stop`](Self::stop), twice:
/// [`abort`](Self::abort), three times: [`halt`](Self::halt)) is the caller's business.
#[derive(Debug, Clone, Default)]
pub struct ControlHandle {
    bits: Arc<AtomicU8>,
}

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

    /// True once [`halt`](Self::halt) was asked for.
    pub(crate) fn is_halted(&self) -> bool {
        self.bits.load(Ordering::Acquire) & HALT != 0
    }

    fn replace(&self, set: u8, clear: u8) {
        // The closure always gives a value, so the update always succeeds.
        let _ = self
            .bits
            .fetch_update(Ordering::AcqRel, Ordering::Acquire, |b| {
                Some((b & !clear) | set)
            });
    }

    /// Takes all pending requests, the gravest first. A halt stays: whoever looks next must see it, too.
    pub(crate) fn take(&self) -> impl Iterator<Item = Request> + use<> {
        let bits = self.bits.fetch_and(HALT, Ordering::AcqRel);
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
}
