//! Law: position, depth and speed match the commands.

use std::collections::BTreeSet;

use skinrig_model::{Point2, PressRole, PressVerdict};

use super::finding::finding;
use super::frames::Frame;
use super::observed_press::ObservedPress;
use super::statistics::median;
use crate::input::SessionInput;
use crate::result::{Evidence, Fault, Finding, FittingPlan, Law, OtherPlan};

/// Larger median position errors are not settling errors, mm: a tenth of the paper's tip.
const MAX_OFF_MM: f64 = 1.0;
/// Depths are wrong if off by more than this in the median, mm,
const MAX_DEPTH_OFF_MM: f64 = 0.25;
/// and by more than this share of the depth.
const MAX_DEPTH_SHARE: f64 = 0.15;
/// Indentation at another speed: duration differs from the median at its depth by more than this factor.
const MAX_SPEED_FACTOR: f64 = 2.0;
/// Above this share of wrong presses the robot is at fault.
const MAX_PRESSES: f64 = 0.2;
/// Minimum number of presses for a statement.
const MIN_PRESSES: usize = 4;
/// A path below this share of the skin is in the wrong unit if the centroids contradict it.
const SMALL_PATH: f64 = 0.01;
/// Columns with a larger median scatter do not come from such a small path, px.
const MOVING_PX: f64 = 20.0;
/// Largest shift of the press list to consider.
const MAX_SHIFT: i32 = 5;

