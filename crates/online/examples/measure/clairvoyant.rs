//! A detector that knows the place of the next touch and the course of its events, but not its time: the bound.
//!
//! It tests every onset within a window (generalised likelihood ratio over the unknown time) against the idle rates of the whole
//! session. The template of a press is that of the other presses at its place.

use crate::recording::{REGIONS, Recording};
use skinrig_online::SLOT_US;

/// Length of the template, slots: 80 ms.
const WINDOW: usize = 160;
/// Standard deviation that smooths the course, slots.
const SIGMA: f64 = 4.0;
/// Blocks of idle time, slots.
const BLOCK: usize = 200;

pub(crate) fn slot_of(host_us: f64) -> i64 {
    (host_us / SLOT_US as f64).floor() as i64
}

/// Expected events per slot and region, without a touch.
pub(crate) fn idle_rates(recording: &Recording, spans: &[(i64, i64)]) -> Vec<f64> {
    let mut rates = vec![0.5; REGIONS];
    let mut slots = 0.0;
    for (from, to) in spans {
        for slot in *from..*to {
            for r in recording.slot(slot) {
                rates[usize::from(*r)] += 1.0;
            }
        }
        slots += (to - from) as f64;
    }
    rates.iter().map(|r| r / slots).collect()
}

/// Shares of the regions, and events per slot after the contact.
pub(crate) struct Template {
    shares: Vec<f64>,
    course: Vec<f64>,
}

fn blurred(of: &[f64]) -> Vec<f64> {
    let at = |r: usize, by: isize| {
        let column = (r / 2 % 40) as isize + by;
        if (0..40).contains(&column) {
            of[(r as isize + 2 * by) as usize]
        } else {
            of[r]
        }
    };
    (0..of.len())
        .map(|r| 0.5 * of[r] + 0.25 * (at(r, -1) + at(r, 1)))
        .collect()
}

impl Template {
    /// From presses with these contacts.
    pub(crate) fn new(recording: &Recording, idle: &[f64], contacts: &[i64]) -> Self {
        let n = contacts.len() as f64;
        // Where: the first 5 % of the events.
        let idle_all: f64 = idle.iter().sum();
        let mut course = vec![0.0; WINDOW];
        for contact in contacts {
            for (tau, rate) in course.iter_mut().enumerate() {
                *rate += recording.slot(contact + tau as i64).len() as f64 / n - idle_all / n;
            }
        }
        let total: f64 = course.iter().sum();
        let mut sum = 0.0;
        let early = course.iter().position(|c| {
            sum += c;
            sum >= 0.08 * total
        });
        let early = early.unwrap_or(WINDOW);
        let mut shares: Vec<f64> = idle.iter().map(|r| -r * n * early as f64).collect();
        for contact in contacts {
            for tau in 0..early {
                for r in recording.slot(contact + tau as i64) {
                    shares[usize::from(*r)] += 1.0;
                }
            }
        }
        let mut shares: Vec<f64> = blurred(&shares).iter().map(|s| s.max(0.0)).collect();
        let all: f64 = shares.iter().sum();
        // Regions where the touch is seen; the course counts those alone.
        for s in &mut shares {
            *s /= all;
            if *s < 1e-3 {
                *s = 0.0;
            }
        }
        let in_it: f64 = shares.iter().sum();
        for s in &mut shares {
            *s /= in_it;
        }
        let own_idle: f64 = shares
            .iter()
            .zip(idle)
            .filter(|(s, _)| **s > 0.0)
            .map(|(_, i)| i)
            .sum();
        let mut course = vec![0.0; WINDOW];
        for contact in contacts {
            for (tau, rate) in course.iter_mut().enumerate() {
                let seen = recording
                    .slot(contact + tau as i64)
                    .iter()
                    .filter(|r| shares[usize::from(**r)] > 0.0);
                *rate += (seen.count() as f64 - own_idle) / n;
            }
        }
        let smooth = |tau: usize| {
            let weight = |o: usize| libm::exp(-0.5 * ((o as f64 - tau as f64) / SIGMA).powi(2));
            let sums = (0..WINDOW).fold((0.0, 0.0), |(v, w), o| {
                (v + weight(o) * course[o], w + weight(o))
            });
            (sums.0 / sums.1).max(1e-4)
        };
        Self {
            shares,
            course: (0..WINDOW).map(smooth).collect(),
        }
    }

    /// The statistic at the end of each slot of `from..to`, nats; a touch may begin at any of them.
    pub(crate) fn statistic(
        &self,
        recording: &Recording,
        idle: &[f64],
        (from, to): (i64, i64),
    ) -> Vec<f64> {
        let mut sums = [0.0f64; WINDOW];
        let mut out = Vec::with_capacity((to - from) as usize);
        let mut seen: Vec<f64> = Vec::new();
        for slot in from..to {
            seen.clear();
            seen.extend(recording.slot(slot).iter().filter_map(|r| {
                let r = usize::from(*r);
                (self.shares[r] > 0.0).then(|| self.shares[r] / idle[r])
            }));
            let phase = (slot - from) as usize % WINDOW;
            sums[phase] = 0.0;
            let mut best = 0.0f64;
            for (start, sum) in sums.iter_mut().enumerate() {
                let tau = (phase + WINDOW - start) % WINDOW;
                let rate = self.course[tau];
                *sum -= rate;
                for over in &seen {
                    *sum += libm::log1p(rate * over);
                }
                if (slot - from) as usize >= tau {
                    best = best.max(*sum);
                }
            }
            out.push(best);
        }
        out
    }

    /// Maxima over blocks of idle time.
    pub(crate) fn maxima(
        &self,
        recording: &Recording,
        idle: &[f64],
        spans: &[(i64, i64)],
    ) -> Vec<f64> {
        let mut maxima = Vec::new();
        for span in spans {
            let values = self.statistic(recording, idle, *span);
            let blocks = values.chunks_exact(BLOCK);
            maxima.extend(blocks.map(|b| b.iter().copied().fold(0.0, f64::max)));
        }
        maxima.sort_by(|a, b| b.total_cmp(a));
        maxima
    }
}

/// Threshold of a rate of false alarms: as the detector chooses its own.
pub(crate) fn threshold(maxima: &[f64], per_s: f64) -> f64 {
    let count = (maxima.len() / 20).max(20).min(maxima.len() - 1);
    let base = maxima[count];
    let scale = maxima[..count].iter().map(|m| m - base).sum::<f64>() / count as f64;
    let seconds = maxima.len() as f64 * BLOCK as f64 * SLOT_US as f64 * 1e-6;
    base + scale * libm::log(count as f64 / (seconds * per_s))
}
