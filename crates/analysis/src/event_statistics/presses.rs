//! Events around the contact and the lift of presses: polarity, and the mean rate over time.

use serde::Serialize;
use skinrig_model::{CdEvent, SENSOR_HEIGHT, SENSOR_WIDTH};

/// Polarity counts from the contact or the lift on for this long, µs.
const POLARITY_US: u64 = 200_000;
/// Rates count in bins of this width, µs, so many from the contact or the lift on.
const BIN_US: u64 = 10_000;
const BINS: usize = 60;
/// The rate before a press counts for this long before its contact, µs.
const BEFORE_US: u64 = 100_000;

/// Events in the 200 ms from each contact, and from each start of the upward motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PressPolarity {
    /// Presses.
    pub presses: u64,
    /// Events from a contact on.
    pub at_press: u64,
    /// Share of ON events among them.
    pub on_at_press: Option<f64>,
    /// Events from a lift on.
    pub at_lift: u64,
    /// Share of ON events among them.
    pub on_at_lift: Option<f64>,
}

/// Event rates around the contact and the lift, mean over the presses.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PressCourse {
    /// Width of a bin, ms.
    pub bin_ms: f64,
    /// Events per second in the 100 ms before a contact; `None` if presses follow each other too closely.
    pub before_per_s: Option<f64>,
    /// Events per second from the contact on, one value per bin; ends where less than half of the presses still last.
    pub contact_per_s: Vec<f64>,
    /// Events per second from the start of the upward motion on; ends where the next press begins for half of the presses.
    pub lift_per_s: Vec<f64>,
}

/// Both, of one camera; `None` without presses.
#[derive(Debug, Clone, PartialEq)]
pub struct PressStatistics {
    /// Polarity at contacts and lifts.
    pub polarity: Option<PressPolarity>,
    /// Rates around contacts and lifts.
    pub course: Option<PressCourse>,
}

/// Collects the statistics of the presses of one camera, and no other: several times as fast as all of them.
#[derive(Debug)]
pub struct PressStatisticsCollector(PressCounter);

impl PressStatisticsCollector {
    /// As [`super::EventStatisticsCollector::new`].
    #[must_use]
    pub fn new(presses: &[(f64, f64)]) -> Self {
        Self(PressCounter::new(presses))
    }

    /// Counts the next events. Those outside the sensor do not count.
    pub fn push(&mut self, events: &[CdEvent]) {
        let on_sensor = |e: &&CdEvent| e.x < SENSOR_WIDTH && e.y < SENSOR_HEIGHT;
        for event in events.iter().filter(on_sensor) {
            self.0.add(event);
        }
    }

    /// The statistics.
    #[must_use]
    pub fn finish(&self) -> PressStatistics {
        PressStatistics {
            polarity: self.0.polarity(),
            course: self.0.course(),
        }
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Count {
    events: u64,
    on: u64,
}

impl Count {
    fn share(self) -> Option<f64> {
        (self.events > 0).then(|| self.on as f64 / self.events as f64)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Moment {
    Before,
    Contact,
    Lift,
}

/// A time after which events count, until the next one.
#[derive(Debug, Clone, Copy)]
struct Window {
    start_us: u64,
    moment: Moment,
    /// Bins that lie in it completely.
    bins: usize,
}

/// Counts them.
#[derive(Debug)]
pub(super) struct PressCounter {
    /// On the clock of the camera, in order.
    windows: Vec<Window>,
    presses: u64,
    before: u64,
    /// From contacts, and from lifts.
    counts: [Count; 2],
    bins: [[u64; BINS]; 2],
}

impl PressCounter {
    pub(super) fn new(presses: &[(f64, f64)]) -> Self {
        Self {
            windows: windows(presses),
            presses: presses.len() as u64,
            before: 0,
            counts: [Count::default(); 2],
            bins: [[0; BINS]; 2],
        }
    }

    pub(super) fn add(&mut self, event: &CdEvent) {
        // The last window that began.
        let next = self.windows.partition_point(|w| w.start_us <= event.t_us);
        let Some(window) = next.checked_sub(1).map(|at| self.windows[at]) else {
            return;
        };
        let since_us = event.t_us - window.start_us;
        let kind = match window.moment {
            Moment::Before => {
                self.before += 1;
                return;
            }
            Moment::Contact => 0,
            Moment::Lift => 1,
        };
        if since_us < POLARITY_US {
            let count = &mut self.counts[kind];
            count.events += 1;
            count.on += u64::from(event.polarity.bit());
        }
        let bin = (since_us / BIN_US) as usize;
        if bin < window.bins {
            self.bins[kind][bin] += 1;
        }
    }

    /// `None` without presses.
    pub(super) fn polarity(&self) -> Option<PressPolarity> {
        let [press, lift] = self.counts;
        (self.presses > 0).then(|| PressPolarity {
            presses: self.presses,
            at_press: press.events,
            on_at_press: press.share(),
            at_lift: lift.events,
            on_at_lift: lift.share(),
        })
    }

    /// `None` without presses.
    pub(super) fn course(&self) -> Option<PressCourse> {
        let of = |moment| self.windows.iter().filter(move |w| w.moment == moment);
        let before_s = of(Moment::Before).count() as f64 * BEFORE_US as f64 * 1e-6;
        let rates = |moment, counts: &[u64; BINS]| {
            let complete = |bin| of(moment).filter(|w| bin < w.bins).count() as u64;
            let rates = counts.iter().enumerate().map_while(|(bin, events)| {
                let n = complete(bin);
                (2 * n >= self.presses).then(|| *events as f64 / (n as f64 * BIN_US as f64 * 1e-6))
            });
            rates.collect()
        };
        let [contacts, lifts] = &self.bins;
        (self.presses > 0).then(|| PressCourse {
            bin_ms: BIN_US as f64 * 1e-3,
            before_per_s: (before_s > 0.0).then(|| self.before as f64 / before_s),
            contact_per_s: rates(Moment::Contact, contacts),
            lift_per_s: rates(Moment::Lift, lifts),
        })
    }
}

fn windows(presses: &[(f64, f64)]) -> Vec<Window> {
    let mut starts = Vec::new();
    let mut free_us = 0;
    for (contact_us, lift_us) in presses {
        let [contact_us, lift_us] = [contact_us, lift_us].map(|us| us.max(0.0) as u64);
        if let Some(before_us) = contact_us.checked_sub(BEFORE_US)
            && before_us >= free_us
        {
            starts.push((before_us, Moment::Before));
        }
        starts.push((contact_us, Moment::Contact));
        starts.push((lift_us, Moment::Lift));
        free_us = lift_us.saturating_add(POLARITY_US);
    }
    starts.sort_unstable();
    let ends = starts.iter().skip(1).map(|(us, _)| *us).chain([u64::MAX]);
    let ends: Vec<u64> = ends.collect();
    let windows = starts
        .into_iter()
        .zip(ends)
        .map(|((start_us, moment), end_us)| Window {
            start_us,
            moment,
            bins: ((end_us - start_us) / BIN_US).min(BINS as u64) as usize,
        });
    windows.collect()
}
