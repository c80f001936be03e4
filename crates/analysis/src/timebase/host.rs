//! `host_from_box`: the host's clock over the box's, within bounds that hold for certain.
//!
//! Every exchange says that the box's clock showed a value between two instants of the host. The map is a fit to the quickest
//! exchanges; where it may lie follows from all of them: above the latest `sent` and below the earliest `received`, each moved
//! along the fit by no more than its rate may be wrong. No assumption is made on how a delay divides into its two ways; that both
//! ways take equally long on average is what the map itself stands on, and the bounds hold without it.

use super::edges::{beyond_us, distance_us};
use super::epochs::Tie;
use super::smooth::{Figure, Point, Smooth, WANDER};
use crate::clock::NO_CLOCK_DRIFT;

/// The quickest exchange in each such span of box time makes a point of the fit, µs.
const QUICKEST_OF_US: f64 = 5e6;
/// Points of the fit, at least, where there are as many exchanges.
const POINTS: f64 = 40.0;
/// What the rate of the fit may be wrong by is bounded in each such span, µs.
const WINDOW_US: f64 = 60e6;
/// Parts of such a span, of each of which the tightest bounds count.
const PARTS: usize = 40;
/// Within a window the rates wander by no more than this about the fit: a crystal that wanders by 6 ppm per hour, 0.05 ppm in half
/// a minute.
const SHAPE: f64 = 0.05e-6;
/// Residuals of delays are never judged finer than this, µs.
const FLOOR_US: f64 = 20.0;
/// Steps of the fit, and of the map along it, are at least this long, µs.
const STEP_US: f64 = super::STEP_US;

/// The map, by knots: between them it is straight.
#[derive(Debug, Clone, PartialEq)]
pub struct HostFromBox {
    /// (box time, host time), µs, ascending.
    pub knots: Vec<(f64, f64)>,
    /// The fit behind it.
    pub fit: Smooth,
    /// Box times of the exchanges, ascending, µs.
    pub ties_us: Vec<f64>,
    /// False when exchanges contradict each other: the clock jumped, or an exchange is wrong.
    pub consistent: bool,
    bounds: Bounds,
}

