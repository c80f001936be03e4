//! Residuals free of what neighbours share: a press list that is shifted displaces presses against their neighbours, the errors of a
//! skin displace neighbours alike.

use skinrig_model::Point2;

use super::readings::{Path, ScoredReading};
use super::resection::{MIN_SPREAD_DEG, residual_deg};
use super::statistics::median;

/// Radius of the neighbourhood in distances between locations: it holds presses of the lines beside a press.
const RADIUS_STEPS: f64 = 2.2;
/// Standard deviation of the neighbours' weights in such distances.
const WEIGHT_STEPS: f64 = 1.25;
/// Minimum number of neighbours.
const MIN_NEIGHBOURS: usize = 4;
/// Maximum number of neighbours; of more, every n-th is used.
const MAX_NEIGHBOURS: usize = 200;
/// Number of presses whose nearest location tells how far apart locations are.
const SAMPLED: usize = 200;

/// Lower quartile of the absolute value of a standard normal variable.
const QUARTER_OF_SIGMA: f64 = 0.3186;

/// Neighbours of each press of a path with their weights.
pub(super) struct Neighbours(Vec<Vec<(usize, f64)>>);

impl Neighbours {
    /// `None` for a single location.
    pub(super) fn new(path: &Path<'_>) -> Option<Self> {
        let at: Vec<Point2> = path.presses_seen.iter().map(|t| t.planned).collect();
        let distance = |a: Point2, b: Point2| libm::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm);
        // Not from press to press: a shuffled path jumps over the whole skin.
        let nearest = at.iter().step_by(at.len().div_ceil(SAMPLED).max(1));
        let nearest = nearest.filter_map(|own| {
            let others = at.iter().map(|other| distance(*own, *other));
            others.filter(|away| *away > 0.0).min_by(f64::total_cmp)
        });
        let step = median(nearest.collect())?;
        let mut by_x: Vec<usize> = (0..at.len()).collect();
        by_x.sort_by(|a, b| at[*a].x_mm.total_cmp(&at[*b].x_mm));
        let radius = RADIUS_STEPS * step;
        let of = |i: usize| -> Vec<(usize, f64)> {
            let from = by_x.partition_point(|j| at[*j].x_mm < at[i].x_mm - radius);
            let near = by_x[from..]
                .iter()
                .copied()
                .take_while(|j| at[*j].x_mm <= at[i].x_mm + radius);
            let near: Vec<(usize, f64)> = near
                .filter(|j| *j != i)
                .map(|j| (j, distance(at[i], at[j])))
                .filter(|(_, away)| *away <= radius)
                .collect();
            let kept = near
                .iter()
                .step_by(near.len().div_ceil(MAX_NEIGHBOURS).max(1));
            let weight = |away: f64| libm::exp(-0.5 * (away / (WEIGHT_STEPS * step)).powi(2));
            kept.map(|(j, away)| (*j, weight(*away))).collect()
        };
        Some(Self((0..at.len()).map(of).collect()))
    }
}

/// Residuals of one camera, degrees, minus the mean of their neighbours'.
pub(super) struct LocalResiduals {
    /// By shift of the position in rows, from the smallest; by press.
    by_shift: Vec<Vec<Option<f64>>>,
    /// Robust standard deviation with the shift that most presses have, degrees.
    spread_deg: f64,
}

impl LocalResiduals {
    /// Of camera `k` for these shifts.
    pub(super) fn new(
        path: &Path<'_>,
        as_is: &ScoredReading<'_>,
        neighbours: &Neighbours,
        k: usize,
        shifts: &[i32],
    ) -> Option<Self> {
        let fit = as_is.fits[k]?;
        let n = path.presses_seen.len();
        let raw = |by: i32| -> Vec<Option<f64>> {
            (0..n)
                .map(|i| {
                    let column = path.presses_seen[i].sights[k].column?;
                    Some(residual_deg(&fit.camera, column, path.shifted(i, by)?))
                })
                .collect()
        };
        let local = |by: i32| -> Vec<Option<f64>> {
            let raw = raw(by);
            let one = |i: usize| -> Option<f64> {
                let own = raw[i]?;
                let near = neighbours.0[i].iter();
                let near = near.filter_map(|(j, weight)| Some((raw[*j]?, *weight)));
                let (mut sum, mut weights, mut count) = (0.0, 0.0, 0);
                for (residual, weight) in near {
                    sum += weight * residual;
                    weights += weight;
                    count += 1;
                }
                (count >= MIN_NEIGHBOURS).then(|| own - sum / weights)
            };
            (0..n).map(one).collect()
        };
        let by_shift: Vec<_> = shifts.iter().map(|by| local(*by)).collect();
        let spreads = by_shift.iter().filter_map(|all| spread_of_half(all));
        let spread_deg = spreads.min_by(f64::total_cmp)?.max(MIN_SPREAD_DEG);
        Some(Self {
            by_shift,
            spread_deg,
        })
    }

    /// Residual of press `i` with the shift at `index`, in standard deviations.
    pub(super) fn sigmas(&self, i: usize, index: usize) -> Option<f64> {
        self.by_shift[index][i].map(|residual| residual / self.spread_deg)
    }
}

/// Robust standard deviation about 0 of values of which up to half belong to another shift: from the quarter of their sizes.
fn spread_of_half(residuals: &[Option<f64>]) -> Option<f64> {
    let mut sizes: Vec<f64> = residuals.iter().flatten().map(|r| r.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    Some(sizes.get(sizes.len() / 4)? / QUARTER_OF_SIGMA)
}
