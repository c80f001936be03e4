//! Owns whether a recording repeats itself: events that come once more, at the same pixels and to the microsecond at the same
//! distances. Two presses never send the same events, since each pixel has its own noise.

use std::collections::HashSet;

use skinrig_model::CdEvent;

use crate::event_runs::{RollingRuns, token};
use crate::result::ReadoutFault;

/// One run in so many is remembered at first, and half as many whenever there are this many: the memory is bounded.
const ONE_IN: u64 = 64;
const MOST_RUNS: usize = 1 << 18;
/// Runs that came before, and their share of all, from which on a recording repeats itself.
const LEAST_RUNS: u32 = 4;
const LEAST_SHARE: f64 = 0.01;

/// Runs of a camera's events so far.
#[derive(Debug, Clone)]
pub(crate) struct Repeats {
    runs: RollingRuns,
    one_in: u64,
    most_runs: usize,
    seen: HashSet<u64>,
    last_us: u64,
    again: u32,
    /// Runs that the remembered ones stand for: all, and those that came before.
    all_of: u64,
    again_of: u64,
    first_us: Option<u64>,
}

impl Repeats {
    pub(crate) fn new() -> Self {
        Self {
            runs: RollingRuns::new(ONE_IN),
            one_in: ONE_IN,
            most_runs: MOST_RUNS,
            seen: HashSet::new(),
            last_us: 0,
            again: 0,
            all_of: 0,
            again_of: 0,
            first_us: None,
        }
    }

    /// The next event.
    pub(crate) fn push(&mut self, event: &CdEvent) {
        let since_us = event.t_us.wrapping_sub(self.last_us) & 0x7fff_ffff;
        self.last_us = event.t_us;
        let Some(run) = self.runs.push(token(event, since_us)) else {
            return;
        };
        self.all_of += self.one_in;
        if !self.seen.insert(run) {
            self.again += 1;
            self.again_of += self.one_in;
            self.first_us.get_or_insert(event.t_us);
        }
        if self.seen.len() >= self.most_runs {
            self.one_in *= 2;
            self.runs.select_one_in(self.one_in);
            self.seen.retain(|run| run.is_multiple_of(self.one_in));
        }
    }

    /// What came once more, if that is more than chance.
    pub(crate) fn found(&self) -> Option<ReadoutFault> {
        let share = self.again_of as f64 / self.all_of.max(1) as f64;
        let is_found = self.again >= LEAST_RUNS && share >= LEAST_SHARE;
        Some(ReadoutFault::EventsAgain {
            share,
            from_s: self.first_us.filter(|_| is_found)? as f64 * 1e-6,
        })
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::Polarity;
    use skinrig_statistics::seeded;

    use super::*;

    fn events(seed: u64, from_us: u64, n: usize) -> Vec<CdEvent> {
        let mut rng = seeded::generator(seed, 1);
        let mut t_us = from_us;
        let mut event = |_| {
            t_us += seeded::index(&mut rng, 40) as u64;
            CdEvent {
                t_us,
                x: seeded::index(&mut rng, 60) as u16,
                y: seeded::index(&mut rng, 40) as u16,
                polarity: Polarity::On,
            }
        };
        (0..n).map(&mut event).collect()
    }

    /// Share and first second of what comes once more.
    fn found(parts: &[&[CdEvent]]) -> Option<(f64, f64)> {
        let mut repeats = Repeats::new();
        let events = parts.iter().flat_map(|part| *part);
        events.for_each(|e| repeats.push(e));
        of(&repeats)
    }

    fn of(repeats: &Repeats) -> Option<(f64, f64)> {
        match repeats.found()? {
            ReadoutFault::EventsAgain { share, from_s } => Some((share, from_s)),
            other => panic!("{other}"),
        }
    }

    /// However long the recording, a bounded number of runs is kept, and finds it again.
    #[test]
    fn long_recordings_are_remembered_in_part() {
        let mut repeats = Repeats {
            most_runs: 1 << 9,
            ..Repeats::new()
        };
        let long = events(3, 0, 400_000);
        long.iter().for_each(|e| repeats.push(e));
        assert_eq!(repeats.found(), None);
        assert!((1 << 7..1 << 9).contains(&repeats.seen.len()));
        long[..40_000].iter().for_each(|e| repeats.push(e));
        let (share, _) = of(&repeats).unwrap();
        assert!((0.06..0.13).contains(&share), "{share}");
    }

    #[test]
    fn data_that_comes_once_more_is_found_and_other_data_is_not() {
        let (first, second) = (events(1, 0, 20_000), events(2, 1_000_000, 20_000));
        assert_eq!(found(&[&first, &second]), None);
        let again: Vec<CdEvent> = first[3_000..13_000]
            .iter()
            .map(|e| CdEvent {
                t_us: e.t_us + 3_000_017,
                ..*e
            })
            .collect();
        let (share, from_s) = found(&[&first, &second, &again]).unwrap();
        assert!((0.15..0.25).contains(&share), "{share}");
        assert!((3.0..3.2).contains(&from_s), "{from_s}");
        // The same pixels in the same order at other times: a flicker of the light.
        let flicker: Vec<CdEvent> = again
            .iter()
            .map(|e| CdEvent {
                t_us: e.t_us + e.t_us % 3,
                ..*e
            })
            .collect();
        assert_eq!(found(&[&first, &second, &flicker]), None);
        assert_eq!(found(&[]), None);
    }
}
