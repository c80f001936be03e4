//! Height of the tip above the surface when the events of a press began. Events cannot begin before contact.

use skinrig_model::{HostDuration, HostTime};

use crate::input::{Descent, SessionInput};
use crate::rates::RateHistogram;
use crate::result::ClockFit;

/// Maximum time before the descent for the idle rate.
const LONGEST_IDLE: HostDuration = HostDuration::from_millis(1_000);
/// Minimum idle time, s.
const MIN_IDLE_S: f64 = 0.1;
/// Minimum number of events assumed in an idle time: silence gives no odds.
const MIN_EVENTS: f64 = 0.5;
/// Events begin before contact if a rise is likelier than the idle rate by this many nats (400 to 1).
const CLEARLY: f64 = 6.0;

/// Onset of the events of a press in one camera, if before contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Onset {
    /// Row of the press.
    pub row: usize,
    /// Time before the measured contact, ms; 0 if not before.
    pub before_ms: f64,
    /// Measured height of the tip above the surface at that time, mm; 0 if not before.
    pub height_mm: f64,
}

/// Onsets of the presses with a known descent, in plan order.
///
/// In each press the time from the start of the descent to the contact is split where a higher rate from there on is most
/// likely (Poisson, against the rate before the descent; maximum of `n ln(n / e) - (n - e)` for `n` events where `e` were
/// expected). Events of an earlier press can only raise the idle rate and delay the onset.
pub(crate) fn onsets(input: &SessionInput, rates: &RateHistogram, clock: &ClockFit) -> Vec<Onset> {
    let timings = || input.outcomes.iter().flatten().filter_map(|o| o.timing);
    let earlier = input.earlier.iter().filter_map(|e| e.clear);
    let mut clears: Vec<HostTime> = timings().map(|t| t.clear).chain(earlier).collect();
    clears.sort_unstable();
    let counts = Counts { rates, clock };
    let rows = input.descents.iter().zip(&input.outcomes).enumerate();
    rows.filter_map(|(row, (descent, outcome))| {
        let (descent, timing) = (descent.as_ref()?, outcome.as_ref()?.timing?);
        let before = clears.partition_point(|clear| *clear <= timing.approach);
        let clear = before.checked_sub(1).map(|k| clears[k]);
        let long = timing.approach - LONGEST_IDLE;
        let idle = counts.idle_per_bin(clear.map_or(long, |c| c.max(long)), timing.approach)?;
        let begun = counts.rise(timing.approach, timing.contact, idle);
        Some(begun.map_or(Onset::at_contact(row), |t| Onset {
            row,
            before_ms: (timing.contact - t).as_secs_f64() * 1e3,
            height_mm: Descent::height_mm(descent, timing.contact, t),
        }))
    })
    .collect()
}

impl Onset {
    const fn at_contact(row: usize) -> Self {
        Self {
            row,
            before_ms: 0.0,
            height_mm: 0.0,
        }
    }
}

/// Counts of a camera by host time.
struct Counts<'a> {
    rates: &'a RateHistogram,
    clock: &'a ClockFit,
}

