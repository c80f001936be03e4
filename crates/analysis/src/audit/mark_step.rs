//! Law: a camera's clock keeps its distance to the host's from one trigger mark to the next.
//!
//! Applies to sessions with marks, whatever clock was fitted: a line through one side of a step rejects the marks of the other.

use std::collections::BTreeMap;

use skinrig_model::pulse::{LOOPBACK, decode_marks};
use skinrig_model::{CameraId, Mark, TriggerEdge};

use super::clock_step;
use super::finding::finding;
use crate::input::SessionInput;
use crate::result::{Evidence, Fault, Finding, Law};

/// Minimum step, µs: far above the bounds of a mark's times,
const MIN_STEP_US: f64 = 20_000.0;
/// and above this share of the time between the marks: no clock drifts as fast.
const MAX_DRIFT: f64 = 1e-3;
/// Other changes from mark to mark are below this share of a step.
const MAX_OTHER: f64 = 0.1;
/// Minimum number of marks on each side.
const MIN_MARKS: usize = 3;

pub(super) fn findings(input: &SessionInput) -> Vec<Finding> {
    let of = |camera: CameraId| {
        let points = points(input, &input.edges[camera.index()]);
        let step = step(&points)?;
        let evidence = Evidence::MarksStep {
            camera,
            step_ms: step.by_us * 1e-3,
            from_s: step.between_us[0] * 1e-6,
            to_s: step.between_us[1] * 1e-6,
            marks: points.len(),
        };
        let law = Law::ClockDrift;
        let mut found = finding(law, Fault::ClockWrong, Some(camera), evidence);
        clock_step::ADVICE.clone_into(&mut found.advice);
        // On one side of the step, the events in the windows are not those of the presses.
        found.invalidates = true;
        Some(found)
    };
    CameraId::ALL.into_iter().filter_map(of).collect()
}

/// Marks sent and seen once: host time and camera time minus host time, µs, ascending.
fn points(input: &SessionInput, edges: &[TriggerEdge]) -> Vec<(f64, f64)> {
    let Some(channel) = input.rig.trigger_channel else {
        return Vec::new();
    };
    let edges: Vec<TriggerEdge> = edges
        .iter()
        .copied()
        .filter(|e| e.channel == channel)
        .collect();
    let mut seen: BTreeMap<Mark, Vec<u64>> = BTreeMap::new();
    for mark in decode_marks(&edges).marks {
        seen.entry(mark.mark).or_default().push(mark.t_us);
    }
    let mut sent: BTreeMap<Mark, Vec<f64>> = BTreeMap::new();
    for mark in input.marks.iter().filter(|m| m.mark != LOOPBACK) {
        sent.entry(mark.mark)
            .or_default()
            .push(mark.t.0 as f64 * 1e-3);
    }
    let once = sent.into_iter().filter_map(|(mark, hosts)| {
        let ([host_us], [camera_us]) = (hosts.as_slice(), seen.get(&mark)?.as_slice()) else {
            return None;
        };
        Some((*host_us, *camera_us as f64 - host_us))
    });
    let mut points: Vec<(f64, f64)> = once.collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// A step between two neighbouring marks.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    /// Host times of the marks, µs.
    between_us: [f64; 2],
    /// Size, µs.
    by_us: f64,
}

/// The largest change from a mark to the next, if it is a step and all others are not.
fn step(points: &[(f64, f64)]) -> Option<Step> {
    let changes = || {
        points
            .windows(2)
            .map(|w| (w[1].0 - w[0].0, w[1].1 - w[0].1))
            .enumerate()
    };
    let (at, (gap_us, by_us)) = changes().max_by(|a, b| a.1.1.abs().total_cmp(&b.1.1.abs()))?;
    let is_step = by_us.abs() > MIN_STEP_US + MAX_DRIFT * gap_us;
    let others_are_small =
        changes().all(|(k, (_, other))| k == at || other.abs() < MAX_OTHER * by_us.abs());
    let has_sides = at + 1 >= MIN_MARKS && points.len() - at > MIN_MARKS;
    (is_step && others_are_small && has_sides).then(|| Step {
        between_us: [points[at].0, points[at + 1].0],
        by_us,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks each second, on a clock with this drift.
    fn marks(n: u32, ppm: f64) -> Vec<(f64, f64)> {
        let host = (0..n).map(|i| 1e6 * f64::from(i));
        host.map(|t| (t, 5e6 + t * ppm * 1e-6)).collect()
    }

    #[test]
    fn a_step_is_found_and_drift_pauses_and_single_marks_are_not() {
        for by_us in [-600_000.0, 600_000.0, 30_000.0, 1e10] {
            let mut all = marks(40, 80.0);
            all[20..].iter_mut().for_each(|p| p.1 += by_us);
            let found = step(&all).expect("is found");
            assert!((found.by_us - by_us).abs() < 100.0, "{found:?}");
            assert_eq!(found.between_us, [19e6, 20e6]);
        }
        assert_eq!(step(&marks(40, 900.0)), None);
        let mut pause = marks(40, 900.0);
        pause
            .iter_mut()
            .skip(20)
            .for_each(|p| *p = (p.0 + 6e8, p.1 + 9e2 * 600.0));
        assert_eq!(step(&pause), None);
        let mut wrong = marks(40, 80.0);
        wrong[20].1 += 600_000.0;
        assert_eq!(step(&wrong), None);
        assert_eq!(step(&[]), None);
    }
}
