//! Summary of a replay: delays and errors of detected touches and positions, and speed.

use serde::Serialize;
use skinrig_analysis::Analysis;
use skinrig_analysis::metrics::quantile;
use skinrig_online::{Detection, DetectionScore, Felt, Position, ScoredPress, TipCourses};
use skinrig_recorder::RecorderError;

use crate::args::StopRule;

/// A position of a touch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sighting {
    pub(super) host_us: i64,
    /// Onset of the touch, host µs.
    pub(super) onset_us: i64,
    pub(super) position: Position,
}

/// True if a press may end here.
fn is_met(rule: StopRule, sighting: &Sighting) -> bool {
    let region = sighting.position.region;
    if sighting.position.location.is_none() {
        return false;
    }
    match rule {
        StopRule::Region(mm) => region.is_some_and(|r| r.semi_axes_mm[0] <= mm),
        StopRule::After(ms) => (sighting.host_us - sighting.onset_us) as f64 >= ms * 1e3,
    }
}

/// A rule as a heading.
pub(super) fn words(rule: StopRule) -> String {
    match rule {
        StopRule::Region(mm) => format!("region within {mm} mm"),
        StopRule::After(ms) => format!("stop after {ms} ms"),
    }
}

/// Median and 99th percentile.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Quantiles {
    pub(super) n: usize,
    pub(super) median: Option<f64>,
    pub(super) p99: Option<f64>,
}

impl Quantiles {
    pub(super) fn of(mut values: Vec<f64>) -> Self {
        Self {
            n: values.len(),
            median: quantile(&mut values, 0.5),
            p99: quantile(&mut values, 0.99),
        }
    }
}

/// The scored presses at a moment.
#[derive(Debug, Clone, Serialize)]
pub(super) struct At {
    pub(super) after_onset_ms: Quantiles,
    pub(super) error_mm: Quantiles,
    /// Longer semi-axis of the regions, mm.
    pub(super) region_mm: Quantiles,
    /// Share of positions whose region holds the truth; `None` without regions.
    pub(super) inside: Option<f64>,
}

/// Depths of the scored presses, while they were felt.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Reached {
    /// Error of the last depth before the release, mm,
    pub(super) error_mm: Quantiles,
    /// and how far its interval reaches to each side, mm.
    pub(super) within_mm: Quantiles,
    /// Touches with depths, and those whose intervals hold the measured depth at every instant.
    pub(super) held: (usize, usize),
}

/// Result of a replay.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Felts {
    /// Scored presses that were carried out and follow another one, excluded or not,
    pub(super) presses: usize,
    /// and those after the end of a camera's data.
    pub(super) outside: usize,
    pub(super) felt: usize,
    pub(super) missed: usize,
    pub(super) alarmed: usize,
    pub(super) delay_ms: Quantiles,
    /// Depth of the measured tip when the touch was felt, mm; of sessions with poses.
    pub(super) depth_mm: Quantiles,
    pub(super) release_ms: Quantiles,
    pub(super) false_alarms: u64,
    pub(super) at_risk_s: f64,
    pub(super) false_alarms_per_s: Option<(f64, (f64, f64))>,
    pub(super) at_stop: At,
    /// The same at the last position before the release.
    pub(super) at_end: At,
    /// Touches with regions, and those whose regions hold the truth at every instant.
    pub(super) held: (usize, usize),
    pub(super) reached: Reached,
}

