//! Owns whether the event rate of a camera stops at a ceiling during presses, as that of a readout or a cable that carries no more does.

use skinrig_model::PressId;

use crate::metrics::quantile;
use crate::rates::RateHistogram;
use crate::result::ReadoutFault;
use crate::segment::Window;

/// Presses that reach a ceiling, at least,
const LEAST_PRESSES: usize = 6;
/// bins of each of them,
const LEAST_BINS: usize = 2;
/// and the share at the ceiling of all bins of presses that are nearer to it than to the idle rate: what nothing limits is rarely at its
/// highest.
const LEAST_SHARE: f64 = 0.3;
/// Half width of a ceiling, in the standard deviations of that count (Poisson): what nothing limits scatters by one.
const WIDTH: f64 = 0.5;
/// Highest bins that may lie above it: a bin in which the limit began.
const ABOVE: f64 = 0.99;
/// Events of a bin at a ceiling, at least.
const LEAST_EVENTS: f64 = 20.0;

/// The ceiling, if there is one. `press`: of each window.
pub(crate) fn ceiling(
    rates: &RateHistogram,
    windows: &[Window],
    press: impl Fn(usize) -> PressId,
) -> Option<ReadoutFault> {
    let of_press = |from_us: u64, to_us: u64| -> &[u32] {
        let bin = |us: u64| (us.saturating_sub(rates.start_us()) / rates.bin_us()) as usize;
        let end = bin(to_us).min(rates.counts().len());
        &rates.counts()[bin(from_us).min(end)..end]
    };
    let bins: Vec<&[u32]> = windows
        .iter()
        .map(|w| of_press(w.start_us, w.end_us))
        .collect();
    let highest = f64::from(*bins.iter().copied().flatten().max()?);
    let idle: Vec<&[u32]> = windows
        .iter()
        .map(|w| of_press(w.idle_start_us, w.start_us))
        .collect();
    let counts = |of: &[&[u32]]| -> Vec<f64> {
        let counts = of.iter().copied().flatten();
        counts.map(|n| f64::from(*n)).collect()
    };
    let usual = quantile(&mut counts(&idle), 0.5).unwrap_or(0.0);
    let mut upper = counts(&bins);
    upper.retain(|n| *n > (highest + usual) / 2.0);
    let top = quantile(&mut upper, ABOVE)?;
    let is_at = |n: f64| (n - top).abs() <= WIDTH * top.sqrt();
    let at = upper.iter().filter(|n| is_at(**n)).count();
    if top < LEAST_EVENTS || (at as f64) < LEAST_SHARE * upper.len() as f64 {
        return None;
    }
    let reaches =
        |bins: &&[u32]| bins.iter().filter(|n| is_at(f64::from(**n))).count() >= LEAST_BINS;
    let reach: Vec<usize> = (0..bins.len()).filter(|i| reaches(&bins[*i])).collect();
    // What is as steady between presses is a flicker.
    let is_of_presses = 2 * idle.iter().filter(|bins| reaches(bins)).count() < reach.len();
    (reach.len() >= LEAST_PRESSES && is_of_presses).then(|| ReadoutFault::Ceiling {
        per_ms: top / (rates.bin_us() as f64 * 1e-3),
        presses: reach.len(),
        first: press(reach[0]),
    })
}

#[cfg(test)]
mod tests {
    use skinrig_statistics::seeded;

    use super::*;

    /// Bursts of 20 bins every 200, whose highest rate depends on the place, and noise; at most `most` events in a bin.
    fn found(peak: f64, most: u32, idle: f64) -> Option<ReadoutFault> {
        let mut rng = seeded::generator(11, 0);
        let mut rates = RateHistogram::new(10_000);
        let mut list = Vec::new();
        for row in 0..20usize {
            let start = 200 * row as u64 + 100;
            list.push(Window {
                row,
                idle_start_us: (start - 50) * 10_000,
                start_us: start * 10_000,
                end_us: (start + 30) * 10_000,
            });
            for bin in 0..200u64 {
                let age = (200 * row as u64 + bin) as f64 - start as f64;
                let rise = if (0.0..20.0).contains(&age) {
                    libm::sin(std::f64::consts::PI * age / 20.0)
                } else {
                    0.0
                };
                let mean = idle + peak * (0.4 + 0.03 * row as f64) * rise;
                let normal: f64 = (0..12).map(|_| 0.5 * seeded::signed_unit(&mut rng)).sum();
                let n = (mean + normal * mean.sqrt()).round().max(0.0) as u32;
                for _ in 0..n.min(most) {
                    rates.add((200 * row as u64 + bin) * 10_000);
                }
            }
        }
        ceiling(&rates, &list, |window| PressId::from_index(window as u32))
    }

    #[test]
    fn a_rate_that_stops_at_the_same_height_in_many_presses_has_a_ceiling() {
        for (peak, idle) in [(200.0, 2.0), (1000.0, 5.0), (60.0, 1.0), (100.0, 50.0)] {
            assert_eq!(found(peak, u32::MAX, idle), None, "{peak}");
        }
        for idle in [2.0, 50.0] {
            let Some(ReadoutFault::Ceiling {
                per_ms, presses, ..
            }) = found(1000.0, 80, idle)
            else {
                panic!("not found");
            };
            assert!(
                (per_ms - 8.0).abs() < 0.1 && presses == 20,
                "{per_ms}, {presses}"
            );
        }
        // A steady light.
        assert_eq!(found(0.0, 80, 1000.0), None);
    }
}
