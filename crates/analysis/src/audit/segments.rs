//! A press list that is right at first and shifted later: a press too many or too few in the middle.

use super::readings::{Judged, MOST_SHIFT, Path};
use super::resection::residual_deg;

/// Most that one press says for a shift in one camera, nats: it may have been badly seen.
const MOST_PRESS: f64 = 4.0;
/// What a change of the shift costs, nats.
const CHANGE: f64 = 12.0;
/// The shifted rest has at least this many presses,
const LEAST_PRESSES: usize = 8;
/// this share of all,
const LEAST_SHARE: f64 = 0.15;
/// and is this much likelier in all and per press, nats.
const LEAST_GAIN: f64 = 25.0;
const LEAST_GAIN_PER_PRESS: f64 = 0.3;

/// The rest of a session, from a press on, that is shifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShiftedRest {
    /// The first press of the path that is, counted from 0.
    pub from: usize,
    /// How many rows on the position of each of its presses stands.
    pub by: i32,
    /// Nats by which it is likelier.
    pub gain: f64,
}

/// Looks for a shift that begins within the session and stays to its end, in the streams of `cameras`, with the cameras of
/// `as_is`.
pub(crate) fn shifted_rest(
    path: &Path<'_>,
    as_is: &Judged<'_>,
    cameras: &[usize],
) -> Option<ShiftedRest> {
    let n = path.touches.len();
    let shifts: Vec<i32> = (-MOST_SHIFT..=MOST_SHIFT).collect();
    let loss = |i: usize, by: i32| -> f64 {
        cameras
            .iter()
            .map(|k| {
                let seen = path.touches[i].sights[*k].column.zip(as_is.fits[*k]);
                match (seen, path.shifted(i, by)) {
                    (Some((column, fit)), Some(at)) => {
                        let off = residual_deg(&fit.camera, column, at) / fit.spread_deg;
                        (0.5 * off * off).min(MOST_PRESS)
                    }
                    // Beyond the list: as bad as it gets; unseen: nothing.
                    (Some(_), None) => MOST_PRESS,
                    (None, _) => 0.0,
                }
            })
            .sum()
    };
    // From the end: the best shift of all presses from each one on, against no shift.
    let mut gains = vec![0.0; shifts.len()];
    let mut best: Option<ShiftedRest> = None;
    for from in (0..n).rev() {
        let none = loss(from, 0);
        for (gain, by) in gains.iter_mut().zip(&shifts) {
            *gain += none - loss(from, *by);
            let rest = n - from;
            let enough = rest >= LEAST_PRESSES
                && rest as f64 >= LEAST_SHARE * n as f64
                && *gain - CHANGE > LEAST_GAIN
                && *gain > LEAST_GAIN_PER_PRESS * rest as f64;
            if *by != 0 && enough && best.is_none_or(|b| *gain - CHANGE > b.gain) {
                best = Some(ShiftedRest {
                    from,
                    by: *by,
                    gain: *gain - CHANGE,
                });
            }
        }
    }
    best
}
