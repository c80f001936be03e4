//! Owns the initial search for a camera clock: correlates the rhythm of the planned presses with the activity.

use super::activity::Activity;
use super::correlate::Correlator;
use super::line::median;
use super::span::PressSpan;

/// Bins merged for the search.
const MERGE: usize = 5;
/// Largest drift of the search.
pub(super) const MAX_DRIFT: f64 = 200e-6;
/// Distance of two candidate drifts at the ends of the session, µs.
const DRIFT_STEP_US: f64 = 150_000.0;

/// A clock that maps host µs to camera µs relative to the histogram's start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Map {
    pub offset_us: f64,
    pub drift: f64,
}

impl Map {
    pub(super) fn camera(self, host_us: f64) -> f64 {
        self.offset_us + host_us + self.drift * host_us
    }

    pub(super) fn host(self, camera_us: f64) -> f64 {
        (camera_us - self.offset_us) / (1.0 + self.drift)
    }
}

/// Median time from one contact to the next, µs.
pub(super) fn period_us(presses: &[PressSpan]) -> f64 {
    let mut steps: Vec<f64> = presses
        .windows(2)
        .map(|w| w[1].contact_us - w[0].contact_us)
        .collect();
    median(&mut steps).unwrap_or(0.0)
}

/// The clock whose press spans best match the activity, with a drift within [`MAX_DRIFT`] of `about`.
pub(super) fn first_map(activity: &Activity, presses: &[PressSpan], about: f64) -> Map {
    let bin_us = activity.bin_us * MERGE as f64;
    let mean = activity.values.iter().sum::<f64>() / activity.values.len() as f64;
    let merged: Vec<f64> = activity
        .values
        .chunks(MERGE)
        .map(|bins| bins.iter().map(|v| v - mean).sum())
        .collect();
    let side_us = period_us(presses);
    let from_us = presses[0].contact_us - side_us;
    let middle_us = presses[presses.len() / 2].contact_us;
    let half_us = (middle_us - from_us)
        .max(presses[presses.len() - 1].release_us - middle_us)
        .max(1.0);
    let length = ((presses[presses.len() - 1].release_us + side_us - from_us) / bin_us
        * (1.0 + about.abs() + MAX_DRIFT))
        .ceil() as usize
        + 1;
    let correlator = Correlator::new(&merged, length);
    let steps = (MAX_DRIFT * half_us / DRIFT_STEP_US).ceil() as i32;
    let drifts = (-steps..=steps).map(|step| {
        if steps == 0 {
            about
        } else {
            about + MAX_DRIFT * f64::from(step) / f64::from(steps)
        }
    });
    let template = |drift: f64| {
        // Time within the template of a host time; the middle of the session is fixed.
        let place = |host_us: f64| {
            let stretched = host_us + drift * (host_us - middle_us) - from_us;
            ((stretched / bin_us).max(0.0) as usize).min(length)
        };
        let mut template = vec![0.0; length];
        for press in presses {
            let (a, b) = (place(press.contact_us), place(press.release_us));
            template[a..b.max(a + 1).min(length)].fill(1.0);
        }
        let share = template.iter().sum::<f64>() / length as f64;
        template.iter_mut().for_each(|v| *v -= share);
        template
    };
    let drifts: Vec<f64> = drifts.collect();
    let mut best: Option<(f64, Map)> = None;
    for pair in drifts.chunks(2) {
        let templates: Vec<Vec<f64>> = pair.iter().map(|drift| template(*drift)).collect();
        let other = templates.get(1).map_or(&[][..], Vec::as_slice);
        let found = correlator.best_lags([&templates[0], other]);
        for (&drift, (lag, score)) in pair.iter().zip(found) {
            let offset_us = lag as f64 * bin_us - from_us - drift * middle_us;
            if best.is_none_or(|(s, _)| score > s) {
                best = Some((score, Map { offset_us, drift }));
            }
        }
    }
    best.map_or(
        Map {
            offset_us: 0.0,
            drift: 0.0,
        },
        |(_, map)| map,
    )
}
