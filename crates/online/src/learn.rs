//! Learns the model from the events of the calibration presses: one pass per camera.

use skinrig_analysis::{EventSource, EventSourceError};
use skinrig_model::CameraId;

use crate::clock::SLOT_US;
use crate::counts::CameraCounts;
use crate::model::{TAIL_BIN, TAIL_BINS, TouchModel};
use crate::patterns::patterns;
use crate::regions::{REGIONS, opposite};
use crate::training::Training;

/// Least events of a press in a block of pixels whose fading counts.
const FADING_EVENTS: f64 = 8.0;
/// Slowest fading that is continued, per bin.
const MOST_RATIO: f64 = 0.97;
/// Fading below this part of its first half is none.
const LEAST_FADING: f64 = 0.01;
/// Touches are looked for from a quarter of an event to 16 events per slot: 0.5 to 32 kev/s.
const LOWEST_OCTAVE: i32 = -2;

/// Learns from the events of `source`.
///
/// # Errors
/// If the events cannot be read.
pub fn learn(
    training: &Training,
    source: &dyn EventSource,
) -> Result<TouchModel, EventSourceError> {
    let one = CameraCounts::collect(training, CameraId::One, source)?;
    let two = CameraCounts::collect(training, CameraId::Two, source)?;
    let cameras = [one, two];
    let idle = |k: usize| (0..REGIONS).map(|r| cameras[k].idle_rate(r)).collect();
    let longest = training.presses.iter().map(|p| p.release_us - p.contact_us);
    let longest_us = longest.fold(0.0, f64::max);
    Ok(TouchModel {
        idle: [idle(0), idle(1)],
        patterns: patterns(training, &cameras),
        tail: tail(training, &cameras),
        longest_press: (longest_us / SLOT_US as f64) as i64 + 1,
        lowest_octave: LOWEST_OCTAVE,
    })
}

/// Sums over the presses for one bin and polarity.
#[derive(Debug, Clone, Copy, Default)]
struct TailSum {
    events: f64,
    idle: f64,
    /// Events of the presses, times slots.
    pressed: f64,
}

/// Mean fading, until it is within the noise.
fn tail(training: &Training, cameras: &[CameraCounts; 2]) -> Vec<[f64; 2]> {
    let mut sums = [[TailSum::default(); 2]; TAIL_BINS];
    for camera in cameras {
        for (press, counts) in training.presses.iter().zip(&camera.presses) {
            let Some((from, to)) = press.gap_us() else {
                continue;
            };
            let bin_us = f64::from(TAIL_BIN) * SLOT_US as f64;
            let bins = (((to - from) / bin_us) as usize).min(TAIL_BINS);
            let slots = (press.release_us - press.contact_us) / SLOT_US as f64;
            let excess = |r: usize| f64::from(counts.pressed[r]) - camera.idle_rate(r) * slots;
            let both: Vec<f64> = (0..REGIONS)
                .map(|r| excess(r) + excess(opposite(r)))
                .collect();
            let fades = |r: usize| both[r] >= FADING_EVENTS;
            for r in (0..REGIONS).filter(|r| fades(*r)) {
                for bin in &mut sums[..bins] {
                    bin[r & 1].idle += camera.idle_rate(r) * f64::from(TAIL_BIN);
                    bin[r & 1].pressed += both[r] * f64::from(TAIL_BIN);
                }
            }
            for (bin, r) in &counts.tail {
                let (bin, r) = (usize::from(*bin), usize::from(*r));
                if bin < bins && fades(r) {
                    sums[bin][r & 1].events += 1.0;
                }
            }
        }
    }
    let known = |s: &TailSum| s.pressed > 0.0 && s.events - s.idle > 3.0 * (s.idle + 1.0).sqrt();
    let end = sums.iter().take_while(|bin| bin.iter().any(known)).count();
    let mean = |s: &TailSum| {
        let more = (s.events - s.idle).max(0.0);
        if s.pressed > 0.0 {
            more / s.pressed
        } else {
            0.0
        }
    };
    let mut means: Vec<[f64; 2]> = sums[..end]
        .iter()
        .map(|bin| [mean(&bin[0]), mean(&bin[1])])
        .collect();
    extend(&mut means);
    means
}

/// Continues the fading beyond what was seen, by the ratio of its second half to its first: the next press came before its end.
fn extend(means: &mut Vec<[f64; 2]>) {
    let half = means.len() / 2;
    let sum = |of: &[[f64; 2]]| of.iter().flatten().sum::<f64>();
    let (first, second) = (sum(&means[..half]), sum(&means[means.len() - half..]));
    if half == 0 || first <= 0.0 {
        return;
    }
    let ratio = libm::pow(second / first, 1.0 / (means.len() - half) as f64).min(MOST_RATIO);
    let least = LEAST_FADING * first / half as f64;
    let mut last = [0, 1].map(|p| {
        means[means.len() - half..]
            .iter()
            .map(|m| m[p])
            .sum::<f64>()
    });
    // From the middle of the second half to the first bin beyond it.
    let by = libm::pow(ratio, 0.5 * (half + 1) as f64) / half as f64;
    last = last.map(|v| v * by);
    while last[0] + last[1] > least {
        means.push(last);
        last = last.map(|v| v * ratio);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fading_that_the_next_press_cut_continues_at_its_pace() {
        let of = |bin: usize| 0.3 * libm::exp(-(bin as f64) / 20.0);
        let mut means: Vec<[f64; 2]> = (0..30).map(|b| [of(b), 2.0 * of(b)]).collect();
        extend(&mut means);
        assert!((80..150).contains(&means.len()), "{}", means.len());
        for (bin, [off, on]) in means.iter().enumerate() {
            assert!(
                (off / of(bin) - 1.0).abs() < 0.05 && (on / off - 2.0).abs() < 1e-9,
                "{bin}"
            );
        }
        let mut none: Vec<[f64; 2]> = Vec::new();
        extend(&mut none);
        assert_eq!(none, Vec::<[f64; 2]>::new());
    }
}
