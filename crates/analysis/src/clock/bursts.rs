//! Owns the bursts of a camera: every instant at which its activity looks like a press, planned or not.

use super::activity::Activity;
use super::refine::{MIN_STRENGTH, Profile, products};
use super::search::Map;
use super::span::PressSpan;

/// Bins merged for comparing the recording with the mean press.
const MERGE: usize = 2;
/// Minimum distance of two bursts as a share of the smallest step of the plan, and its limits, µs.
const APART: f64 = 0.45;
const APART_US: (f64, f64) = (200_000.0, 600_000.0);

/// Bursts of one camera on the host clock, up to a common shift.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bursts {
    /// Contacts, ascending, µs.
    pub at_us: Vec<f64>,
    /// Start of the recording, µs.
    pub from_us: f64,
    /// End of the recording, µs.
    pub to_us: f64,
}

impl Bursts {
    /// All bursts at least a third as strong as the mean press.
    pub(super) fn new(activity: &Activity, presses: &[PressSpan], map: Map) -> Self {
        let profile = Profile::new(activity, presses, map);
        let merged_us = activity.bin_us * MERGE as f64;
        let mean = |bins: &[f64]| bins.iter().sum::<f64>() / bins.len() as f64;
        let mut template: Vec<f64> = profile.values.chunks_exact(MERGE).map(mean).collect();
        let level = mean(&template);
        template.iter_mut().for_each(|v| *v -= level);
        let strength: f64 = template.iter().map(|v| v * v).sum();
        // Presses at the ends of the recording extend beyond it.
        let mut series = vec![0.0; template.len()];
        series.extend(activity.values.chunks(MERGE).map(mean));
        series.resize(series.len() + template.len(), 0.0);
        let matches = products(&template, &series);
        let contact_us =
            |i: usize| (i as f64 - template.len() as f64 + 0.25) * merged_us - profile.from_us;
        let found = strongest(
            &matches,
            MIN_STRENGTH * strength,
            separation(presses) / merged_us,
        );
        let length_us = activity.length_us();
        let inside = found
            .into_iter()
            .map(contact_us)
            .filter(|at| (0.0..=length_us).contains(at));
        Self {
            at_us: inside.map(|at| map.host(at)).collect(),
            from_us: map.host(0.0),
            to_us: map.host(length_us),
        }
    }
}

/// Minimum distance of two bursts, µs.
fn separation(presses: &[PressSpan]) -> f64 {
    let steps = presses
        .windows(2)
        .map(|w| w[1].contact_us - w[0].contact_us);
    let smallest = steps.fold(f64::INFINITY, f64::min);
    (APART * smallest).clamp(APART_US.0, APART_US.1)
}

/// Positions of local maxima from `least` on, ascending, none within `apart` of a larger one.
fn strongest(values: &[f64], least: f64, apart: f64) -> Vec<usize> {
    let mut peaks: Vec<usize> = (1..values.len().saturating_sub(1))
        .filter(|i| values[*i] >= least.max(f64::MIN_POSITIVE))
        .filter(|i| values[*i] >= values[i - 1] && values[*i] > values[i + 1])
        .collect();
    peaks.sort_by(|a, b| values[*b].total_cmp(&values[*a]).then(a.cmp(b)));
    let reach = apart.ceil() as usize;
    let mut taken = vec![false; values.len()];
    peaks.retain(|&i| {
        let free = !taken[i];
        if free {
            let end = (i + reach + 1).min(values.len());
            taken[i.saturating_sub(reach)..end].fill(true);
        }
        free
    });
    peaks.sort_unstable();
    peaks
}
