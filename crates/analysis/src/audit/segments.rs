//! Detects a press list of which a part is shifted: an extra or missing press in the middle, made up for later or never.

use skinrig_model::Point2;

use super::local::{LocalResiduals, Neighbours};
use super::readings::{MAX_SHIFT, Path, ScoredReading};
use super::resection::residual_deg;

/// Maximum evidence of one press for a shift in one camera, nats: it may be poorly visible.
const MAX_PRESS: f64 = 4.0;
/// Cost of a change of the shift, nats.
const CHANGE: f64 = 12.0;
/// Minimum number of presses in the shifted part,
const MIN_PRESSES: usize = 8;
/// its minimum share of all presses,
const MIN_SHARE: f64 = 0.15;
/// and its minimum gain in total and per press, nats.
const MIN_GAIN: f64 = 25.0;
const MIN_GAIN_PER_PRESS: f64 = 0.3;

/// A part that ends before the session does runs over lines of several directions: the mean of its displacements is at most this
/// share of their mean length. The errors of a skin itself displace neighbours alike.
const MAX_ALIKE: f64 = 0.5;

/// The shifted part of a session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShiftedSegment {
    /// Index of its first press in the path, from 0.
    pub from: usize,
    /// Index after its last press.
    pub to: usize,
    /// Shift of the position in rows.
    pub by: i32,
    /// Log likelihood gain, nats.
    pub gain: f64,
}

/// Looks for a shift that begins within the session and lasts to its end, or in both streams over a part of it, in the streams of
/// `cameras`, with the cameras of `as_is`.
pub(crate) fn shifted_segment(
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    cameras: &[usize],
) -> Option<ShiftedSegment> {
    let whole = |i: usize, by: i32| -> f64 {
        let one = |k: &usize| {
            let reading = path.presses_seen[i].sights[*k].column.zip(as_is.fits[*k]);
            match (reading, path.shifted(i, by)) {
                (Some((column, fit)), Some(at)) => {
                    evidence(residual_deg(&fit.camera, column, at) / fit.spread_deg)
                }
                // Beyond the list: maximum evidence against; not visible: no evidence.
                (Some(_), None) => MAX_PRESS,
                (None, _) => 0.0,
            }
        };
        cameras.iter().map(one).sum()
    };
    best_segment(path, cameras, whole)
}

/// As [`shifted_segment`], by residuals against those of the neighbours: the errors of a real skin may be larger than a step of the path.
pub(crate) fn locally_shifted_segment(
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    cameras: &[usize],
) -> Option<ShiftedSegment> {
    let neighbours = Neighbours::new(path)?;
    let shifts: Vec<i32> = (-MAX_SHIFT..=MAX_SHIFT).collect();
    let residuals: Vec<LocalResiduals> = cameras
        .iter()
        .map(|k| LocalResiduals::new(path, as_is, &neighbours, *k, &shifts))
        .collect::<Option<_>>()?;
    best_segment(path, cameras, |i, by| {
        let index = (by + MAX_SHIFT) as usize;
        let one = |of: &LocalResiduals| {
            let none = of.sigmas(i, MAX_SHIFT as usize);
            match (none, of.sigmas(i, index)) {
                (Some(_), Some(off)) => evidence(off),
                (Some(_), None) => MAX_PRESS,
                // Without neighbours in view: no evidence.
                (None, _) => 0.0,
            }
        };
        residuals.iter().map(one).sum()
    })
}

/// Evidence against a shift of one press in one camera, nats.
fn evidence(sigmas: f64) -> f64 {
    (0.5 * sigmas * sigmas).min(MAX_PRESS)
}

/// The likeliest shifted part by the loss of each press with each shift in these cameras, nats.
fn best_segment(
    path: &Path<'_>,
    cameras: &[usize],
    loss: impl Fn(usize, i32) -> f64,
) -> Option<ShiftedSegment> {
    let n = path.presses_seen.len();
    let shifts: Vec<i32> = (-MAX_SHIFT..=MAX_SHIFT).collect();
    // Backwards: for each shift, its gain against none from each press onwards, and the best end of it.
    let may_end = cameras.len() == 2;
    let mut gains = vec![(0.0, n); shifts.len()];
    let mut best: Option<ShiftedSegment> = None;
    for from in (0..n).rev() {
        let none = loss(from, 0);
        for ((gain, to), by) in gains.iter_mut().zip(&shifts) {
            if may_end && *gain < -CHANGE {
                (*gain, *to) = (-CHANGE, from + 1);
            }
            *gain += none - loss(from, *by);
            let rest = *to - from;
            let enough = rest >= MIN_PRESSES
                && rest as f64 >= MIN_SHARE * n as f64
                && *gain - CHANGE > MIN_GAIN
                && *gain > MIN_GAIN_PER_PRESS * rest as f64;
            let is_best = best.is_none_or(|b| *gain - CHANGE > b.gain);
            if *by != 0 && enough && is_best && (*to == n || turns(path, from..*to, *by)) {
                best = Some(ShiftedSegment {
                    from,
                    to: *to,
                    by: *by,
                    gain: *gain - CHANGE,
                });
            }
        }
    }
    best
}

/// True if the displacements by such a shift point in several directions.
fn turns(path: &Path<'_>, part: std::ops::Range<usize>, by: i32) -> bool {
    let moves = part.filter_map(|i| {
        let (own, there): (Point2, Point2) = (path.presses_seen[i].at(), path.shifted(i, by)?);
        Some((there.x_mm - own.x_mm, there.y_mm - own.y_mm))
    });
    let (mut x, mut y, mut length) = (0.0, 0.0, 0.0);
    for (dx, dy) in moves {
        (x, y, length) = (x + dx, y + dy, length + libm::hypot(dx, dy));
    }
    libm::hypot(x, y) < MAX_ALIKE * length
}
