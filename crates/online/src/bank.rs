//! The bank of tests: one cumulative sum of log likelihood ratios per place and event rate of a beginning touch.
//!
//! A slot adds to every sum the evidence of its events for "a touch at this place adds so many events per slot, in these regions"
//! against the background; a sum never falls below 0 (Page 1954), so that each begins at the best moment. The largest one is
//! the statistic.

use std::f64::consts::LN_2;

use skinrig_simd::InstructionSet;

use crate::background::Background;
use crate::log_table::{LANES, Lanes, LogTable, OCTAVE, fixed, ratio, steps};
use crate::model::{LEVELS, TouchModel};
use crate::patterns::LEAST_SHARE;
use crate::regions::{REGIONS, opposite};
use crate::slots::SlotCounts;

/// Largest sum, nats: it falls to 0 soon after the events of a press end.
const MOST_NATS: f64 = 400.0;
/// Slots after which a sum that is no touch yet begins anew: 120 ms, so that small errors of the background never add up.
const WINDOW: i64 = 240;
/// Events of a region and slot that count, at most.
const MOST_EVENTS: u16 = 255;
/// Cost of a slot at a level that is not looked for: its sum stays 0.
const NEVER: i64 = i64::MAX / 4;

/// A place that a region belongs to.
#[derive(Debug, Clone, Copy)]
struct Share {
    place: u32,
    /// Share of the events of a touch there that fall into the region, as steps of a ratio.
    steps: i32,
}

/// The largest sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Best {
    /// 2^-20 nats.
    pub sum: i64,
    /// Its place.
    pub place: usize,
    /// Slot in which it last left 0.
    pub since: i64,
}

/// Events of a region in a slot.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Its shares, from, to.
    shares: (u32, u32),
    events: i32,
    /// Ratio of the lowest level to the expected events, as steps.
    lowest: i32,
}

/// The tests. All sums are 2^-20 nats; one lane per event rate, one entry per place.
#[derive(Debug, Clone)]
pub(crate) struct Bank {
    table: LogTable,
    /// Shares of all regions, one region after another.
    shares: Vec<Share>,
    /// Index of the first share of each region, camera after camera.
    starts: Vec<u32>,
    /// Lowest event rate that is looked for, events per slot, as steps of a ratio.
    lowest: i32,
    seen: Vec<Seen>,
    /// Cost of a slot: the touch's events in all its regions.
    costs: Vec<Lanes<i64>>,
    gains: Vec<Lanes<i64>>,
    sums: Vec<Lanes<i64>>,
    /// Slot in which the sum last left 0.
    since: Vec<Lanes<i64>>,
    most: i64,
    /// The smallest share that patterns keep, as steps of a ratio,
    least: i32,
    /// and such a step, 2^-20 nats.
    step: i64,
    instructions: InstructionSet,
}

impl Bank {
    pub(crate) fn new(model: &TouchModel) -> Self {
        Self::with(model, InstructionSet::best())
    }

    fn with(model: &TouchModel, instructions: InstructionSet) -> Self {
        let mut by_region: Vec<Vec<Share>> = vec![Vec::new(); 2 * REGIONS];
        let mut costs = Vec::new();
        for (place, pattern) in model.patterns.iter().enumerate() {
            for (camera, region, share) in &pattern.shares {
                by_region[camera * REGIONS + region].push(Share {
                    place: place as u32,
                    steps: steps(*share),
                });
            }
            let total: f64 = pattern.shares.iter().map(|s| s.2).sum();
            let mut of_place = [NEVER; LANES];
            for (cost, octave) in of_place.iter_mut().zip(model.lowest_octave..).take(LEVELS) {
                *cost = fixed(ratio(octave * OCTAVE) * total);
            }
            costs.push(of_place);
        }
        let mut starts = vec![0];
        let mut shares = Vec::new();
        for of_region in by_region {
            shares.extend(of_region);
            starts.push(shares.len() as u32);
        }
        let zeros = vec![[0; LANES]; costs.len()];
        Self {
            table: LogTable::new(),
            shares,
            starts,
            lowest: model.lowest_octave * OCTAVE,
            seen: Vec::with_capacity(2 * REGIONS),
            costs,
            gains: zeros.clone(),
            sums: zeros.clone(),
            since: zeros,
            most: fixed(MOST_NATS),
            least: steps(LEAST_SHARE),
            step: fixed(LN_2 / f64::from(OCTAVE)),
            instructions,
        }
    }

    /// Sets every sum to 0.
    pub(crate) fn restart(&mut self) {
        self.sums.fill([0; LANES]);
    }

