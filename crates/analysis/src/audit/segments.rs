//! Detects a press list that is correct at first and shifted later: an extra or missing press in the middle.

use super::readings::{MAX_SHIFT, Path, ScoredReading};
use super::resection::residual_deg;

/// Maximum evidence of one press for a shift in one camera, nats: it may be poorly visible.
const MAX_PRESS: f64 = 4.0;
/// Cost of a change of the shift, nats.
const CHANGE: f64 = 12.0;
/// Minimum number of presses in the shifted rest,
const MIN_PRESSES: usize = 8;
/// its minimum share of all presses,
const MIN_SHARE: f64 = 0.15;
/// and its minimum gain in total and per press, nats.
const MIN_GAIN: f64 = 25.0;
const MIN_GAIN_PER_PRESS: f64 = 0.3;

/// The shifted rest of a session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShiftedSegment {
    /// Index of its first press in the path, from 0.
    pub from: usize,
    /// Shift of the position in rows.
    pub by: i32,
    /// Log likelihood gain, nats.
    pub gain: f64,
}

/// Looks for a shift that begins within the session and lasts to its end, in the streams of `cameras`, with the cameras of
/// `as_is`.
pub(crate) fn shifted_rest(
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    cameras: &[usize],
) -> Option<ShiftedSegment> {
    let n = path.presses_seen.len();
    let shifts: Vec<i32> = (-MAX_SHIFT..=MAX_SHIFT).collect();
    let loss = |i: usize, by: i32| -> f64 {
        cameras
            .iter()
            .map(|k| {
                let reading = path.presses_seen[i].sights[*k].column.zip(as_is.fits[*k]);
                match (reading, path.shifted(i, by)) {
                    (Some((column, fit)), Some(at)) => {
                        let off = residual_deg(&fit.camera, column, at) / fit.spread_deg;
                        (0.5 * off * off).min(MAX_PRESS)
                    }
                    // Beyond the list: maximum evidence against; not visible: no evidence.
                    (Some(_), None) => MAX_PRESS,
                    (None, _) => 0.0,
                }
            })
            .sum()
    };
    // Backwards: the best shift of all presses from each one onwards, against no shift.
    let mut gains = vec![0.0; shifts.len()];
    let mut best: Option<ShiftedSegment> = None;
    for from in (0..n).rev() {
        let none = loss(from, 0);
        for (gain, by) in gains.iter_mut().zip(&shifts) {
            *gain += none - loss(from, *by);
            let rest = n - from;
            let enough = rest >= MIN_PRESSES
                && rest as f64 >= MIN_SHARE * n as f64
                && *gain - CHANGE > MIN_GAIN
                && *gain > MIN_GAIN_PER_PRESS * rest as f64;
            if *by != 0 && enough && best.is_none_or(|b| *gain - CHANGE > b.gain) {
                best = Some(ShiftedSegment {
                    from,
                    by: *by,
                    gain: *gain - CHANGE,
                });
            }
        }
    }
    best
}
