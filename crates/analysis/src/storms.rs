//! Event storms: presses with far more events than others at their depth, in one camera.
//!
//! Flickering light or hot pixels can send more events in a moment than a touch does. The press then has a position, but of the
//! storm. `suspend.event_rate` in a protocol notices one while it happens; this caution finds those that nothing noticed.

use std::collections::BTreeMap;

use skinrig_model::{CameraId, PressId};

use crate::metrics::quantile;
use crate::result::{PressResult, Warning, WarningCause};

/// A storm has so many times the events of the busiest tenth of the presses at its depth. Our choice: presses near a camera reach
/// 1.5 to 2 times the median.
const TIMES: f64 = 3.0;
/// Share of the presses at a depth below the one that is compared with.
const BUSY: f64 = 0.9;
/// Fewest presses at a depth that tell what is usual.
const LEAST: usize = 8;

/// A caution for each camera with storms.
pub(crate) fn storms(presses: &[PressResult]) -> Vec<Warning> {
    CameraId::ALL
        .into_iter()
        .filter_map(|camera| of_camera(presses, camera))
        .collect()
}

fn of_camera(presses: &[PressResult], camera: CameraId) -> Option<Warning> {
    let mut depths: BTreeMap<i64, Vec<(&PressResult, f64)>> = BTreeMap::new();
    for press in presses {
        if let Some(view) = press.views[camera.index()] {
            let micrometres = (press.depth_mm * 1e3).round() as i64;
            let rates = depths.entry(micrometres).or_default();
            rates.push((press, view.rate_per_s));
        }
    }
    let storms = depths.values().flat_map(|rates| {
        let median = median(rates.iter().map(|(_, rate)| *rate)).unwrap_or(f64::INFINITY);
        let candidates = rates.iter().filter(move |(_, rate)| *rate > TIMES * median);
        candidates
            .filter_map(|(press, rate)| Some((press.press, times_usual(press, *rate, rates)?)))
    });
    let mut storms: Vec<(PressId, f64)> = storms.collect();
    storms.sort_by_key(|(press, _)| *press);
    let cause = WarningCause::EventStorms {
        presses: storms.iter().map(|s| s.0).collect(),
        times: storms.iter().map(|s| s.1).fold(0.0, f64::max),
    };
    (!storms.is_empty()).then(|| Warning::of_camera(camera, cause))
}

/// How many times the events of others at its depth a press has, if it is a storm: of busy ones, and of its repetitions.
fn times_usual(press: &PressResult, own: f64, rates: &[(&PressResult, f64)]) -> Option<f64> {
    let others = || rates.iter().filter(|(p, _)| p.press != press.press);
    let mut busy: Vec<f64> = others().map(|(_, rate)| *rate).collect();
    if busy.len() < LEAST {
        return None;
    }
    let repetitions = others().filter(|(p, _)| p.location == press.location);
    let usual = median(repetitions.map(|(_, rate)| *rate)).unwrap_or(0.0);
    let usual = quantile(&mut busy, BUSY)?.max(usual);
    (usual > 0.0 && own > TIMES * usual).then(|| own / usual)
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    quantile(&mut values.collect::<Vec<_>>(), 0.5)
}
