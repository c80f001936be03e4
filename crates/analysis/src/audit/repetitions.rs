//! Law: presses at one place agree: repetitions of a location, and presses at the same position.

use std::collections::BTreeMap;

use skinrig_model::{CameraId, LocationId, PressRole, RepetitionId};

use super::finding::finding;
use super::observed_press::ObservedPress;
use super::statistics::median;
use crate::result::{Evidence, Fault, Finding, Law};

/// Smaller median differences between repetitions are ignored, px: the radius of a cluster.
const MIN_MOVE_PX: f64 = 10.0;
/// A move matters from here on, px, if it is also this many times the scatter between repetitions: it then decides the error.
const SMALL_MOVE_PX: f64 = 4.0;
const SCATTERS: f64 = 3.0;
/// A move is certain above this many standard errors of the median.
const SIGMAS: f64 = 5.0;
/// Minimum number of press pairs for a statement.
const MIN_PAIRS: usize = 6;
/// Repetitions disagree if a location differs from itself by more than this share of the differences between locations.
const MAX_SHARE: f64 = 0.5;
/// Standard error of a median divided by the median absolute deviation and the root of n: 1.4826 sqrt(pi / 2).
const MEDIAN_ERROR: f64 = 1.858;

pub(super) fn findings(presses_seen: &[ObservedPress<'_>]) -> Vec<Finding> {
    CameraId::ALL
        .into_iter()
        .filter_map(|camera| {
            disagreement(presses_seen, camera).or_else(|| same_position(presses_seen, camera))
        })
        .collect()
}

/// Presses of one depth that share a position within a repetition, as rows of a list of which a coordinate is lost do: what one camera
/// sees of them.
fn same_position(presses_seen: &[ObservedPress<'_>], camera: CameraId) -> Option<Finding> {
    let mut groups: BTreeMap<(RepetitionId, [u64; 3]), Vec<f64>> = BTreeMap::new();
    for touch in presses_seen.iter().filter(|t| t.role != PressRole::Sync) {
        let (at, depth) = (touch.at(), touch.place.1);
        let key = [at.x_mm.to_bits(), at.y_mm.to_bits(), depth];
        let group = groups.entry((touch.repetition, key)).or_default();
        group.extend(touch.sights[camera.index()].column);
    }
    let distances = |columns: &[f64]| {
        let middle = median(columns.to_vec());
        let each = columns.iter().map(|c| Some((c - middle?).abs()));
        each.collect::<Option<Vec<f64>>>()
    };
    let shared = groups.values().filter(|group| group.len() > 1);
    let off: Vec<f64> = shared
        .filter_map(|group| distances(group))
        .flatten()
        .collect();
    let all: Vec<f64> = groups.values().flatten().copied().collect();
    let all_off = distances(&all)?;
    let (pairs, off_px, all_px) = (off.len(), median(off)?, median(all_off)?);
    if pairs < MIN_PAIRS || off_px <= MIN_MOVE_PX || off_px <= MAX_SHARE * all_px {
        return None;
    }
    let evidence = Evidence::SamePosition {
        off_px,
        all_px,
        camera,
        presses: pairs,
    };
    let mut found = finding(
        Law::RepetitionsAgree,
        Fault::Unknown,
        Some(camera),
        evidence,
    );
    // Their positions are not where they were.
    found.invalidates = true;
    Some(found)
}

fn disagreement(presses_seen: &[ObservedPress<'_>], camera: CameraId) -> Option<Finding> {
    let mut first: BTreeMap<(LocationId, u64), (RepetitionId, f64)> = BTreeMap::new();
    let mut moves: BTreeMap<RepetitionId, Vec<(f64, f64)>> = BTreeMap::new();
    for touch in presses_seen.iter().filter(|t| t.role != PressRole::Sync) {
        let Some(column) = touch.sights[camera.index()].column else {
            continue;
        };
        let (repetition, before) = *first
            .entry(touch.place)
            .or_insert((touch.repetition, column));
        if touch.repetition != repetition {
            moves
                .entry(touch.repetition)
                .or_default()
                .push((before, column - before));
        }
    }
    let columns: Vec<f64> = first.values().map(|(_, column)| *column).collect();
    let middle = median(columns.clone())?;
    let between = median(columns.iter().map(|c| (c - middle).abs()).collect())?;
    for (repetition, pairs) in &moves {
        let moves: Vec<f64> = pairs.iter().map(|pair| pair.1).collect();
        let n = moves.len();
        if n < MIN_PAIRS {
            continue;
        }
        let moved = median(moves.clone())?;
        let scatter = median(moves.iter().map(|m| (m - moved).abs()).collect())?;
        let error = MEDIAN_ERROR * scatter / (n as f64).sqrt();
        let shifts = matters(moved, scatter) && moved.abs() > SIGMAS * error;
        let shift = shifts.then_some((moved, error, None));
        if let Some((moved_px, error_px, zoom_percent)) = shift.or_else(|| zoom(pairs)) {
            let evidence = Evidence::RepetitionMoved {
                repetition: *repetition,
                moved_px,
                error_px,
                zoom_percent,
                camera,
                pairs: n,
            };
            return Some(finding(
                Law::RepetitionsAgree,
                Fault::RigMoved,
                Some(camera),
                evidence,
            ));
        }
        let within = median(moves.iter().map(|m| m.abs()).collect())?;
        if within > MIN_MOVE_PX && within > MAX_SHARE * between {
            let evidence = Evidence::RepetitionElsewhere {
                repetition: *repetition,
                off_px: within,
                between_px: between,
                camera,
                pairs: n,
            };
            let mut found = finding(
                Law::RepetitionsAgree,
                Fault::Unknown,
                Some(camera),
                evidence,
            );
            // The rows of a repetition belong to other presses than assumed.
            found.invalidates = true;
            return Some(found);
        }
    }
    None
}

/// True if columns that move so far, with this scatter (median absolute deviation), decide the error.
fn matters(moved_px: f64, scatter_px: f64) -> bool {
    let moved = moved_px.abs();
    moved > MIN_MOVE_PX || (moved > SMALL_MOVE_PX && moved > SCATTERS * scatter_px)
}

/// Moves that grow with the column, as those of a lens that was turned or of a camera that was moved along its axis: the largest move of a
/// pressed column, its standard error, px, and the growth of distances, %. By the medians of both halves; `None` unless certain.
fn zoom(pairs: &[(f64, f64)]) -> Option<(f64, f64, Option<f64>)> {
    let mut sorted = pairs.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (left, right) = sorted.split_at(sorted.len() / 2);
    if left.len() < MIN_PAIRS {
        return None;
    }
    let middle = |half: &[(f64, f64)]| {
        let of = |i: fn(&(f64, f64)) -> f64| median(half.iter().map(i).collect());
        Some((of(|pair| pair.0)?, of(|pair| pair.1)?))
    };
    let ((left_u, left_move), (right_u, right_move)) = (middle(left)?, middle(right)?);
    let slope = (right_move - left_move) / (right_u - left_u);
    let fitted = |u: f64| left_move + slope * (u - left_u);
    let off = sorted.iter().map(|(u, moved)| (moved - fitted(*u)).abs());
    let scatter = median(off.collect())?;
    let of_half = MEDIAN_ERROR * scatter / (left.len() as f64).sqrt();
    let error = std::f64::consts::SQRT_2 * of_half;
    let [first, last] = [sorted.first()?.0, sorted.last()?.0].map(fitted);
    let moved = if first.abs() > last.abs() {
        first
    } else {
        last
    };
    let certain = (right_move - left_move).abs() > SIGMAS * error;
    (certain && matters(moved, scatter)).then_some((moved, error, Some(100.0 * slope)))
}
