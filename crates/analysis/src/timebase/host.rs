//! `host_from_box`: the host's clock over the box's, within bounds that hold for certain.
//!
//! Every exchange says that the box's clock showed a value between two instants of the host. The shape of the map, how the
//! two rates differ and wander, comes from a fit to the quickest exchanges; its place from all of them: it lies between the
//! latest `sent` and the earliest `received`, each measured from the fit. No assumption is made on how a delay divides into
//! its two ways.

use super::edges::{beyond_us, distance_us};
use super::epochs::Tie;
use super::piecewise::{Piecewise, Point, WANDER};

/// The quickest exchange in each such span of box time makes a point of the fit, µs.
const QUICKEST_OF_US: f64 = 5e6;
/// Exchanges within this of an instant bound the map there, µs.
const NEAR_US: f64 = 30e6;
/// The fit follows the rates within [`NEAR_US`] to this: a crystal that wanders by 6 ppm per hour, 0.05 ppm in half a minute.
const SHAPE: f64 = 0.05e-6;
/// Residuals of delays are never judged finer than this, µs.
const FLOOR_US: f64 = 20.0;
/// Knots are at least this far apart, µs.
const SPACING_US: f64 = 60e6;

/// The map, by knots: between them it is straight.
#[derive(Debug, Clone, PartialEq)]
pub struct HostFromBox {
    /// (box time, host time, half width of the interval that certainly holds it), µs, ascending.
    pub knots: Vec<(f64, f64, f64)>,
    /// The fit behind it.
    pub fit: Piecewise,
    /// Box times of the exchanges, ascending, µs.
    pub ties_us: Vec<f64>,
    /// False when exchanges contradict each other: the clock jumped, or an exchange is wrong.
    pub consistent: bool,
}

impl HostFromBox {
    /// From exchanges in order of box time; `None` below 3 or without spread in time.
    pub fn new(ties: &[Tie]) -> Option<Self> {
        let fit = Piecewise::fit(&quickest(ties), SPACING_US, FLOOR_US)?;
        let (first, last) = (ties.first()?.box_us, ties.last()?.box_us);
        let steps = ((last - first) / NEAR_US).ceil().max(1.0) as usize;
        let mut consistent = true;
        let knots = (0..=steps)
            .map(|k| {
                let at = first + (last - first) * k as f64 / steps as f64;
                let (low, high) = bounds(ties, &fit, at);
                consistent &= low <= high;
                let half = 0.5 * (high - low).abs() + SHAPE * NEAR_US;
                (at, fit.value(at) + 0.5 * (low + high), half)
            })
            .collect();
        Some(Self {
            knots,
            fit,
            ties_us: ties.iter().map(|t| t.box_us).collect(),
            consistent,
        })
    }

    /// Host time of a box time, µs.
    pub fn host_us(&self, box_us: f64) -> f64 {
        interpolate(&self.knots, |k| k.0, |k| k.1, box_us)
    }

    /// Box time of a host time, µs.
    pub fn box_us(&self, host_us: f64) -> f64 {
        interpolate(&self.knots, |k| k.1, |k| k.0, host_us)
    }

    /// Half width of the interval that certainly holds the host time of a box time, µs.
    pub fn half_width_us(&self, box_us: f64) -> f64 {
        let k = self.knots.partition_point(|knot| knot.0 <= box_us);
        let near = self.knots[k.saturating_sub(1)..].iter().take(2);
        let half = near.fold(0.0f64, |m, knot| m.max(knot.2));
        // Beyond the exchanges nothing bounds the rate but the fit's own error and what a crystal does.
        half + beyond_us(&self.ties_us, box_us) * (WANDER + 2.0 * self.fit.drift_se)
    }

    /// From a box time to that of the nearest exchange, µs.
    pub fn tie_distance_us(&self, box_us: f64) -> f64 {
        distance_us(&self.ties_us, box_us)
    }
}

type Knot = (f64, f64, f64);

/// A straight line between the two knots about `x`, or through the two outermost.
fn interpolate(
    knots: &[Knot],
    from: impl Fn(&Knot) -> f64,
    to: impl Fn(&Knot) -> f64,
    x: f64,
) -> f64 {
    let k = knots[1..knots.len() - 1].partition_point(|knot| from(knot) <= x);
    let (a, b) = (&knots[k], &knots[k + 1]);
    to(a) + (x - from(a)) * ((to(b) - to(a)) / (from(b) - from(a)))
}

/// The middle of the quickest exchange in each span.
fn quickest(ties: &[Tie]) -> Vec<Point> {
    let delay = |t: &Tie| t.received_us - t.sent_us;
    // Few exchanges: all of them.
    let span = ties.last().map_or(0.0, |t| t.box_us) - ties.first().map_or(0.0, |t| t.box_us);
    let each_us = QUICKEST_OF_US.min(span / 12.0);
    let slot = |t: &Tie| (t.box_us / each_us.max(1.0)).floor();
    ties.chunk_by(|a, b| slot(a) == slot(b))
        .filter_map(|part| part.iter().min_by(|a, b| delay(a).total_cmp(&delay(b))))
        .map(|t| Point {
            from_us: t.box_us + 0.5,
            to_us: 0.5 * (t.sent_us + t.received_us),
        })
        .collect()
}

/// Latest `sent` and earliest `received` about `at`, measured from the fit. The box's clock shows whole µs: what it showed
/// lasts one.
fn bounds(ties: &[Tie], fit: &Piecewise, at: f64) -> (f64, f64) {
    let from = ties.partition_point(|t| t.box_us < at - NEAR_US);
    let to = ties.partition_point(|t| t.box_us <= at + NEAR_US);
    // Nobody asked for a while: the nearest on both sides.
    let near = if from < to {
        &ties[from..to]
    } else {
        &ties[from.saturating_sub(1)..(to + 1).min(ties.len())]
    };
    near.iter()
        .fold((f64::NEG_INFINITY, f64::INFINITY), |(low, high), t| {
            (
                low.max(t.sent_us - fit.value(t.box_us + 1.0)),
                high.min(t.received_us - fit.value(t.box_us)),
            )
        })
}