    /// Adds a slot; without a touch, sums older than the window begin anew.
    pub(crate) fn add(
        &mut self,
        slot: i64,
        counts: [&SlotCounts; 2],
        background: &Background,
        touch: bool,
    ) -> Best {
        self.seen.clear();
        for (camera, counts) in counts.into_iter().enumerate() {
            for (region, events) in counts.iter() {
                let at = camera * REGIONS + region;
                self.seen.push(Seen {
                    shares: (self.starts[at], self.starts[at + 1]),
                    events: i32::from(events.min(MOST_EVENTS)),
                    lowest: self.lowest - background.steps(camera, region),
                });
            }
        }
        let oldest = if touch { i64::MIN } else { slot - WINDOW };
        let highest = self.instructions.run(
            #[inline(always)]
            || {
                self.gain();
                self.sum(slot, oldest)
            },
        );
        let best = Best {
            sum: highest,
            place: 0,
            since: slot,
        };
        if highest == 0 {
            return best;
        }
        let lane = |sums: &Lanes<i64>| sums.iter().position(|sum| *sum == highest);
        let place = self.sums.iter().position(|sums| lane(sums).is_some());
        place.map_or(best, |place| Best {
            place,
            since: lane(&self.sums[place]).map_or(slot, |lane| self.since[place][lane]),
            ..best
        })
    }

    /// Evidence of the events of a slot: at most 2^46 (9,600 regions of 255 events, 14 nats each), so that nothing wraps.
    #[inline(always)]
    fn gain(&mut self) {
        let gains = &mut self.gains[..];
        gains.fill([0; LANES]);
        for &Seen {
            shares,
            events,
            lowest,
        } in &self.seen
        {
            for share in &self.shares[shares.0 as usize..shares.1 as usize] {
                let logarithms = self.table.at(lowest + share.steps);
                let mut of_place = gains[share.place as usize];
                for lane in 0..LANES {
                    let gain = i64::from(logarithms[lane]) * i64::from(events);
                    of_place[lane] = of_place[lane].wrapping_add(gain);
                }
                gains[share.place as usize] = of_place;
            }
        }
    }

    /// Adds evidence less cost to every sum; those that began in slot `oldest` or before begin anew. Returns the largest.
    #[inline(always)]
    fn sum(&mut self, slot: i64, oldest: i64) -> i64 {
        let (most, mut highest) = (self.most, [0; LANES]);
        let tests = self.sums.iter_mut().zip(&mut self.since);
        for ((sums, since), (gains, costs)) in tests.zip(self.gains.iter().zip(&self.costs)) {
            let (mut after, mut began) = (*sums, *since);
            for lane in 0..LANES {
                let anew = after[lane] == 0 || began[lane] <= oldest;
                let before = if anew { 0 } else { after[lane] };
                began[lane] = if anew { slot } else { began[lane] };
                let sum = before.wrapping_add(gains[lane]).wrapping_sub(costs[lane]);
                after[lane] = sum.max(0).min(most);
                highest[lane] = highest[lane].max(after[lane]);
            }
            (*sums, *since) = (after, began);
        }
        highest.into_iter().max().unwrap_or(0)
    }

    /// Odds that these events of a touch, above the background, are those of a release rather than of a beginning touch at any place,
    /// 2^-20 nats: with the other polarity, the best pattern holds them so much better.
    pub(crate) fn release_odds(&mut self, excess: impl Fn(usize, usize) -> u32) -> i64 {
        let best = |of: &mut Self, other: bool| {
            of.gains.fill([0; LANES]);
            for camera in 0..2 {
                for region in 0..REGIONS {
                    let from = if other { opposite(region) } else { region };
                    let events = i64::from(excess(camera, from));
                    if events > 0 {
                        of.share(camera * REGIONS + region, events);
                    }
                }
            }
            of.gains.iter().map(|gains| gains[0]).max().unwrap_or(0)
        };
        best(self, true) - best(self, false)
    }

    /// Adds the logarithms of the shares of a region, above the smallest share that patterns keep, to the first lane of each place.
    fn share(&mut self, region: usize, events: i64) {
        let (from, to) = (
            self.starts[region] as usize,
            self.starts[region + 1] as usize,
        );
        for share in &self.shares[from..to] {
            self.gains[share.place as usize][0] +=
                i64::from(share.steps - self.least) * events * self.step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instruction_set_gives_the_same_sums() {
        let model = crate::tests::model();
        let background = Background::new(&model);
        let counts = |slot: usize| {
            let mut counts = SlotCounts::new();
            for event in 0..slot % 40 {
                counts.add((slot * 37 + event * event * 11) % REGIONS);
            }
            counts
        };
        let sums = |instructions| {
            let mut bank = Bank::with(&model, instructions);
            (0..2000)
                .map(|slot| {
                    let (one, two) = (counts(slot), counts(slot + 5));
                    bank.add(slot as i64, [&one, &two], &background, slot % 700 < 30)
                })
                .collect::<Vec<_>>()
        };
        let expected = sums(InstructionSet::available()[0]);
        assert!(expected.iter().any(|best| best.sum > fixed(3.0)));
        for set in InstructionSet::available() {
            assert_eq!(sums(set), expected, "{set:?}");
        }
    }
}
