//! Runs the detector on one press.

use rand_xoshiro::Xoshiro256PlusPlus;
use skinrig_model::{LatencySettings, PressId};

use super::bins::{Grid, HostTimeView};
use super::course::PlottedRates;
use super::cusum::{Cusum, background_rate_per_s};
use super::smooth::{Boundary, Kernel};
use super::spans::Spans;
use super::thin::choose_events;

/// Detector settings, prepared once for all trials.
#[derive(Debug, Clone, PartialEq)]
pub struct Detector {
    /// Width of a bin, ms.
    pub bin_ms: f64,
    /// The smoothing kernel.
    pub kernel: Kernel,
    /// Treatment of the ends.
    pub edges: Boundary,
    /// Rate increase that the detector is tuned to.
    pub alpha: f64,
    /// Required number of bins in a row.
    pub consecutive: u32,
    /// Thresholds, ascending.
    pub thresholds: Vec<f64>,
    /// Earlier onsets (a negative time after contact) are false alarms, ms.
    pub earliest_ms: f64,
}

impl Detector {
    /// With these thresholds, ascending, for contacts known to `margin_ms`. A smoothed count can rise half a kernel before
    /// its event, so only onsets earlier than both together are before contact.
    #[must_use]
    pub fn new(
        settings: &LatencySettings,
        edges: Boundary,
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

    /// Runs on counts per bin of a trial and of its background.
    #[must_use]
    pub fn run(&self, label: Label, grid: Grid, counts: &[u32], background: &[u32]) -> Trial {
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
        let search = |detection: Option<usize>| match detection {
            Some(bin) if bin < early => SearchResult {
                detection: Some(Detection::BeforeContact(onset_ms(bin))),
                at_risk_s: (bin + 1) as f64 * bin_s,
            },
            _ => SearchResult {
                detection: detection.map(|bin| Detection::AfterContact(onset_ms(bin))),
                at_risk_s: early as f64 * bin_s,
            },
        };
        let trips = cusum.onsets(&smoothed, &self.thresholds).into_iter();
        Trial {
            label,
            searches: trips.map(search).collect(),
            background_s,
            background_per_s: events as f64 / background_s,
            course: PlottedRates::new(grid, &smoothed, self.bin_ms),
            background,
        }
    }

    /// Runs on the events of both cameras: all of them, or one in `factor`, chosen by `rng`.
    #[must_use]
    pub(crate) fn run_on_events(
        &self,
        label: Label,
        sights: &[HostTimeView<'_>; 2],
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
                for i in choose_events(of_first + events[1].len(), *factor, rng) {
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
        (grid.len > 0 && quiet.len > 0).then(|| self.run(label, grid, &counts, &background))
    }
}

/// Press and location of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label {
    /// Press.
    pub press: PressId,
    /// Location.
    pub location: u32,
}

/// First detection; it ends the search, as in online operation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Detection {
    /// Before contact, ms after it (negative): a false alarm. The press that follows is not detected.
    BeforeContact(f64),
    /// At or after contact, ms after it.
    AfterContact(f64),
}

/// Result of a detector at one threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchResult {
    /// `None` if nothing was detected.
    pub detection: Option<Detection>,
    /// Search time in which a detection is a false alarm, s: from the start of the trial to the contact, or to the end of
    /// the bin of the false alarm.
    pub at_risk_s: f64,
}

impl SearchResult {
    /// Onset of a detected press, ms after contact.
    #[must_use]
    pub const fn onset_ms(&self) -> Option<f64> {
        match self.detection {
            Some(Detection::AfterContact(ms)) => Some(ms),
            _ => None,
        }
    }

    /// Onset of a false alarm, ms after contact (negative).
    #[must_use]
    pub const fn false_alarm_ms(&self) -> Option<f64> {
        match self.detection {
            Some(Detection::BeforeContact(ms)) => Some(ms),
            _ => None,
        }
    }
}

/// Results of a detector in one trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Press and location.
    pub label: Label,
    /// One per threshold.
    pub searches: Vec<SearchResult>,
    /// Length of the background, s.
    pub background_s: f64,
    /// Background events per second.
    pub background_per_s: f64,
    /// Smoothed rate of the trial, for drawing.
    pub course: PlottedRates,
    /// Smoothed counts of the background, for drawing.
    pub background: Vec<f64>,
}
