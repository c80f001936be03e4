//! One press as the detector sees it.

use rand_xoshiro::Xoshiro256PlusPlus;
use skinrig_model::{LatencySettings, PressId};

use super::bins::{Grid, Sight};
use super::course::Drawn;
use super::cusum::{Cusum, background_rate_per_s};
use super::smooth::{Edges, Kernel};
use super::spans::Spans;
use super::thin::chosen;

/// The settings of a detector, worked out once for all trials.
#[derive(Debug, Clone, PartialEq)]
pub struct Detector {
    /// Width of a bin, ms.
    pub bin_ms: f64,
    /// The smoothing kernel.
    pub kernel: Kernel,
    /// What it does at the ends.
    pub edges: Edges,
    /// Rate increase that the detector is tuned to.
    pub alpha: f64,
    /// Bins in a row.
    pub consecutive: u32,
    /// Thresholds, ascending.
    pub thresholds: Vec<f64>,
    /// An onset earlier than this after the contact (a negative time) is no detection of the touch, ms.
    pub earliest_ms: f64,
}

impl Detector {
    /// With these thresholds, ascending, for contacts known to `margin_ms`. A smoothed count can rise half a kernel before
    /// its event: only what is earlier than both together is before the contact.
    #[must_use]
    pub fn new(
        settings: &LatencySettings,
        edges: Edges,
        thresholds: Vec<f64>,
        margin_ms: f64,
    ) -> Self {
        let kernel = Kernel::gaussian(settings.sigma_ms, settings.bin_ms);
        Self {
            bin_ms: settings.bin_ms,
            earliest_ms: -(margin_ms + kernel.reach() as f64 * settings.bin_ms),
            kernel,
            edges,
            alpha: settings.alpha,
            consecutive: settings.consecutive,
            thresholds,
        }
    }

    /// Looks at counts per bin of a trial and of its background.
    #[must_use]
    pub fn look(&self, label: Label, grid: Grid, counts: &[u32], background: &[u32]) -> Trial {
        let bin_s = self.bin_ms * 1e-3;
        let background_s = background.len() as f64 * bin_s;
        let events: u64 = background.iter().map(|c| u64::from(*c)).sum();
        let rate = background_rate_per_s(events, background_s);
        let cusum = Cusum::new(self.alpha, rate, bin_s, self.consecutive);
        let smoothed = self.kernel.smooth(counts, self.edges);
        let background = self.kernel.smooth(background, self.edges);
        let onset_ms = |bin: usize| grid.centre_ms(bin, self.bin_ms);
        let early = (0..grid.len).take_while(|bin| onset_ms(*bin) < self.earliest_ms);
        let early = early.count();
        let search = |trip: Option<usize>| match trip {
            Some(bin) if bin < early => Search {
                trip: Some(Trip::BeforeContact(onset_ms(bin))),
                at_risk_s: (bin + 1) as f64 * bin_s,
            },
            _ => Search {
                trip: trip.map(|bin| Trip::Touch(onset_ms(bin))),
                at_risk_s: early as f64 * bin_s,
            },
        };
        let trips = cusum.onsets(&smoothed, &self.thresholds).into_iter();
        Trial {
            label,
            searches: trips.map(search).collect(),
            background_s,
            background_per_s: events as f64 / background_s,
            course: Drawn::new(grid, &smoothed, self.bin_ms),
            background,
        }
    }

    /// Looks at the events of both cameras: all of them, or one in `factor`, chosen by `rng`.
    #[must_use]
    pub(crate) fn look_at(
        &self,
        label: Label,
        sights: &[Sight<'_>; 2],
        spans: &Spans,
        mut thinning: Option<(u32, Xoshiro256PlusPlus)>,
    ) -> Option<Trial> {
        let bin_us = self.bin_ms * 1e3;
        let mut count = |(from_us, to_us): (f64, f64)| {
            let grid = Grid::within(from_us, to_us, bin_us);
            let mut counts = vec![0; grid.len];
            let events = sights.map(|s| s.within(grid, bin_us));
            if let Some((factor, rng)) = &mut thinning {
                let of_first = events[0].len();
                for i in chosen(of_first + events[1].len(), *factor, rng) {
                    let (k, i) = match i.checked_sub(of_first) {
                        None => (0, i),
                        Some(i) => (1, i),
                    };
                    let one = events[k][i..=i].iter().copied();
                    sights[k].count(one, grid, bin_us, &mut counts);
                }
            } else {
                for (sight, events) in sights.iter().zip(events) {
                    sight.count(events.iter().copied(), grid, bin_us, &mut counts);
                }
            }
            (grid, counts)
        };
        let (grid, counts) = count(spans.trial_us);
        let (quiet, background) = count(spans.background_us);
        (grid.len > 0 && quiet.len > 0).then(|| self.look(label, grid, &counts, &background))
    }
}

/// Which press, and where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label {
    /// Which press.
    pub press: PressId,
    /// Its location.
    pub location: u32,
}

/// The first trip of a detector: it ends the search, as it would online.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trip {
    /// Before the contact, ms after it (negative): a false alarm. The press that follows is not detected.
    BeforeContact(f64),
    /// Not before the contact, ms after it.
    Touch(f64),
}

/// What a detector did at one threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// `None` when it never tripped.
    pub trip: Option<Trip>,
    /// How long it looked where a trip is a false alarm, s: from the start of the trial to the contact, or to the end of the
    /// bin of the false alarm.
    pub at_risk_s: f64,
}

impl Search {
    /// The onset of a detected touch, ms after the contact.
    #[must_use]
    pub const fn onset_ms(&self) -> Option<f64> {
        match self.trip {
            Some(Trip::Touch(ms)) => Some(ms),
            _ => None,
        }
    }

    /// The onset of a false alarm, ms after the contact (negative).
    #[must_use]
    pub const fn false_alarm_ms(&self) -> Option<f64> {
        match self.trip {
            Some(Trip::BeforeContact(ms)) => Some(ms),
            _ => None,
        }
    }
}

/// What a detector found in a trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Which press.
    pub label: Label,
    /// One per threshold.
    pub searches: Vec<Search>,
    /// Length of the background, s.
    pub background_s: f64,
    /// Its events per second.
    pub background_per_s: f64,
    /// Smoothed rate of the trial, for drawing.
    pub course: Drawn,
    /// Smoothed counts of the background, for drawing.
    pub background: Vec<f64>,
}
