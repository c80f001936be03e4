//! Events of each press beyond the idle rate before it, from the counts in fixed bins: the audit and the silences judge the
//! recording, so neither the press windows nor the thinning of an analysis change what they see.

use skinrig_model::AnalysisSettings;

use crate::input::SessionInput;
use crate::press_spans::timings;
use crate::rates::RateHistogram;
use crate::result::ClockFit;
use crate::segment::windows;

/// Events of a press, and those of the idle time before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PressBurst {
    /// From before the contact to after the release, as by the default press window.
    pub events: f64,
    pub press_s: f64,
    pub idle_events: f64,
    /// 0 if no idle time is free.
    pub idle_s: f64,
    /// From the contact to the middle event above the idle rate, ms; `None` without such events.
    pub delay_ms: Option<f64>,
}

impl PressBurst {
    /// Events per second, in the press and in the idle time before it, if both are known.
    pub(crate) fn rates(&self) -> Option<(f64, f64)> {
        let known = self.press_s > 0.0 && self.idle_s > 0.0;
        known.then(|| (self.events / self.press_s, self.idle_events / self.idle_s))
    }

    /// Events above the idle prediction, if that is known.
    pub(crate) fn excess(&self) -> Option<f64> {
        let (_, idle_per_s) = self.rates()?;
        Some(self.events - idle_per_s * self.press_s)
    }

    /// Events above the idle prediction, in standard errors; `None` if there are events but no idle time.
    pub(crate) fn response(&self) -> Option<f64> {
        match self.rates() {
            Some((_, idle_per_s)) => {
                let expected = idle_per_s * self.press_s;
                // Poisson noise in both counts; the additional event avoids certainty after a silent idle time.
                let variance = expected * (1.0 + self.press_s / self.idle_s) + 1.0;
                Some((self.events - expected) / variance.sqrt())
            }
            None => (self.events == 0.0).then_some(0.0),
        }
    }
}

/// Bursts by row of the plan; `None` for presses without times.
pub(crate) fn press_bursts(
    input: &SessionInput,
    rates: &RateHistogram,
    clock: &ClockFit,
) -> Vec<Option<PressBurst>> {
    let mut bursts = vec![None; input.planned.len()];
    let default = AnalysisSettings::default();
    for window in windows(timings(input), &input.earlier, clock, &default) {
        let (bins, press_s) = counted(rates, window.start_us, window.end_us);
        let (idle_bins, idle_s) = counted(rates, window.idle_start_us, window.start_us);
        let (events, idle_events) = (total(bins), total(idle_bins));
        let timing = input.outcomes[window.row].as_ref().and_then(|o| o.timing);
        let contact_us = timing.map(|t| clock.camera_us_of_host(t.contact));
        let bin_s = rates.bin_us() as f64 * 1e-6;
        let middle_s = middle(bins, idle_events / idle_s * bin_s).map(|bins| bins * bin_s);
        let delay_s = |contact_us: f64| {
            Some(
                window.start_us.max(rates.start_us()) as f64 * 1e-6 + middle_s? - contact_us * 1e-6,
            )
        };
        bursts[window.row] = Some(PressBurst {
            events,
            press_s,
            idle_events,
            idle_s,
            delay_ms: contact_us.and_then(delay_s).map(|s| 1e3 * s),
        });
    }
    bursts
}

fn total(bins: &[u32]) -> f64 {
    bins.iter().map(|count| f64::from(*count)).sum()
}

/// Where half of the events above the idle rate of a bin have come, in bins; `None` if that rate is not known, or nothing is above it.
fn middle(bins: &[u32], idle_per_bin: f64) -> Option<f64> {
    let half = (total(bins) - idle_per_bin * bins.len() as f64) / 2.0;
    if half.is_nan() || half <= 0.0 {
        return None;
    }
    let mut sum = 0.0;
    bins.iter().zip(0..).find_map(|(count, bin)| {
        let more = f64::from(*count) - idle_per_bin;
        let reaches = sum + more >= half;
        let at = f64::from(bin) + (half - sum) / more;
        sum += more;
        reaches.then_some(at)
    })
}

/// The bins whose middle lies between two times, and their length, s. Those before the first and after the last event are missing, as silent.
fn counted(rates: &RateHistogram, from_us: u64, to_us: u64) -> (&[u32], f64) {
    let bin_us = rates.bin_us();
    let bin = |us: u64| (us + bin_us / 2) / bin_us;
    let (from, to) = (bin(from_us), bin(to_us).max(bin(from_us)));
    let first = rates.start_us() / bin_us;
    let clip = |bin: u64| (bin.saturating_sub(first) as usize).min(rates.counts().len());
    let seconds = ((to - from) * bin_us) as f64 / 1e6;
    (&rates.counts()[clip(from)..clip(to)], seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_those_of_the_bins_between_two_times() {
        let mut rates = RateHistogram::new(10_000);
        for ms in 1_000..2_000 {
            rates.add(1_000 * ms);
        }
        let counts = |rates: &RateHistogram, from_us, to_us| {
            let (bins, seconds) = counted(rates, from_us, to_us);
            (total(bins), seconds)
        };
        assert_eq!(counts(&rates, 1_100_000, 1_300_000), (200.0, 0.2));
        assert_eq!(counts(&rates, 1_104_000, 1_296_000), (200.0, 0.2));
        // Time before the first and after the last event counts as silent.
        assert_eq!(counts(&rates, 0, 1_050_000), (50.0, 1.05));
        assert_eq!(counts(&rates, 1_950_000, 2_500_000), (50.0, 0.55));
        assert_eq!(counts(&rates, 1_300_000, 1_300_000), (0.0, 0.0));
        assert_eq!(counts(&RateHistogram::new(10_000), 0, 20_000), (0.0, 0.02));
    }

    #[test]
    fn the_middle_is_where_half_of_what_the_press_added_has_come() {
        assert_eq!(middle(&[2, 2, 12, 12, 2], 2.0), Some(3.0));
        assert_eq!(middle(&[2, 2, 22, 2, 2], 2.0), Some(2.5));
        assert_eq!(middle(&[2, 2, 2], 2.0), None);
        assert_eq!(middle(&[2, 2, 2], f64::NAN), None);
        assert_eq!(middle(&[], 0.0), None);
    }

    #[test]
    fn a_response_is_the_excess_over_the_idle_rate() {
        let burst = |events: f64, idle_events: f64, idle_s: f64| PressBurst {
            events,
            press_s: 0.5,
            idle_events,
            idle_s,
            delay_ms: None,
        };
        // Expected 100 events, variance 100 (1 + 1) + 1.
        let response = burst(400.0, 100.0, 0.5).response().unwrap();
        assert!((response - 300.0 / 201f64.sqrt()).abs() < 1e-12);
        assert_eq!(burst(400.0, 100.0, 0.5).rates(), Some((800.0, 200.0)));
        assert_eq!(burst(400.0, 0.0, 0.0).response(), None);
        assert_eq!(burst(0.0, 0.0, 0.0).response(), Some(0.0));
    }
}
