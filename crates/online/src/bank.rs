//! The bank of tests: one cumulative sum of log likelihood ratios per place and event rate of a beginning touch.
//!
//! A slot adds to every sum the evidence of its events for "a touch at this place adds so many events per slot, in these regions"
//! against the background; a sum never falls below 0 (Page 1954), so that each begins at the best moment. The largest one is
//! the statistic.

use std::f64::consts::LN_2;

use crate::background::Background;
use crate::log_table::{LogTable, OCTAVE, fixed, ratio, steps};
use crate::model::TouchModel;
use crate::patterns::LEAST_SHARE;
use crate::regions::{REGIONS, opposite};
use crate::slots::SlotCounts;

/// Largest sum, nats: it falls to 0 soon after the events of a press end.
const MOST_NATS: f64 = 400.0;
/// Slots after which a sum that is no touch yet begins anew: 120 ms, so that small errors of the background never add up.
const WINDOW: i64 = 240;
/// Events of a region and slot that count, at most.
const MOST_EVENTS: u16 = 255;

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

#[derive(Debug, Clone)]
pub(crate) struct Bank {
    table: LogTable,
    /// Shares of all regions, one region after another.
    shares: Vec<Share>,
    /// Index of the first share of each region, camera after camera.
    starts: Vec<u32>,
    /// Expected events per slot, as steps of a ratio.
    levels: Vec<i32>,
    /// Cost of a slot at each level, 2^-20 nats, by place: the touch's events in all its regions.
    costs: Vec<i64>,
    gains: Vec<i64>,
    sums: Vec<i64>,
    since: Vec<i64>,
    most: i64,
    /// The smallest share that patterns keep, as steps of a ratio,
    least: i32,
    /// and such a step, 2^-20 nats.
    step: i64,
}

impl Bank {
    pub(crate) fn new(model: &TouchModel) -> Self {
        let levels: Vec<i32> = (model.octaves.0..=model.octaves.1)
            .map(|o| o * OCTAVE)
            .collect();
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
            costs.extend(levels.iter().map(|level| fixed(ratio(*level) * total)));
        }
        let mut starts = vec![0];
        let mut shares = Vec::new();
        for of_region in by_region {
            shares.extend(of_region);
            starts.push(shares.len() as u32);
        }
        let tests = costs.len();
        Self {
            table: LogTable::new(),
            shares,
            starts,
            levels,
            costs,
            gains: vec![0; tests],
            sums: vec![0; tests],
            since: vec![0; tests],
            most: fixed(MOST_NATS),
            least: steps(LEAST_SHARE),
            step: fixed(LN_2 / f64::from(OCTAVE)),
        }
    }

    /// Sets every sum to 0.
    pub(crate) fn restart(&mut self) {
        self.sums.fill(0);
    }

    /// Adds a slot; without a touch, sums older than the window begin anew.
    pub(crate) fn add(
        &mut self,
        slot: i64,
        counts: [&SlotCounts; 2],
        background: &Background,
        touch: bool,
    ) -> Best {
        self.gains.fill(0);
        for (camera, counts) in counts.into_iter().enumerate() {
            for (region, events) in counts.iter() {
                let expected = background.steps(camera, region);
                self.gain(camera * REGIONS + region, events.min(MOST_EVENTS), expected);
            }
        }
        let mut best = Best {
            sum: 0,
            place: 0,
            since: slot,
        };
        let mut test = 0;
        for (at, sum) in self.sums.iter_mut().enumerate() {
            if *sum == 0 || (!touch && slot - self.since[at] >= WINDOW) {
                (*sum, self.since[at]) = (0, slot);
            }
            *sum = (*sum + self.gains[at] - self.costs[at]).clamp(0, self.most);
            if *sum > best.sum {
                best.sum = *sum;
                test = at;
            }
        }
        if best.sum > 0 {
            (best.place, best.since) = (test / self.levels.len(), self.since[test]);
        }
        best
    }

    /// Odds that these events of a touch, above the background, are those of a release rather than of a beginning touch at any place,
    /// 2^-20 nats: with the other polarity, the best pattern holds them so much better.
    pub(crate) fn release_odds(&mut self, excess: impl Fn(usize, usize) -> u32) -> i64 {
        let best = |of: &mut Self, other: bool| {
            of.gains.fill(0);
            for camera in 0..2 {
                for region in 0..REGIONS {
                    let from = if other { opposite(region) } else { region };
                    let events = i64::from(excess(camera, from));
                    if events > 0 {
                        of.share(camera * REGIONS + region, events);
                    }
                }
            }
            of.gains.iter().copied().max().unwrap_or(0)
        };
        best(self, true) - best(self, false)
    }

    /// Adds the logarithms of the shares of a region, above the smallest share that patterns keep, to the first gain of each place.
    fn share(&mut self, region: usize, events: i64) {
        let (from, to) = (
            self.starts[region] as usize,
            self.starts[region + 1] as usize,
        );
        for share in &self.shares[from..to] {
            let gain = &mut self.gains[share.place as usize * self.levels.len()];
            *gain += i64::from(share.steps - self.least) * events * self.step;
        }
    }

    fn gain(&mut self, region: usize, events: u16, expected: i32) {
        let (from, to) = (
            self.starts[region] as usize,
            self.starts[region + 1] as usize,
        );
        let levels = self.levels.len();
        for share in &self.shares[from..to] {
            let over = share.steps - expected;
            let first = share.place as usize * levels;
            let gains = &mut self.gains[first..first + levels];
            for (gain, level) in gains.iter_mut().zip(&self.levels) {
                *gain += i64::from(self.table.at(level + over)) * i64::from(events);
            }
        }
    }
}
