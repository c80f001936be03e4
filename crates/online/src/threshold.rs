//! The threshold of a false-alarm rate, from the statistic on the idle skin between calibration presses.

use crate::clock::SLOT_US;
use crate::detector::{Core, UnusableClock, lines};
use crate::interleave::interleave;
use crate::log_table::nats;
use crate::model::TouchModel;
use crate::slots::Slots;
use crate::stream::StreamError;
use crate::training::{MARGIN_US, Training, TrainingError};
use skinrig_analysis::locator::LocatorModelError;
use skinrig_analysis::{EventSource, EventSourceError};
use skinrig_model::{CameraId, CdEvent};

/// Slots of a block, of which the largest statistic counts: 100 ms.
const BLOCK: u32 = 200;
/// Shortest idle time, s.
const LEAST_S: u64 = 10;
/// Largest part of the blocks whose maxima describe the tail, and fewest of them.
const TAIL_SHARE: usize = 20;
const TAIL_LEAST: usize = 20;

/// Maxima of the statistic over blocks of idle time, nats, in descending order.
#[derive(Debug, Clone, PartialEq)]
pub struct IdleStatistic {
    maxima: Vec<f64>,
    seconds: f64,
}

/// Why there is no threshold.
#[derive(Debug, thiserror::Error)]
pub enum ThresholdError {
    /// Too little idle time.
    #[error(transparent)]
    Training(#[from] TrainingError),
    /// No common time.
    #[error(transparent)]
    Clock(#[from] UnusableClock),
    /// The locator of the analysis cannot be rebuilt.
    #[error("the locator of the analysis: {0}")]
    Locator(#[from] LocatorModelError),
    /// The events cannot be read.
    #[error("cannot read the events: {0}")]
    Events(#[from] EventSourceError),
}

impl From<StreamError> for ThresholdError {
    fn from(error: StreamError) -> Self {
        match error {
            StreamError::Clock(e) => Self::Clock(e),
            StreamError::Locator(e) => Self::Locator(e),
        }
    }
}

/// Part of the training that a slot belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Press,
    Idle,
    Unknown,
}

impl IdleStatistic {
    /// Runs the statistic over the training, with the times of its presses known; `keeps` selects the events of a thinned
    /// stream.
    ///
    /// # Errors
    /// [`ThresholdError`]: see there.
    pub fn measure(
        model: &TouchModel,
        training: &Training,
        source: &dyn EventSource,
        keeps: impl Fn(CameraId, &CdEvent) -> bool,
    ) -> Result<Self, ThresholdError> {
        let lines = lines(&training.clocks)?;
        let slot_of = |us: f64| libm::floor(us / SLOT_US as f64) as i64;
        let first = training
            .presses
            .first()
            .map_or(0, |p| slot_of(p.contact_us - MARGIN_US));
        let last = slot_of(training.end_us());
        let mut slots = Slots::new(lines, first);
        let mut run = IdleRun {
            core: Core::new(model, f64::MAX),
            training,
            at: 0,
            part: Part::Unknown,
            filled: 0,
            largest: 0,
            maxima: Vec::new(),
        };
        let mut kept = Vec::new();
        let mut ended = false;
        interleave(source, &training.clocks, |camera, events, next_us| {
            for camera in CameraId::ALL {
                slots.promise(camera, next_us[camera.index()]);
            }
            kept.clear();
            kept.extend(events.iter().filter(|e| keeps(camera, e)));
            slots.take(camera, &kept);
            slots.close(|slot, counts| {
                ended = slot > last;
                run.slot(slot, counts);
            });
            !ended
        })?;
        let mut maxima: Vec<f64> = run.maxima.into_iter().map(nats).collect();
        maxima.sort_by(|a, b| b.total_cmp(a));
        let seconds = maxima.len() as f64 * f64::from(BLOCK) * SLOT_US as f64 * 1e-6;
        if seconds < LEAST_S as f64 {
            let (found_s, least_s) = (seconds as u64, LEAST_S);
            return Err(TrainingError::ShortIdle { found_s, least_s }.into());
        }
        Ok(Self { maxima, seconds })
    }

    /// Threshold with at most `per_s` (above 0) false alarms per second: the upper end of the 95 % interval of their rate, with an
    /// exponential tail through the largest maxima, as the likelihood ratio of independent events has.
    #[must_use]
    pub fn threshold(&self, per_s: f64) -> f64 {
        let count = (self.maxima.len() / TAIL_SHARE)
            .max(TAIL_LEAST)
            .min(self.maxima.len() - 1);
        let base = self.maxima[count];
        let excess: f64 = self.maxima[..count].iter().map(|m| m - base).sum();
        let scale = excess / count as f64;
        base + scale * libm::log(count as f64 / certain_count(self.seconds * per_s))
    }

    /// Idle time behind it, s.
    #[must_use]
    pub const fn seconds(&self) -> f64 {
        self.seconds
    }
}

/// Alarms whose 95 % interval ends at `most`: k + 1.96 sqrt(k) + 1.92 = most; an eighth of it if that is below 4.
fn certain_count(most: f64) -> f64 {
    let (z, least) = (1.96, most / 8.0);
    let root = 0.5 * ((4.0 * (most - 0.5 * z * z) + z * z).max(0.0).sqrt() - z);
    least.max(root.max(0.0) * root.max(0.0))
}

struct IdleRun<'a> {
    core: Core,
    training: &'a Training,
    /// Press that is under way, or has just ended.
    at: usize,
    part: Part,
    filled: u32,
    largest: i64,
    maxima: Vec<i64>,
}

impl IdleRun<'_> {
    fn part(&mut self, slot: i64) -> Part {
        let us = (slot * SLOT_US) as f64;
        let presses = &self.training.presses;
        while presses
            .get(self.at + 1)
            .is_some_and(|p| p.contact_us - MARGIN_US <= us)
        {
            self.at += 1;
        }
        let press = &presses[self.at];
        match press.gap_us() {
            _ if us < press.release_us + MARGIN_US => Part::Press,
            Some(gap) if us < gap.1 => Part::Idle,
            _ => Part::Unknown,
        }
    }

    fn slot(&mut self, slot: i64, counts: [&crate::slots::SlotCounts; 2]) {
        let part = self.part(slot);
        if part != self.part {
            match part {
                Part::Press => self.core.touch.begin(slot),
                Part::Idle => self.core.release(slot),
                Part::Unknown => {}
            }
            (self.part, self.filled, self.largest) = (part, 0, 0);
        }
        match part {
            Part::Press => self.core.touch.count(counts),
            Part::Unknown => {}
            Part::Idle => {
                let best = self
                    .core
                    .bank
                    .add(slot, counts, &self.core.background, false);
                self.core.background.idle_slot(counts);
                self.largest = self.largest.max(best.sum);
                self.filled += 1;
                if self.filled == BLOCK {
                    self.maxima.push(self.largest);
                    (self.filled, self.largest) = (0, 0);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_of_an_exponential_tail_has_the_stated_rate() {
        // Maxima of 10,000 blocks with P(max >= h) = exp(5 - h), evenly spaced in probability.
        let n = 10_000;
        let of = |i: usize| 5.0 - libm::log((i as f64 + 0.5) / n as f64);
        let idle = IdleStatistic {
            maxima: (0..n).map(of).collect(),
            seconds: 1_000.0,
        };
        for per_s in [1.0, 0.13, 0.01] {
            let alarms = n as f64 * libm::exp(5.0 - idle.threshold(per_s));
            let most = per_s * 1_000.0;
            assert!(alarms <= most && alarms >= most / 9.0, "{per_s} {alarms}");
        }
        let upper = |k: f64| k + 1.96 * k.sqrt() + 1.9208;
        for most in [5.0, 26.0, 100.0] {
            assert!((upper(certain_count(most)) - most).abs() < 0.01, "{most}");
        }
    }
}