impl HostFromBox {
    /// From exchanges in order of box time; `None` below 3 or without spread in time.
    pub fn new(ties: &[Tie]) -> Option<Self> {
        let fit = Smooth::fit(&quickest(ties), STEP_US, FLOOR_US)?;
        let (first, last) = (ties.first()?.box_us, ties.last()?.box_us);
        let (bounds, consistent) = Bounds::new(ties, &fit);
        let steps = ((last - first) / STEP_US).ceil().max(1.0) as usize;
        let knots = (0..=steps)
            .map(|k| {
                let at = first + (last - first) * k as f64 / steps as f64;
                let (low, high) = bounds.at(at);
                // What is certain goes before what is likely.
                let by = 0.0f64.max(low).min(high.max(low));
                (at, fit.value(at) + by)
            })
            .collect();
        Some(Self {
            knots,
            fit,
            ties_us: ties.iter().map(|t| t.box_us).collect(),
            consistent,
            bounds,
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

    /// Host time of a box time, with its statistical error: that of the delays, both ways taking equally long on average.
    pub fn at(&self, box_us: f64) -> Figure {
        Figure {
            value: self.host_us(box_us),
            se: self.fit.standard_error(box_us),
            free: self.fit.free,
        }
    }

    /// Half width of the interval about [`Self::host_us`] that certainly holds the host time of a box time, µs.
    pub fn bound_us(&self, box_us: f64) -> f64 {
        let (low, high) = self.bounds.at(box_us);
        let by = self.host_us(box_us) - self.fit.value(box_us);
        // Beyond the exchanges nothing bounds the rate but what a crystal does.
        (by - low).abs().max((high - by).abs()) + WANDER * beyond_us(&self.ties_us, box_us)
    }

    /// From a box time to that of the nearest exchange, µs.
    pub fn tie_distance_us(&self, box_us: f64) -> f64 {
        distance_us(&self.ties_us, box_us)
    }
}

/// A straight line between the two knots about `x`, or through the two outermost.
fn interpolate(
    knots: &[(f64, f64)],
    from: impl Fn(&(f64, f64)) -> f64,
    to: impl Fn(&(f64, f64)) -> f64,
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
    let each_us = QUICKEST_OF_US.min(span / POINTS);
    let slot = |t: &Tie| (t.box_us / each_us.max(1.0)).floor();
    ties.chunk_by(|a, b| slot(a) == slot(b))
        .filter_map(|part| part.iter().min_by(|a, b| delay(a).total_cmp(&delay(b))))
        .map(|t| Point {
            from_us: t.box_us + 0.5,
            to_us: 0.5 * (t.sent_us + t.received_us),
        })
        .collect()
}

/// What one exchange says of how far the host's clock is from the fit, µs.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bound {
    box_us: f64,
    low: f64,
    high: f64,
}

/// What all exchanges say together: they hold away from themselves too, less what the rate may be wrong by on the way.
#[derive(Debug, Clone, PartialEq)]
struct Bounds {
    /// At each exchange, by those up to it, and by those from it on.
    before: Vec<Bound>,
    after: Vec<Bound>,
    /// What the rate of the fit may be wrong by.
    rate: f64,
}

impl Bounds {
    /// Also whether the exchanges agree.
    fn new(ties: &[Tie], fit: &Smooth) -> (Self, bool) {
        // The box's clock shows whole µs: what it showed lasts one.
        let each: Vec<Bound> = ties
            .iter()
            .map(|t| Bound {
                box_us: t.box_us,
                low: t.sent_us - fit.value(t.box_us + 1.0),
                high: t.received_us - fit.value(t.box_us),
            })
            .collect();
        let rate = rate(&each);
        let slack = rate.unwrap_or(SHAPE);
        let swept = |bounds: &mut dyn Iterator<Item = Bound>| -> Vec<Bound> {
            let mut last: Option<Bound> = None;
            let next = |b: Bound| {
                let now = last.map_or(b, |l| {
                    let by = slack * (b.box_us - l.box_us).abs();
                    Bound {
                        low: b.low.max(l.low - by),
                        high: b.high.min(l.high + by),
                        ..b
                    }
                });
                last = Some(now);
                now
            };
            bounds.map(next).collect()
        };
        let before = swept(&mut each.iter().copied());
        let mut after = swept(&mut each.iter().rev().copied());
        after.reverse();
        let mut both = before.iter().zip(&after);
        let agree = both.all(|(a, b)| a.low.max(b.low) <= a.high.min(b.high));
        let bounds = Self {
            before,
            after,
            rate: slack,
        };
        (bounds, agree && rate.is_some())
    }

    /// At a box time: (low, high).
    fn at(&self, box_us: f64) -> (f64, f64) {
        let k = self.before.partition_point(|b| b.box_us <= box_us);
        let near = [
            k.checked_sub(1).map(|k| self.before[k]),
            self.after.get(k).copied(),
        ];
        let all = (f64::NEG_INFINITY, f64::INFINITY);
        near.into_iter().flatten().fold(all, |(low, high), b| {
            let by = self.rate * (b.box_us - box_us).abs();
            (low.max(b.low - by), high.min(b.high + by))
        })
    }
}

/// What the rate of the fit may be wrong by: the steepest line that passes between all bounds of any window; `None` when there is
/// none in some window.
fn rate(bounds: &[Bound]) -> Option<f64> {
    let (first, last) = (bounds.first()?.box_us, bounds.last()?.box_us);
    let windows = ((last - first) / WINDOW_US).floor().max(1.0);
    let part_us = ((last - first) / windows / PARTS as f64).max(1.0);
    let part = |b: &Bound| ((b.box_us - first) / part_us).floor();
    // Of each part the tightest bounds, where they are.
    let tightest: Vec<(Bound, Bound)> = bounds
        .chunk_by(|a, b| part(a) == part(b))
        .filter_map(|of| {
            let low = of.iter().max_by(|a, b| a.low.total_cmp(&b.low))?;
            let high = of.iter().min_by(|a, b| a.high.total_cmp(&b.high))?;
            Some((*low, *high))
        })
        .collect();
    let mut most: f64 = 0.0;
    for window in tightest.chunks(PARTS) {
        let (mut least, mut largest) = (f64::NEG_INFINITY, f64::INFINITY);
        for (k, (low_a, high_a)) in window.iter().enumerate() {
            for (low_b, high_b) in &window[k + 1..] {
                least =
                    least.max((low_b.low - high_a.high) / (low_b.box_us - high_a.box_us).max(1.0));
                largest = largest
                    .min((high_b.high - low_a.low) / (high_b.box_us - low_a.box_us).max(1.0));
            }
        }
        if least > largest {
            return None;
        }
        // A last window may be too short to say anything.
        let steepest = largest.abs().max(least.abs());
        most = most.max(if steepest.is_finite() { steepest } else { 0.0 });
    }
    Some(most.min(NO_CLOCK_DRIFT) + SHAPE)
}
