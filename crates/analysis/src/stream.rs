//! Owns evidence from a camera's stream alone, without the press list: silent periods and bursts.

use crate::bursts::PressBurst;
use crate::metrics::quantile;
use crate::rates::RateHistogram;
use crate::result::ClockFit;

/// A silence is significant if noise alone would have sent this many events: odds of e^40 against.
const EXPECTED_EVENTS: f64 = 40.0;
/// Minimum length of a silence, s.
const MIN_SILENCE_S: f64 = 1.0;
/// A contact is a rise of the counts from this long before it to this long after, s.
const RISE_S: f64 = 0.2;
/// Minimum rise of a contact relative to the median listed contact,
const MIN_RISE: f64 = 0.5;
/// and in Poisson standard errors.
const SIGMAS: f64 = 6.0;
/// Minimum duration of a press, s.
const MIN_PRESS_S: f64 = 0.5;

/// A silence or press on the camera's clock, µs.
pub(crate) type Span = (u64, u64);

/// Periods without events although the camera sends noise: before its first event, in between, after its last.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Silences {
    /// From time 0 to the first event; `None` if not significant.
    pub before: Option<Span>,
    /// Between events.
    pub between: Vec<Span>,
    /// From the last event on.
    pub after: Option<Span>,
}

impl Silences {
    /// Silences of a stream with presses separated by noisy idle times; none without noise. `first_us` and `last_us` are the
    /// camera's times of the first and last planned press.
    pub(crate) fn new(
        rates: &RateHistogram,
        bursts: &[Option<PressBurst>],
        (first_us, last_us): (f64, f64),
    ) -> Self {
        let mut idle: Vec<f64> = bursts
            .iter()
            .flatten()
            .filter(|burst| burst.events > 0.0)
            .filter_map(|burst| Some(burst.rates()?.1))
            .collect();
        let idle_per_s = quantile(&mut idle, 0.5).unwrap_or(0.0);
        let least_s = MIN_SILENCE_S.max(EXPECTED_EVENTS / idle_per_s);
        let counts = rates.counts();
        let begin = counts.iter().position(|c| *c > 0);
        let end = counts.iter().rposition(|c| *c > 0);
        let (Some(begin), Some(end), true) = (begin, end, least_s.is_finite()) else {
            return Self::default();
        };
        let time_us = |bin: usize| rates.start_us() + bin as u64 * rates.bin_us();
        let least_us = least_s * 1e6;
        let (from, to) = (time_us(begin), time_us(end + 1));
        let mut between = Vec::new();
        let mut silent_since = None;
        for (bin, count) in counts.iter().enumerate().take(end + 1).skip(begin) {
            match (count, silent_since) {
                (0, None) => silent_since = Some(bin),
                (0, Some(_)) | (_, None) => {}
                (_, Some(since)) => {
                    if (time_us(bin) - time_us(since)) as f64 >= least_us {
                        between.push((time_us(since), time_us(bin)));
                    }
                    silent_since = None;
                }
            }
        }
        Self {
            before: (from as f64 - first_us >= least_us).then_some((0, from)),
            between,
            after: (last_us - to as f64 >= least_us).then_some((to, u64::MAX)),
        }
    }

    /// All silences.
    pub(crate) fn spans(&self) -> Vec<Span> {
        let ends = self.before.into_iter().chain(self.after);
        self.between.iter().copied().chain(ends).collect()
    }
}

