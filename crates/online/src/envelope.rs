//! How far estimates of a touch may be off at every instant, learnt from calibration presses.
//!
//! Of each press, the largest distance after so many events; of all presses, the multiple of it that holds at all instants together: the
//! conformal quantile, over presses, of the largest ratio that a press has at any instant (Vovk, Gammerman & Shafer, "Algorithmic
//! Learning in a Random World", 2005, chapter 2; each half of the presses is scored with the largest distances of the other). Events,
//! not time, tell how far a touch has come: a press that stops early stays uncertain.

use serde::{Deserialize, Serialize};

/// Steps per doubling of the events.
const STEPS_PER_OCTAVE: f64 = 4.0;
/// Smallest of these distances, mm: below what any skin resolves.
const LEAST_MM: f64 = 0.02;

/// Events so far, and distance of the estimate from what it estimates, mm, at the instants of one press.
pub(crate) type Distances = Vec<(u32, f64)>;

/// Distances that hold at every instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Envelope {
    /// Largest distance by step of events, mm; falls with them.
    largest_mm: Vec<f64>,
    /// Multiple of it that holds at all instants.
    multiple: f64,
}

fn step(events: u32) -> usize {
    (STEPS_PER_OCTAVE * libm::log2(f64::from(events) + 1.0)) as usize
}

/// Largest distance of these presses in each step; none without presses.
fn largest(presses: &[&Distances]) -> Vec<f64> {
    let all = || presses.iter().flat_map(|p| p.iter());
    let steps = all().map(|(events, _)| step(*events) + 1).max();
    let mut largest = vec![LEAST_MM; steps.unwrap_or(0)];
    for (events, distance) in all() {
        let at = step(*events);
        largest[at] = f64::max(largest[at], *distance);
    }
    // More events are no less certain; a step that was not seen counts as the one with more.
    for at in (1..largest.len()).rev() {
        largest[at - 1] = largest[at - 1].max(largest[at]);
    }
    largest
}

fn at_step(largest: &[f64], step: usize) -> f64 {
    largest
        .get(step)
        .or(largest.last())
        .copied()
        .unwrap_or(f64::INFINITY)
}

/// Every second of these, from the first or from the second.
pub(crate) fn half<T>(all: &[T], odd: usize) -> impl Iterator<Item = &T> {
    all.iter().skip(odd).step_by(2)
}

impl Envelope {
    /// From the distances of calibration presses, so that those of another press stay within it with this probability; `None` if
    /// the presses are too few for that.
    pub(crate) fn learn(presses: &[Distances], probability: f64) -> Option<Self> {
        let mut ratios = Vec::new();
        for odd in [0, 1] {
            let of_others = largest(&half(presses, 1 - odd).collect::<Vec<_>>());
            for press in half(presses, odd) {
                let ratio =
                    |(events, distance): &(u32, f64)| distance / at_step(&of_others, step(*events));
                ratios.push(press.iter().map(ratio).fold(0.0, f64::max));
            }
        }
        ratios.sort_by(f64::total_cmp);
        let rank = ((presses.len() as f64 + 1.0) * probability).ceil() as usize;
        Some(Self {
            multiple: *ratios.get(rank.checked_sub(1)?)?,
            largest_mm: largest(&presses.iter().collect::<Vec<_>>()),
        })
    }

    /// Distance after so many events, mm.
    pub(crate) fn within_mm(&self, events: u32) -> f64 {
        self.multiple * at_step(&self.largest_mm, step(events))
    }

    /// Whether some calibration press had so many events.
    pub(crate) fn has_seen(&self, events: u32) -> bool {
        step(events) < self.largest_mm.len()
    }

    /// The same distance after any number of events.
    #[cfg(test)]
    pub(crate) fn of(distance_mm: f64) -> Self {
        Self {
            largest_mm: vec![distance_mm],
            multiple: 1.0,
        }
    }
}
