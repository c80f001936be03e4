//! Sends touches to the programs that follow a run, as soon as it feels them.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use skinrig_model::{TouchDepth, TouchEstimate, TouchKind, TouchRegion};

/// Programs that may follow at once: each has a thread.
pub(super) const MOST_FOLLOWERS: usize = 32;
/// Touches that wait for one program. Further ones are counted, so that a slow program never slows the run.
const MOST_WAITING: usize = 1_024;

/// A touch as other programs get it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct TouchLine {
    /// When the run had it, s of rig time.
    pub t_s: f64,
    /// What was felt, or how a press reacted.
    pub kind: TouchKind,
    /// Age of the newest events in it at that time, ms,
    pub lag_ms: f64,
    /// and its standard deviation by the clock fits, ms.
    pub lag_sd_ms: f64,
    /// The press under way, from 1; `None` between presses.
    pub press: Option<u32>,
    /// Position, skin frame, mm; of an onset, the most likely place learnt.
    pub at_mm: Option<[f64; 2]>,
    /// Its 95 % region.
    pub region: Option<TouchRegion>,
    /// Depth that the touch has reached.
    pub depth: Option<TouchDepth>,
    /// Log likelihood ratio of an onset against the background, nats.
    pub llr: Option<f64>,
    /// Touches before this one that did not fit into the queue of this program.
    pub missed: u64,
}

impl TouchLine {
    fn of(touch: &TouchEstimate, missed: u64) -> Self {
        Self {
            t_s: touch.t.as_secs_f64(),
            kind: touch.kind,
            lag_ms: (touch.t - touch.until).as_secs_f64() * 1e3,
            lag_sd_ms: touch.until_sd_ns as f64 * 1e-6,
            press: touch.attempt.map(|attempt| attempt.press.number()),
            at_mm: touch.at_mm,
            region: touch.region,
            depth: touch.depth,
            llr: touch.llr,
            missed,
        }
    }
}

/// One program's queue.
#[derive(Debug)]
struct Follower {
    queue: SyncSender<TouchLine>,
    missed: u64,
}

/// Hands touches to the programs that follow.
#[derive(Debug)]
pub(super) struct TouchFeed {
    /// `None` once nothing more will be felt.
    followers: Mutex<Option<Vec<Follower>>>,
}

impl TouchFeed {
    /// The feed of a run, which may feel nothing.
    pub(super) fn new(feels: bool) -> Self {
        Self {
            followers: Mutex::new(feels.then(Vec::new)),
        }
    }

    /// The touches from now on, until the run ends; `None` if nothing more will be felt, or [`MOST_FOLLOWERS`] follow.
    pub(super) fn follow(&self) -> Option<Receiver<TouchLine>> {
        let mut followers = self
            .followers
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let followers = followers.as_mut()?;
        if followers.len() >= MOST_FOLLOWERS {
            return None;
        }
        let (queue, touches) = sync_channel(MOST_WAITING);
        followers.push(Follower { queue, missed: 0 });
        Some(touches)
    }

    /// Hands a touch over; never waits for a program.
    pub(super) fn send(&self, touch: &TouchEstimate) {
        let mut followers = self
            .followers
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let Some(followers) = followers.as_mut() else {
            return;
        };
        followers.retain_mut(|follower| {
            match follower
                .queue
                .try_send(TouchLine::of(touch, follower.missed))
            {
                Ok(()) => follower.missed = 0,
                Err(TrySendError::Full(_)) => follower.missed += 1,
                Err(TrySendError::Disconnected(_)) => return false,
            }
            true
        });
    }

    /// Ends every program's touches after those that wait.
    pub(super) fn end(&self) {
        *self
            .followers
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = None;
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::HostTime;

    use super::*;

    fn touch(ms: i64) -> TouchEstimate {
        TouchEstimate {
            t: HostTime(ms * 1_000_000),
            until: HostTime((ms - 2) * 1_000_000),
            until_sd_ns: 500_000,
            kind: TouchKind::Onset,
            attempt: None,
            at_mm: Some([1.0, 2.0]),
            region: None,
            depth: None,
            llr: Some(12.5),
        }
    }

    #[test]
    fn a_program_gets_what_is_felt_from_then_on() {
        let feed = TouchFeed::new(true);
        feed.send(&touch(1));
        let touches = feed.follow().unwrap();
        feed.send(&touch(2_000));
        feed.end();
        feed.send(&touch(3_000));
        let all: Vec<TouchLine> = touches.iter().collect();
        let [only] = all.as_slice() else {
            panic!("{all:?}");
        };
        assert_eq!((only.t_s, only.lag_ms, only.lag_sd_ms), (2.0, 2.0, 0.5));
        assert_eq!((only.press, only.missed), (None, 0));
        assert!(feed.follow().is_none(), "the run has ended");
        assert!(TouchFeed::new(false).follow().is_none());
    }

    #[test]
    fn a_slow_program_is_told_what_it_missed() {
        let feed = TouchFeed::new(true);
        let touches = feed.follow().unwrap();
        for ms in 0..MOST_WAITING as i64 + 3 {
            feed.send(&touch(ms));
        }
        assert_eq!(touches.try_iter().count(), MOST_WAITING);
        feed.send(&touch(9_999));
        assert_eq!(touches.recv().unwrap().missed, 3);
        feed.send(&touch(10_000));
        assert_eq!(touches.recv().unwrap().missed, 0);
    }

    #[test]
    fn programs_that_left_make_room() {
        let feed = TouchFeed::new(true);
        let all: Vec<_> = (0..MOST_FOLLOWERS).map(|_| feed.follow()).collect();
        assert!(all.iter().all(Option::is_some));
        assert!(feed.follow().is_none());
        drop(all);
        feed.send(&touch(1));
        assert!(feed.follow().is_some());
    }
}
