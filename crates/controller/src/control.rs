//! The operator's hand on a run: pause, resume, stop, abort.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

const PAUSE: u8 = 1;
const RESUME: u8 = 2;
const STOP: u8 = 4;
const ABORT: u8 = 8;

/// Sends requests to a running controller, which looks for them at every tick. Clones share one run.
///
/// Lock-free, so that it may be used from any thread. Counting ctrl-C (once: [`stop`](Self::stop), twice:
/// [`abort`](Self::abort)) is the caller's business.
#[derive(Debug, Clone, Default)]
pub struct ControlHandle {
    bits: Arc<AtomicU8>,
}

/// What was asked for since the controller last looked, the gravest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Request {
    Abort,
    Stop,
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

    /// Go on after a pause. Replaces a pending [`pause`](Self::pause).
    pub fn resume(&self) {
        self.replace(RESUME, PAUSE);
    }

    /// End the run once the press under way is done.
    pub fn stop(&self) {
        self.replace(STOP, 0);
    }

    /// End the run now: retract, disarm, keep the data.
    pub fn abort(&self) {
        self.replace(ABORT, 0);
    }

    fn replace(&self, set: u8, clear: u8) {
        // The closure always gives a value, so the update always succeeds.
        let _ = self
            .bits
            .fetch_update(Ordering::AcqRel, Ordering::Acquire, |b| {
                Some((b & !clear) | set)
            });
    }

    /// Takes all pending requests, the gravest first.
    pub(crate) fn take(&self) -> impl Iterator<Item = Request> + use<> {
        let bits = self.bits.swap(0, Ordering::AcqRel);
        [
            (ABORT, Request::Abort),
            (STOP, Request::Stop),
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
    }
}