impl Felts {
    pub(super) fn new(
        analysis: &Analysis,
        tips: &TipCourses,
        found: &[Detection],
        sightings: &[Sighting],
        stop: StopRule,
        until_us: i64,
        tip_depth_mm: impl Fn(f64) -> Result<Option<f64>, RecorderError>,
    ) -> Result<Self, RecorderError> {
        let (presses, outside): (Vec<ScoredPress>, Vec<ScoredPress>) = ScoredPress::of(analysis)
            .into_iter()
            .partition(|p| p.release_us + 100e3 < until_us as f64);
        let score = DetectionScore::new(found, &presses);
        let felt_us = |(row, delay_ms): &(usize, f64)| {
            let press = presses.iter().find(|press| press.row == *row)?;
            Some(press.contact_us + delay_ms * 1e3)
        };
        let felt_us = score.delays_ms.iter().filter_map(felt_us);
        let depths_mm = felt_us.filter_map(|us| tip_depth_mm(us).transpose());
        let depths_mm: Vec<f64> = depths_mm.collect::<Result<_, _>>()?;
        let of_press = |press: &ScoredPress| {
            let range = press.contact_us - 1e3..press.release_us;
            let onset = found
                .iter()
                .find(|d| d.felt == Felt::Onset && range.contains(&(d.host_us as f64)))?;
            let own = |s: &&Sighting| s.onset_us == onset.host_us;
            Some(sightings.iter().filter(own).copied().collect::<Vec<_>>())
        };
        // A touch that begins again during a press that came while a false alarm lasted was not felt.
        let is_felt = |p: &&ScoredPress| score.delays_ms.iter().any(|(row, _)| *row == p.row);
        let seen: Vec<(usize, Vec<Sighting>)> = presses
            .iter()
            .filter(is_felt)
            .filter_map(|p| Some((p.row, of_press(p)?)))
            .collect();
        let first = |s: &[Sighting]| s.iter().find(|s| is_met(stop, s)).copied();
        let last = |s: &[Sighting]| s.iter().rfind(|s| s.position.location.is_some()).copied();
        Ok(Self {
            presses: presses.len(),
            outside: outside.len(),
            felt: score.delays_ms.len(),
            missed: score.missed,
            alarmed: score.alarmed,
            delay_ms: Quantiles::of(score.delays_ms.iter().map(|d| d.1).collect()),
            depth_mm: Quantiles::of(depths_mm),
            release_ms: Quantiles::of(score.releases_ms.clone()),
            false_alarms: score.false_alarms,
            at_risk_s: score.at_risk_s,
            false_alarms_per_s: score.false_alarms_per_s(),
            at_stop: at(analysis, &seen, first),
            at_end: at(analysis, &seen, last),
            held: held(analysis, &seen),
            reached: reached(analysis, tips, &seen),
        })
    }
}

/// Touches with regions, and those whose regions hold the truth at every instant.
fn held(analysis: &Analysis, seen: &[(usize, Vec<Sighting>)]) -> (usize, usize) {
    let inside = |row: &usize, s: &Sighting| {
        let (truth, at) = (analysis.presses[*row].truth?, s.position.location?.at);
        let error = [truth.x_mm - at[0], truth.y_mm - at[1]];
        Some(s.position.region?.reach(error) <= 1.0)
    };
    let all = seen.iter().map(|(row, sightings)| {
        let found: Vec<bool> = sightings.iter().filter_map(|s| inside(row, s)).collect();
        (!found.is_empty()).then(|| found.iter().all(|inside| *inside))
    });
    let all: Vec<bool> = all.flatten().collect();
    (all.len(), all.iter().filter(|held| **held).count())
}

fn reached(analysis: &Analysis, tips: &TipCourses, seen: &[(usize, Vec<Sighting>)]) -> Reached {
    let (mut errors, mut within) = (Vec::new(), Vec::new());
    let mut held = (0, 0);
    for (row, sightings) in seen {
        let tip = tips.get(&analysis.presses[*row].press);
        let error = |s: &Sighting| {
            let depth = s.position.depth?;
            let error_mm = depth.mm - tip?.reached_mm(s.host_us as f64)?;
            Some((error_mm.abs(), depth.within_mm))
        };
        let all: Vec<(f64, f64)> = sightings.iter().filter_map(error).collect();
        let Some((last, reach)) = all.last() else {
            continue;
        };
        errors.push(*last);
        within.push(*reach);
        held.0 += 1;
        held.1 += usize::from(all.iter().all(|(error, reach)| error <= reach));
    }
    Reached {
        error_mm: Quantiles::of(errors),
        within_mm: Quantiles::of(within),
        held,
    }
}

fn at(
    analysis: &Analysis,
    seen: &[(usize, Vec<Sighting>)],
    choose: impl Fn(&[Sighting]) -> Option<Sighting>,
) -> At {
    let (mut after, mut errors, mut sizes) = (Vec::new(), Vec::new(), Vec::new());
    let mut inside = 0;
    for (row, sightings) in seen {
        let chosen = choose(sightings);
        let located = chosen.and_then(|s| Some((s, s.position.location?)));
        let Some(((sighting, location), truth)) = located.zip(analysis.presses[*row].truth) else {
            continue;
        };
        let error = [truth.x_mm - location.at[0], truth.y_mm - location.at[1]];
        after.push((sighting.host_us - sighting.onset_us) as f64 * 1e-3);
        errors.push(libm::hypot(error[0], error[1]));
        if let Some(region) = sighting.position.region {
            sizes.push(region.semi_axes_mm[0]);
            inside += usize::from(region.reach(error) <= 1.0);
        }
    }
    At {
        after_onset_ms: Quantiles::of(after),
        error_mm: Quantiles::of(errors),
        inside: (!sizes.is_empty()).then(|| f64::from(inside as u32) / sizes.len() as f64),
        region_mm: Quantiles::of(sizes),
    }
}
