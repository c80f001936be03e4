//! How touches begin: where the first events of the calibration presses fall, by place.

use std::collections::BTreeMap;

use crate::clock::SLOT_US;
use crate::counts::CameraCounts;
use crate::model::Pattern;
use crate::regions::{COLUMNS, REGIONS, shifted};
use crate::training::Training;

/// Part of the events of a press, on its way in, that shows how it begins.
const EARLY_SHARE: f64 = 0.05;
/// The common shape of all presses counts as this many events of a place.
const SHAPE_EVENTS: f64 = 60.0;
/// Smaller shares of a region are left out.
pub(crate) const LEAST_SHARE: f64 = 3e-4;
/// Width of a region, px.
const REGION_PX: f64 = skinrig_model::SENSOR_WIDTH as f64 / COLUMNS as f64;

/// Events above the background at the start of the presses of a place, in each camera.
#[derive(Debug, Clone)]
struct Start {
    at: [f64; 2],
    presses: f64,
    columns: [f64; 2],
    seen: [f64; 2],
    excess: [Vec<f64>; 2],
}

/// When a press has sent its early events, µs after the contact.
fn early_us(press: usize, cameras: &[CameraCounts; 2]) -> f64 {
    let rate = |k: usize| (0..REGIONS).map(|r| cameras[k].idle_rate(r)).sum::<f64>();
    let idle_per_us = (rate(0) + rate(1)) / SLOT_US as f64;
    let begin = cameras.iter().flat_map(|c| &c.presses[press].begin);
    let mut times: Vec<f64> = begin.map(|(t, _)| *t).collect();
    times.sort_by(f64::total_cmp);
    let last = times.last().copied().unwrap_or(0.0);
    let enough = EARLY_SHARE * (times.len() as f64 - idle_per_us * last);
    let mut events = 0.0;
    let reached = times.iter().find(|t| {
        events += 1.0;
        events - idle_per_us * **t >= enough
    });
    reached.copied().unwrap_or(last)
}

fn starts(training: &Training, cameras: &[CameraCounts; 2]) -> Vec<Start> {
    let mut by_location: BTreeMap<u32, Start> = BTreeMap::new();
    for (i, press) in training.presses.iter().enumerate() {
        let start = by_location.entry(press.location).or_insert_with(|| Start {
            at: [0.0; 2],
            presses: 0.0,
            columns: [0.0; 2],
            seen: [0.0; 2],
            excess: [vec![0.0; REGIONS], vec![0.0; REGIONS]],
        });
        let until_us = early_us(i, cameras);
        start.presses += 1.0;
        for axis in 0..2 {
            start.at[axis] += press.at[axis];
        }
        for (k, camera) in cameras.iter().enumerate() {
            if let Some(column) = press.columns[k] {
                start.columns[k] += column / REGION_PX;
                start.seen[k] += 1.0;
            }
            for (region, excess) in start.excess[k].iter_mut().enumerate() {
                *excess -= camera.idle_rate(region) * until_us / SLOT_US as f64;
            }
            let begin = camera.presses[i].begin.iter();
            for (_, region) in begin.filter(|(t, _)| *t <= until_us) {
                start.excess[k][usize::from(*region)] += 1.0;
            }
        }
    }
    by_location.into_values().collect()
}

/// A quarter of each region in either neighbour, along columns.
fn blurred(of: &[f64]) -> Vec<f64> {
    let side = |r: usize, by: isize| shifted(r, by).map_or(of[r], |n| of[n]);
    (0..of.len())
        .map(|r| 0.5 * of[r] + 0.25 * (side(r, -1) + side(r, 1)))
        .collect()
}

/// Whole regions from the middle of the sensor to the column of a place.
fn offset(start: &Start, k: usize) -> Option<isize> {
    let middle = COLUMNS as f64 / 2.0;
    (start.seen[k] > 0.0).then(|| libm::round(start.columns[k] / start.seen[k] - middle) as isize)
}

/// Mean share of each region of a camera, with every press moved to the middle.
fn shape(starts: &[Start], k: usize) -> Vec<f64> {
    let mut sums = vec![0.0; REGIONS];
    for start in starts {
        let Some(by) = offset(start, k) else { continue };
        for (region, excess) in start.excess[k].iter().enumerate() {
            if let Some(to) = shifted(region, -by) {
                sums[to] += excess;
            }
        }
    }
    let sums: Vec<f64> = sums.into_iter().map(|s: f64| s.max(0.0)).collect();
    let total: f64 = sums.iter().sum();
    sums.into_iter()
        .map(|s| if total > 0.0 { s / total } else { 0.0 })
        .collect()
}

/// The pattern of every place at which the calibration presses were felt.
pub(crate) fn patterns(training: &Training, cameras: &[CameraCounts; 2]) -> Vec<Pattern> {
    let starts = starts(training, cameras);
    let shapes = [shape(&starts, 0), shape(&starts, 1)];
    let pattern = |start: &Start| {
        let totals = [0, 1].map(|k| start.excess[k].iter().sum::<f64>().max(1.0));
        let mut shares = Vec::new();
        for k in 0..2 {
            let by = offset(start, k);
            let moved = |r: usize| {
                by.and_then(|by| shifted(r, -by))
                    .map_or(0.0, |r| shapes[k][r])
            };
            let own = blurred(&start.excess[k]);
            let mixed: Vec<f64> = (0..REGIONS)
                .map(|r| own[r].max(0.0) + SHAPE_EVENTS * moved(r))
                .collect();
            let sum: f64 = mixed.iter().sum();
            if sum > 0.0 {
                let share = totals[k] / (totals[0] + totals[1]) / sum;
                let all = mixed
                    .into_iter()
                    .enumerate()
                    .map(|(r, m)| (k, r, m * share));
                shares.extend(all.filter(|s| s.2 >= LEAST_SHARE));
            }
        }
        Pattern {
            at: start.at.map(|sum| sum / start.presses),
            shares,
        }
    };
    starts
        .iter()
        .map(pattern)
        .filter(|p| !p.shares.is_empty())
        .collect()
}