pub(super) fn findings(input: &SessionInput, presses_seen: &[ObservedPress<'_>]) -> Vec<Finding> {
    let path: Vec<&ObservedPress<'_>> = presses_seen
        .iter()
        .filter(|t| t.role != PressRole::Sync && t.is_complete())
        .collect();
    let mut found = Vec::new();
    found.extend(unit(input, &path));
    found.extend(position(input, &path));
    found.extend(depth(&path));
    found.extend(speed(&path));
    found.extend(refused(presses_seen));
    found
}

/// Planned and measured positions agree, but their extent does not match a skin.
fn unit(input: &SessionInput, path: &[&ObservedPress<'_>]) -> Option<Finding> {
    let outline = &input.rig.outline;
    let points: Vec<Point2> = path.iter().filter_map(|t| t.truth).collect();
    if points.len() < MIN_PRESSES {
        return None;
    }
    let size_mm = outline.width_mm.max(outline.height_mm);
    let extent = extent_mm(&points);
    let distinct: BTreeSet<(u64, u64)> = points
        .iter()
        .map(|p| (p.x_mm.to_bits(), p.y_mm.to_bits()))
        .collect();
    let small = distinct.len() >= MIN_PRESSES
        && extent < SMALL_PATH * size_mm
        && (0..2).any(|k| moves(path, k));
    let outside = points.iter().filter(|p| !outline.box_contains(**p)).count();
    let large = 2 * outside > points.len() && extent > 2.0 * size_mm;
    (small || large).then(|| {
        let evidence = Evidence::Extent {
            skin_mm: size_mm,
            extent_mm: extent,
            beside: outside,
            presses: points.len(),
        };
        finding(Law::AsCommanded, Fault::UnitOfPositions, None, evidence)
    })
}

fn moves(path: &[&ObservedPress<'_>], camera: usize) -> bool {
    let columns: Vec<f64> = path
        .iter()
        .filter_map(|t| t.sights[camera].column)
        .collect();
    let Some(middle) = median(columns.clone()) else {
        return false;
    };
    let scatter = median(columns.iter().map(|c| (c - middle).abs()).collect());
    columns.len() >= MIN_PRESSES && scatter.is_some_and(|s| s > MOVING_PX)
}

fn extent_mm(points: &[Point2]) -> f64 {
    let range = |of: fn(&Point2) -> f64| {
        let low = points.iter().map(of).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        high - low
    };
    range(|p| p.x_mm).max(range(|p| p.y_mm))
}

/// A reinterpretation of the plan: its fault, what it is, and [`residual_mm`].
type Reading = (Fault, OtherPlan, Option<(f64, f64)>);

/// Compares measured and planned positions; the fault is the reinterpretation of the plan that matches the measurement.
fn position(input: &SessionInput, path: &[&ObservedPress<'_>]) -> Option<Finding> {
    let measured = path.iter().filter(|t| t.truth.is_some()).count();
    if measured < MIN_PRESSES {
        return None;
    }
    let off = residual_mm(path, 0, |p| p)?.0;
    if off <= MAX_OFF_MM {
        return None;
    }
    let mut readings: Vec<Reading> = Frame::all(&input.rig.outline)
        .into_iter()
        .chain(displaced(path))
        .map(|frame| {
            let left = residual_mm(path, 0, |p| frame.skin(p));
            (
                frame.fault,
                OtherPlan::Frame {
                    frame: frame.change,
                },
                left,
            )
        })
        .collect();
    for by in (1..=MAX_SHIFT).flat_map(|k| [k, -k]) {
        let plan = OtherPlan::Shifted { rows: by };
        readings.push((Fault::IndexShifted, plan, residual_mm(path, by, |p| p)));
    }
    // A reinterpretation fits if its residual is small against the planned positions.
    let fits = |(_, _, r): &Reading| {
        r.is_some_and(|(left, extent)| left < MAX_OFF_MM && left < 0.1 * extent)
    };
    let best = readings
        .into_iter()
        .filter(fits)
        .min_by(|a, b| left_of(a.2).total_cmp(&left_of(b.2)));
    let fits = best.map(|(_, plan, left)| FittingPlan {
        off_mm: left_of(left),
        plan,
    });
    let evidence = Evidence::OffPlan {
        limit_mm: MAX_OFF_MM,
        off_mm: off,
        fits,
        presses: measured,
    };
    let fault = best.map_or(Fault::RobotOff, |(fault, ..)| fault);
    Some(finding(Law::AsCommanded, fault, None, evidence))
}

fn left_of(residual: Option<(f64, f64)>) -> f64 {
    residual.map_or(f64::INFINITY, |r| r.0)
}

/// A frame displaced by the median offset between measured and planned positions.
fn displaced(path: &[&ObservedPress<'_>]) -> Option<Frame> {
    let off = |of: fn(&Point2) -> f64| {
        let each = path
            .iter()
            .filter_map(|t| Some(of(&t.planned) - of(&t.truth?)));
        median(each.collect())
    };
    let by = [off(|p| p.x_mm)?, off(|p| p.y_mm)?];
    Some(Frame::displaced(by))
}

/// Median distance of measured positions, in another frame, from the planned ones `by` rows later, and the extent of the
/// latter, mm; `None` without values.
fn residual_mm(
    path: &[&ObservedPress<'_>],
    by: i32,
    frame: impl Fn(Point2) -> Point2,
) -> Option<(f64, f64)> {
    let pairs: Vec<(Point2, Point2)> = path
        .iter()
        .enumerate()
        .filter_map(|(i, touch)| {
            let there = usize::try_from(i as i64 + i64::from(by)).ok()?;
            Some((frame(touch.truth?), path.get(there)?.planned))
        })
        .filter(|(p, _)| super::observed_press::is_number(*p))
        .collect();
    let planned: Vec<Point2> = pairs.iter().map(|p| p.1).collect();
    let left = median(pairs.iter().map(|(a, b)| a.distance_mm(*b)).collect())?;
    (pairs.len() >= MIN_PRESSES).then(|| (left, extent_mm(&planned)))
}

fn depth(path: &[&ObservedPress<'_>]) -> Option<Finding> {
    let pairs: Vec<(f64, f64)> = path
        .iter()
        .filter_map(|t| Some((t.outcome.measured_depth_mm?, t.depth_mm?)))
        .filter(|(measured, planned)| measured.is_finite() && planned.is_finite())
        .collect();
    let off = |(measured, planned): &(f64, f64)| (measured - planned).abs();
    let wrong = pairs
        .iter()
        .filter(|p| off(p) > MAX_DEPTH_OFF_MM.max(MAX_DEPTH_SHARE * p.1.abs()))
        .count();
    let n = pairs.len();
    if n < MIN_PRESSES || wrong as f64 <= MAX_PRESSES * n as f64 {
        return None;
    }
    let usual = median(pairs.iter().map(|(m, p)| m - p).collect())?;
    let evidence = Evidence::OffDepth {
        limit_mm: MAX_DEPTH_OFF_MM,
        wrong,
        presses: n,
        off_mm: usual,
    };
    Some(finding(Law::AsCommanded, Fault::RobotOff, None, evidence))
}

/// The plan does not contain the commanded speed, but equal depths take equal time.
fn speed(path: &[&ObservedPress<'_>]) -> Option<Finding> {
    let lasted = |t: &ObservedPress<'_>| {
        let timing = t.timing.filter(|_| t.depth_mm.is_some())?;
        let s = (timing.at_depth - timing.contact).as_secs_f64();
        (s > 0.0).then_some((t.place.1, s))
    };
    let all: Vec<(u64, f64)> = path.iter().filter_map(|t| lasted(t)).collect();
    let n = all.len();
    if n < MIN_PRESSES {
        return None;
    }
    let usual = |depth: u64| {
        let same = all.iter().filter(|(d, _)| *d == depth).map(|(_, s)| *s);
        median(same.collect())
    };
    let depths: BTreeSet<u64> = all.iter().map(|(d, _)| *d).collect();
    let usual: Vec<(u64, f64)> = depths
        .into_iter()
        .filter_map(|d| Some((d, usual(d)?)))
        .collect();
    let strange = |(depth, s): &&(u64, f64)| {
        let own = usual.iter().find(|(d, _)| d == depth);
        own.is_some_and(|(_, u)| *s > MAX_SPEED_FACTOR * u || *s < u / MAX_SPEED_FACTOR)
    };
    let wrong = all.iter().filter(strange).count();
    (wrong as f64 > MAX_PRESSES * n as f64).then(|| {
        let evidence = Evidence::UnequalTimes {
            wrong,
            presses: n,
            factor: MAX_SPEED_FACTOR,
        };
        finding(Law::AsCommanded, Fault::RobotOff, None, evidence)
    })
}

/// Presses that the journal reports as not executed as planned.
fn refused(presses_seen: &[ObservedPress<'_>]) -> Option<Finding> {
    let reasons = presses_seen
        .iter()
        .filter_map(|t| match &t.outcome.verdict {
            PressVerdict::Invalid(reason) => Some(reason),
            _ => None,
        });
    let (wrong, n) = (reasons.clone().count(), presses_seen.len());
    let first = reasons.clone().next()?;
    (n >= MIN_PRESSES && wrong as f64 > MAX_PRESSES * n as f64).then(|| {
        let evidence = Evidence::JournalInvalid {
            wrong,
            presses: n,
            first: first.clone(),
        };
        finding(Law::AsCommanded, Fault::RobotOff, None, evidence)
    })
}
