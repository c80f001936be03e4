//! `host_from_box`: the host's clock over the box's, within bounds that hold for certain.
//!
//! Every exchange says that the box's clock showed a value between two instants of the host. The map is a fit to the quickest
//! exchanges; where it may lie follows from all of them: above the latest `sent` and below the earliest `received`, each moved
//! along the fit by no more than its rate may be wrong. No assumption is made on how a delay divides into its two ways; that both
//! ways take equally long on average is what the map itself stands on, and the bounds hold without it.

use super::edges::{beyond_us, distance_us};
use super::epochs::Tie;
use super::smooth::{Figure, Point, STEP_US, Smooth, WANDER};
use crate::clock::NO_CLOCK_DRIFT;
use crate::clock::line::median;

/// The quickest exchange in each such span of box time makes a point of the fit, µs.
const QUICKEST_OF_US: f64 = 5e6;
/// Exchanges about one that say how busy the line is: the 50 quickest of them give their scatter to 7 %, by chance.
const NEAR: usize = 150;
/// The box's clock shows whole µs.
const TICK_US: f64 = 1.0;
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
/// Rounds of a search that each leave a hundredth at most: no clock is off by more.
const ROUNDS: usize = 9;

/// The map.
#[derive(Debug, Clone, PartialEq)]
pub struct HostFromBox {
    /// Box times between which the map is nearly straight, ascending, µs.
    pub knots_us: Vec<f64>,
    /// The fit behind it, which is moved into the bounds where it leaves them.
    pub fit: Smooth,
    /// Box times of the exchanges, ascending, µs.
    pub ties_us: Vec<f64>,
    /// False when exchanges contradict each other: the clock jumped, or an exchange is wrong.
    pub consistent: bool,
    points: Vec<Point>,
    bounds: Bounds,
}

impl HostFromBox {
    /// From exchanges in order of box time; `None` below 3 or without spread in time.
    pub fn new(ties: &[Tie]) -> Option<Self> {
        let points = quickest(ties);
        let fit = Smooth::fit(&points, STEP_US, FLOOR_US)?;
        let (first, last) = (ties.first()?.box_us, ties.last()?.box_us);
        let (bounds, consistent) = Bounds::new(ties, &fit);
        let steps = ((last - first) / STEP_US).ceil().max(1.0) as usize;
        let knots = 0..=steps;
        Some(Self {
            knots_us: knots
                .map(|k| first + (last - first) * k as f64 / steps as f64)
                .collect(),
            fit,
            points,
            ties_us: ties.iter().map(|t| t.box_us).collect(),
            consistent,
            bounds,
        })
    }

    /// Host time of a box time, µs.
    pub fn host_us(&self, box_us: f64) -> f64 {
        self.fit.value(box_us) + self.moved_us(box_us)
    }

    /// How far the map is moved into the bounds, µs: what is certain goes before what is likely.
    fn moved_us(&self, box_us: f64) -> f64 {
        let (low, high) = self.bounds.at(box_us);
        0.0f64.max(low).min(high.max(low))
    }

    /// Box time of a host time, µs. Both clocks go nearly at one rate, and so does what is left of the way at each round.
    pub fn box_us(&self, host_us: f64) -> f64 {
        let mut box_us = host_us - self.host_us(0.0);
        for _ in 0..ROUNDS {
            box_us += host_us - self.host_us(box_us);
        }
        box_us
    }

    /// Host time of a box time, with its statistical error: that of the delays, both ways taking equally long on average.
    pub fn at(&self, box_us: f64) -> Figure {
        Figure {
            value: self.host_us(box_us),
            se: self.fit.standard_error(box_us),
            free: self.fit.free,
        }
    }

    /// Mean rate of host over box time, less 1, between two box times, µs, with its statistical error.
    pub fn drift(&self, between_us: (f64, f64)) -> Option<Figure> {
        let fit = Smooth::fit_with_drift(&self.points, STEP_US, FLOOR_US, Some(between_us))?;
        Some(fit.drift)
    }

    /// Half width of the interval about [`Self::host_us`] that certainly holds the host time of a box time, µs.
    pub fn bound_us(&self, box_us: f64) -> f64 {
        let (low, high) = self.bounds.at(box_us);
        let by = self.moved_us(box_us);
        // Beyond the exchanges nothing bounds the rate but what a crystal does.
        (by - low).abs().max((high - by).abs()) + WANDER * beyond_us(&self.ties_us, box_us)
    }

    /// From a box time to that of the nearest exchange, µs.
    pub fn tie_distance_us(&self, box_us: f64) -> f64 {
        distance_us(&self.ties_us, box_us)
    }
}

/// The middle of the quickest of each so many exchanges.
///
/// As many in each, so that all are as good: the quickest of few is slow, and a last point that is, has the greatest say in the rate.
fn quickest(ties: &[Tie]) -> Vec<Point> {
    let delays: Vec<f64> = ties.iter().map(|t| t.received_us - t.sent_us).collect();
    let span = ties.last().map_or(0.0, |t| t.box_us) - ties.first().map_or(0.0, |t| t.box_us);
    let points = ((span / QUICKEST_OF_US).max(POINTS) as usize).min(ties.len());
    let part = |k: usize| k * ties.len() / points..(k + 1) * ties.len() / points;
    let quickest: Vec<usize> = (0..points)
        .filter_map(|k| part(k).min_by(|a, b| delays[*a].total_cmp(&delays[*b])))
        .collect();
    let scatter: Vec<f64> = quickest.iter().map(|k| scatter_us(&delays, *k)).collect();
    let usual = median(&mut scatter.clone()).unwrap_or(TICK_US);
    let each = quickest.iter().map(|k| &ties[*k]).zip(&scatter);
    each.map(|(t, scatter)| Point {
        spread: scatter / usual,
        ..Point::new(t.box_us + 0.5, 0.5 * (t.sent_us + t.received_us))
    })
    .collect()
}

/// How far delays about the `k`-th scatter above their least, µs. Where a host or a line is busy, even the quickest are slow.
fn scatter_us(delays: &[f64], k: usize) -> f64 {
    let from = k
        .saturating_sub(NEAR / 2)
        .min(delays.len().saturating_sub(NEAR));
    let mut near = delays[from..(from + NEAR).min(delays.len())].to_vec();
    near.sort_by(f64::total_cmp);
    (near[near.len() / 3] - near[0]).max(TICK_US)
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