impl Counts<'_> {
    fn bin_us(&self) -> f64 {
        self.rates.bin_us() as f64
    }

    /// Position of a host time in bins; `None` before the first.
    fn position(&self, t: HostTime) -> Option<f64> {
        let bins = (self.clock.camera_us_of_host(t) - self.rates.start_us() as f64) / self.bin_us();
        (bins >= 0.0).then_some(bins)
    }

    /// Whole bins between two times; `None` unless all were counted.
    fn between(&self, from: HostTime, to: HostTime) -> Option<(usize, &[u32])> {
        let (from, to) = (self.position(from)?.ceil(), self.position(to)?.floor());
        let (from, to) = (from as usize, to as usize);
        let bins = self.rates.counts().get(from..to)?;
        Some((from, bins))
    }

    /// Events per bin in an idle time.
    fn idle_per_bin(&self, from: HostTime, to: HostTime) -> Option<f64> {
        let (_, bins) = self.between(from, to)?;
        let events: u64 = bins.iter().map(|c| u64::from(*c)).sum();
        let long_enough = bins.len() as f64 * self.bin_us() * 1e-6 >= MIN_IDLE_S;
        long_enough.then(|| (events as f64).max(MIN_EVENTS) / bins.len() as f64)
    }

    /// Middle of the bin from which on the rate is most likely higher than the idle rate; `None` if it is not.
    fn rise(&self, from: HostTime, contact: HostTime, idle: f64) -> Option<HostTime> {
        let (first, bins) = self.between(from, contact)?;
        let (mut n, mut expected, mut best) = (0.0, 0.0, (CLEARLY, None));
        for (k, count) in bins.iter().enumerate().rev() {
            n += f64::from(*count);
            expected += idle;
            let nats = if n > expected {
                n * libm::log(n / expected) - (n - expected)
            } else {
                0.0
            };
            if nats > best.0 {
                best = (nats, Some(first + k));
            }
        }
        let bin = best.1?;
        let camera_us = self.rates.start_us() as f64 + (bin as f64 + 0.5) * self.bin_us();
        let host_s = self.clock.host_us_of_camera(camera_us) * 1e-6;
        Some(HostTime::from_secs_f64(host_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::ClockMethod;
    use rand_xoshiro::rand_core::Rng as _;
    use skinrig_statistics::seeded;

    const CLOCK: ClockFit = ClockFit {
        method: ClockMethod::TriggerMarks,
        offset_us: 5e6,
        drift_ppm: 20.0,
        drift_se_ppm: 0.0,
        residual_rms_us: 0.0,
        residual_max_us: 0.0,
        n: 30,
        rejected: 0,
    };

    /// Noise of `idle` events per bin on average, and `more` from `from_ms` to the contact at 3 s.
    fn counted(seed: u64, idle: f64, more: f64, from_ms: i64) -> RateHistogram {
        let mut random = seeded::generator(seed, 0);
        let mut rates = RateHistogram::new(10_000);
        for ms in 0..4_000i64 {
            let mean = idle / 10.0 + if ms >= from_ms { more / 10.0 } else { 0.0 };
            // Ten draws per millisecond approximate Poisson well enough.
            for _ in 0..10 {
                let unit = (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
                if unit < mean / 10.0 {
                    let t = HostTime(ms * 1_000_000 + 500_000);
                    rates.add(CLOCK.camera_us_of_host(t) as u64);
                }
            }
        }
        rates
    }

    fn rise_ms(rates: &RateHistogram) -> Option<f64> {
        let counts = Counts {
            rates,
            clock: &CLOCK,
        };
        let at = |ms: i64| HostTime(ms * 1_000_000);
        let idle = counts.idle_per_bin(at(1_000), at(2_000))?;
        let begun = counts.rise(at(2_000), at(3_000), idle);
        begun.map(|t| t.as_secs_f64() * 1e3)
    }

    #[test]
    fn a_rise_before_the_contact_is_found_within_a_bin_or_two() {
        let (mut off, mut found) = (0.0f64, 0);
        for seed in 0..50 {
            if let Some(ms) = rise_ms(&counted(seed, 10.0, 20.0, 2_900)) {
                off += (ms - 2_900.0).abs();
                found += 1;
            }
        }
        assert!(found >= 49, "{found} of 50");
        assert!(off / f64::from(found) < 15.0, "{off}");
    }

    /// With noise alone at most one press in a hundred seems to begin early, and a median requires half of them.
    #[test]
    fn noise_alone_rarely_rises() {
        for idle in [0.2, 2.0, 20.0] {
            let false_ones = (0..200)
                .filter(|seed| rise_ms(&counted(*seed, idle, 0.0, 9_000)).is_some())
                .count();
            assert!(false_ones <= 8, "{false_ones} of 200 at {idle}");
        }
    }

    #[test]
    fn heights_lie_on_the_measured_way() {
        let contact = HostTime(1_000_000_000);
        let ms = |ms: i64| HostTime(1_000_000_000 - ms * 1_000_000);
        let way = Descent {
            last_above: vec![ms(40), ms(50), ms(55)],
        };
        for (before, mm) in [
            (-5, 0.0),
            (0, 0.0),
            (20, 0.05),
            (40, 0.1),
            (45, 0.15),
            (55, 0.3),
            (90, 0.3),
        ] {
            let found = way.height_mm(contact, ms(before));
            assert!((found - mm).abs() < 1e-9, "{before} ms: {found} for {mm}");
        }
        assert_eq!(Descent::default().height_mm(contact, ms(30)), 0.0);
    }
}
