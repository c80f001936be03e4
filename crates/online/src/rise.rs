//! The events of a touch while the tip goes in: they stop counting when it rests or turns back.

use serde::{Deserialize, Serialize};

/// Time over which motion is judged, µs.
pub(crate) const RECENT_US: u64 = 20_000;
/// The tip rests when that time holds less than this part of the events of its busiest such time,
const QUIET: f64 = 8.0;
/// and that part is this many standard deviations of the idle events: a weak beginning is no press that rests.
const CLEAR: f64 = 2.0;
/// It turns back when the polarity of the events tells so by this many standard deviations,
const REVERSAL: f64 = 4.0;
/// and they are this part of the events before at most: those of a press are more than the fading of the press before.
const RETURNING: f64 = 0.5;

/// Events of a camera since a touch began.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Count {
    /// All events, which are the variance of those beyond.
    pub all: f64,
    /// Events beyond the idle rate.
    pub beyond: f64,
}

/// Events of a touch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Excess {
    /// Of each camera.
    pub counts: [Count; 2],
    /// Of both, beyond the idle rate within [`RECENT_US`],
    pub recent: f64,
    /// and the idle events that are expected in it.
    pub idle: f64,
    /// Standard deviations by which these events are those of the way back.
    pub reversal: f64,
}

/// The events until the tip rests or turns back.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Rise {
    counts: [Count; 2],
    busiest: f64,
    is_over: bool,
}

impl Rise {
    /// Adds the next instant of the touch.
    pub(crate) fn add(&mut self, excess: Excess) {
        let earlier = excess.counts.iter().map(|c| c.beyond).sum::<f64>() - excess.recent;
        let returns = excess.reversal > REVERSAL && excess.recent < RETURNING * earlier;
        self.is_over |= returns;
        if self.is_over {
            return;
        }
        self.counts = excess.counts;
        self.busiest = self.busiest.max(excess.recent);
        let quiet = self.busiest / QUIET;
        self.is_over = excess.recent < quiet && quiet > CLEAR * libm::sqrt(excess.idle);
    }

    /// Events of each camera.
    pub(crate) const fn counts(&self) -> [Count; 2] {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(beyond: f64) -> [Count; 2] {
        let count = |beyond| Count {
            all: beyond + 50.0,
            beyond,
        };
        [count(beyond), count(2.0 * beyond)]
    }

    #[test]
    fn events_count_until_the_tip_rests_or_turns_back() {
        let mut rise = Rise::default();
        let mut at = |all: f64, recent| {
            let (counts, idle) = (counts(all), 100.0);
            rise.add(Excess {
                counts,
                recent,
                idle,
                reversal: 0.0,
            });
            rise.counts().map(|c| c.beyond)
        };
        // A beginning within the noise of the idle events, ten in 20 ms.
        assert_eq!(at(5.0, 60.0), [5.0, 10.0]);
        assert_eq!(at(6.0, 5.0), [6.0, 12.0]);
        assert_eq!(at(10.0, 30.0), [10.0, 20.0]);
        assert_eq!(at(100.0, 300.0), [100.0, 200.0]);
        // Slower, but moving.
        assert_eq!(at(150.0, 50.0), [150.0, 300.0]);
        assert_eq!(at(160.0, 30.0), [160.0, 320.0]);
        // The release is no deeper press.
        assert_eq!(at(400.0, 300.0), [160.0, 320.0]);

        let mut rise = Rise::default();
        // A press after the fading of the one before, its way down, and its way back.
        for (all, recent, reversal) in [
            (50.0, 20.0, 0.0),
            (100.0, 100.0, 9.0),
            (200.0, 100.0, -20.0),
            (300.0, 100.0, 3.0),
            (350.0, 100.0, 5.0),
            (400.0, 100.0, -20.0),
        ] {
            rise.add(Excess {
                counts: counts(all),
                recent,
                idle: 100.0,
                reversal,
            });
        }
        assert_eq!(rise.counts(), counts(300.0));
    }
}