/// Contacts detected in the counts, s on the host clock, in order. `listed_s` are contact and release of the listed presses.
pub(crate) fn contacts_s(
    rates: &RateHistogram,
    clock: &ClockFit,
    listed_s: &[(f64, f64)],
) -> Vec<f64> {
    let bin_s = rates.bin_us() as f64 * 1e-6;
    let reach = (RISE_S / bin_s).round().max(1.0) as usize;
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    sums.extend(rates.counts().iter().map(|c| {
        sum += f64::from(*c);
        sum
    }));
    let n = rates.counts().len();
    // Rise at the left edge of each bin, and its standard error.
    let rise = |bin: usize| -> Option<(f64, f64)> {
        let (before, after) = (bin.checked_sub(reach)?, bin + reach);
        (after <= n).then(|| {
            let (a, b) = (sums[bin] - sums[before], sums[after] - sums[bin]);
            (b - a, (a + b + 1.0).sqrt())
        })
    };
    let bin_of = |host_s: f64| {
        let camera_us = clock.camera_us(host_s * 1e6) - rates.start_us() as f64;
        (camera_us >= 0.0).then(|| (camera_us * 1e-6 / bin_s).round() as usize)
    };
    // The clock may be off by some bins: use the largest rise around each contact.
    let about = |bin: usize| {
        let near = bin.saturating_sub(reach / 2)..=bin + reach / 2;
        near.filter_map(|b| Some(rise(b)?.0)).max_by(f64::total_cmp)
    };
    let mut usual: Vec<f64> = listed_s
        .iter()
        .filter_map(|(contact, _)| about(bin_of(*contact)?))
        .collect();
    let Some(usual) = quantile(&mut usual, 0.5).filter(|u| *u > 0.0) else {
        return Vec::new();
    };
    let mut lasts: Vec<f64> = listed_s.iter().map(|(from, to)| to - from).collect();
    let press_s = quantile(&mut lasts, 0.5).unwrap_or(0.0).max(MIN_PRESS_S) + RISE_S;
    let skip = (press_s / bin_s) as usize;
    let mut found = Vec::new();
    let mut bin = 0;
    while bin < n {
        let stands_out =
            |b: usize| rise(b).is_some_and(|(r, se)| r > MIN_RISE * usual && r > SIGMAS * se);
        if !stands_out(bin) {
            bin += 1;
            continue;
        }
        let top = (bin..(bin + reach).min(n))
            .filter_map(|b| Some((b, rise(b)?.0)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(bin, |(b, _)| b);
        let camera_us = rates.start_us() as f64 + top as f64 * rates.bin_us() as f64;
        found.push(clock.host_us_of_camera(camera_us) * 1e-6);
        bin = top + skip.max(1);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::ClockMethod;

    const CLOCK: ClockFit = ClockFit {
        method: ClockMethod::EventRates,
        offset_us: 5e6,
        drift_ppm: 0.0,
        drift_se_ppm: 0.0,
        residual_rms_us: 0.0,
        residual_max_us: 0.0,
        n: 3,
        rejected: 0,
    };

    fn noisy(lost_s: &[(f64, f64)], presses_s: &[f64]) -> RateHistogram {
        let mut rates = RateHistogram::new(10_000);
        for ms in (0..30_000).step_by(5) {
            let s = f64::from(ms) * 1e-3;
            let pressed = presses_s.iter().any(|p| (*p..p + 0.3).contains(&s));
            if !lost_s.iter().any(|(from, to)| (*from..*to).contains(&s)) {
                let n = if pressed { 20 } else { 1 };
                (0..n).for_each(|_| rates.add(5_000_000 + ms as u64 * 1000));
            }
        }
        rates
    }

    fn bursts(idle_per_s: f64) -> [Option<PressBurst>; 3] {
        [Some(PressBurst {
            events: 100.0,
            press_s: 0.5,
            idle_events: idle_per_s,
            idle_s: 1.0,
            delay_ms: None,
        }); 3]
    }

    #[test]
    fn silences_are_found_where_noise_is_expected() {
        let lost = [(0.0, 4.0), (10.0, 12.0), (25.0, 30.0)];
        let rates = noisy(&lost, &[]);
        let span = (5e6, 35e6);
        let found = Silences::new(&rates, &bursts(200.0), span);
        assert_eq!(found.before, Some((0, 9_000_000)));
        assert_eq!(found.between, [(15_000_000, 17_000_000)]);
        assert_eq!(found.after, Some((30_000_000, u64::MAX)));
        // Without noise silence means nothing, and a short one may be chance.
        assert_eq!(
            Silences::new(&rates, &bursts(0.0), span),
            Silences::default()
        );
        assert_eq!(Silences::new(&rates, &bursts(18.0), span).between, []);
    }

    #[test]
    fn unlisted_contacts_are_found() {
        let planted = [3.0, 6.0, 8.0, 9.0, 12.0, 20.0];
        let rates = noisy(&[], &planted);
        let listed: Vec<(f64, f64)> = [3.0, 6.0, 9.0, 12.0].map(|s| (s, s + 0.5)).to_vec();
        let found = contacts_s(&rates, &CLOCK, &listed);
        assert_eq!(found.len(), planted.len(), "{found:?}");
        for (a, b) in found.iter().zip(planted) {
            assert!((a - b).abs() < 0.02, "{found:?}");
        }
    }
}
