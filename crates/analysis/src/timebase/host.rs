//! `host_from_box`: the host's clock over the box's, with certain bounds.
//!
//! Every exchange shows that the box's clock had a value between two host times. The map is a fit to the fastest exchanges;
//! its certain bounds follow from all of them: above the latest `sent` and below the earliest `received`, each extended
//! along the fit by the maximum rate error. The bounds make no assumption on how a delay divides into its two directions;
//! the map itself assumes that both take equally long on average.

use super::edges::{beyond_us, distance_us};
use super::epochs::Tie;
use super::smooth::{Figure, Point, STEP_US, SmoothMap, WANDER};
use crate::clock::NO_CLOCK_DRIFT;
use crate::clock::line::median;

/// The fastest exchange in each such span of box time is a point of the fit, µs.
const QUICKEST_OF_US: f64 = 5e6;
/// Number of neighbouring exchanges that define how busy the line is: their 50 fastest give the scatter to 7 %.
const NEAR: usize = 150;
/// Resolution of the box's clock: 1 µs.
const TICK_US: f64 = 1.0;
/// Minimum number of points of the fit, if there are as many exchanges.
const POINTS: f64 = 40.0;
/// Span in which the rate error of the fit is bounded, µs.
const WINDOW_US: f64 = 60e6;
/// Parts of such a span; the tightest bounds of each part count.
const PARTS: usize = 40;
/// Maximum wander of the rates about the fit within a window: a crystal that wanders by 6 ppm per hour, 0.05 ppm in half a
/// minute.
const SHAPE: f64 = 0.05e-6;
/// Lower bound of the scale of delays, µs.
const FLOOR_US: f64 = 20.0;
/// Iterations of a search, each with at most a hundredth of the previous error: no clock is off by more.
const ROUNDS: usize = 9;

/// The map.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HostFromBox {
    /// Box times between which the map is nearly straight, ascending, µs.
    pub knots_us: Vec<f64>,
    /// The fit, which is clamped to the bounds where it exceeds them.
    pub fit: SmoothMap,
    /// Box times of the exchanges, ascending, µs.
    pub ties_us: Vec<f64>,
    /// False if exchanges contradict each other: the clock jumped, or an exchange is wrong.
    pub consistent: bool,
    points: Vec<Point>,
    bounds: Bounds,
}

impl HostFromBox {
    /// From exchanges in order of box time; `None` below 3 or without spread in time.
    pub(super) fn new(ties: &[Tie]) -> Option<Self> {
        let points = quickest(ties);
        let fit = SmoothMap::fit(&points, STEP_US, FLOOR_US)?;
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
    pub(super) fn host_us(&self, box_us: f64) -> f64 {
        self.fit.value(box_us) + self.moved_us(box_us)
    }

    /// Shift of the map into the bounds, µs: certainty takes precedence over likelihood.
    fn moved_us(&self, box_us: f64) -> f64 {
        let (low, high) = self.bounds.at(box_us);
        0.0f64.max(low).min(high.max(low))
    }

    /// Box time of a host time, µs. Both clocks have nearly the same rate, so the iteration converges fast.
    pub(super) fn box_us(&self, host_us: f64) -> f64 {
        let mut box_us = host_us - self.host_us(0.0);
        for _ in 0..ROUNDS {
            box_us += host_us - self.host_us(box_us);
        }
        box_us
    }

    /// Host time of a box time, with its random error: that of the delays, if both directions take equally long on average.
    pub(super) fn at(&self, box_us: f64) -> Figure {
        Figure {
            value: self.host_us(box_us),
            se: self.fit.standard_error(box_us),
            free: self.fit.free,
        }
    }

    /// Mean rate of host over box time, minus 1, between two box times, µs, with its random error.
    pub(super) fn drift(&self, between_us: (f64, f64)) -> Option<Figure> {
        let fit = SmoothMap::fit_with_drift(&self.points, STEP_US, FLOOR_US, Some(between_us))?;
        Some(fit.drift)
    }

    /// Half width of the interval about [`Self::host_us`] that certainly contains the host time of a box time, µs.
    pub(super) fn bound_us(&self, box_us: f64) -> f64 {
        let (low, high) = self.bounds.at(box_us);
        let by = self.moved_us(box_us);
        // Beyond the exchanges only the tolerance of crystals bounds the rate.
        (by - low).abs().max((high - by).abs()) + WANDER * beyond_us(&self.ties_us, box_us)
    }

    /// Distance from a box time to the nearest exchange, µs.
    pub(super) fn tie_distance_us(&self, box_us: f64) -> f64 {
        distance_us(&self.ties_us, box_us)
    }
}

/// Midpoint of the fastest exchange in each group.
///
/// All groups have the same size, so that all points are equally good: the fastest of a small group is slow, and a slow last
/// point dominates the rate.
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

/// Scatter of delays about the `k`-th above their minimum, µs. On a busy host or line even the fastest are slow.
fn scatter_us(delays: &[f64], k: usize) -> f64 {
    let from = k
        .saturating_sub(NEAR / 2)
        .min(delays.len().saturating_sub(NEAR));
    let mut near = delays[from..(from + NEAR).min(delays.len())].to_vec();
    near.sort_by(f64::total_cmp);
    (near[near.len() / 3] - near[0]).max(TICK_US)
}

/// Bounds from one exchange on the host's deviation from the fit, µs.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bound {
    box_us: f64,
    low: f64,
    high: f64,
}

/// Bounds from all exchanges, extended in time by the rate error.
#[derive(Debug, Clone, PartialEq)]
struct Bounds {
    /// At each exchange, from those up to it, and from those after it.
    before: Vec<Bound>,
    after: Vec<Bound>,
    /// Rate error of the fit.
    rate: f64,
}

impl Bounds {
    /// Also returns whether the exchanges agree.
    fn new(ties: &[Tie], fit: &SmoothMap) -> (Self, bool) {
        // The box's clock has a resolution of 1 µs, so a value lasts 1 µs.
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

/// Rate error of the fit: slope of the steepest line between all bounds of any window; `None` if some window has none.
fn rate(bounds: &[Bound]) -> Option<f64> {
    let (first, last) = (bounds.first()?.box_us, bounds.last()?.box_us);
    let windows = ((last - first) / WINDOW_US).floor().max(1.0);
    let part_us = ((last - first) / windows / PARTS as f64).max(1.0);
    let part = |b: &Bound| ((b.box_us - first) / part_us).floor();
    // Tightest bounds of each part, and their times.
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
        // A last window may be too short to be informative.
        let steepest = largest.abs().max(least.abs());
        most = most.max(if steepest.is_finite() { steepest } else { 0.0 });
    }
    Some(most.min(NO_CLOCK_DRIFT) + SHAPE)
}
