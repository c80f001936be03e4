//! Studentised bootstrap over locations (Efron 1981; Hall 1988; for clusters Davison and Hinkley 1997, 3.8).
//!
//! Each draw takes whole locations with replacement and records its error in units of its own standard error. The resulting
//! limits are second-order correct for skewed errors such as squares (Hall 1988); plain percentile intervals are too narrow
//! for the tens of locations on a skin. The standard error of a draw comes from the same sums as the draw, so a draw costs
//! one pass over the locations.

use crate::seeded;

use super::influence::Ratio;

/// Sums of one sample in one draw.
#[derive(Default, Clone, Copy)]
struct Sums {
    residual: f64,
    weight: f64,
}

/// Studentised errors of the draws, ascending.
///
/// The estimate is `b - sign * a` over the same locations, or `b` alone.
pub(super) fn paired(a: Option<(&Ratio, f64)>, b: &Ratio, resamples: u32, seed: u64) -> Vec<f64> {
    let k = b.terms.len();
    let draw = |number: u32| {
        let mut rng = seeded::generator(seed, u64::from(number));
        let mut drawn = Vec::with_capacity(k);
        drawn.extend((0..k).map(|_| seeded::index(&mut rng, k)));
        let b = linearize(b, &drawn);
        let a = a.map(|(a, sign)| (linearize(a, &drawn), sign));
        let change = b.change - a.as_ref().map_or(0.0, |(a, sign)| sign * a.change);
        let mut squares = 0.0;
        for i in &drawn {
            let own = b.at(*i) - a.as_ref().map_or(0.0, |(a, sign)| sign * a.at(*i));
            squares += own * own;
        }
        studentised(change, k, squares)
    };
    sorted((0..resamples).map(draw))
}

/// Same for two samples with separate locations.
pub(super) fn independent(a: (&Ratio, f64), b: &Ratio, resamples: u32, seed: u64) -> Vec<f64> {
    let (a, sign) = a;
    let draw_one = |of: &Ratio, stream: u64| {
        let k = of.terms.len();
        let mut rng = seeded::generator(seed, stream);
        let drawn: Vec<usize> = (0..k).map(|_| seeded::index(&mut rng, k)).collect();
        let linear = linearize(of, &drawn);
        let squares: f64 = drawn.iter().map(|i| linear.at(*i).powi(2)).sum();
        (linear.change, squares * k as f64 / (k as f64 - 1.0))
    };
    let draw = |number: u32| {
        let streams = [2 * u64::from(number), 2 * u64::from(number) + 1];
        let ((change_a, of_a), (change_b, of_b)) =
            (draw_one(a, streams[0]), draw_one(b, streams[1]));
        ratio_or_infinite(change_b - sign * change_a, (of_a + of_b).sqrt())
    };
    sorted((0..resamples).map(draw))
}

/// A sample linearised at the value of one draw.
struct LinearizedSample<'a> {
    of: &'a Ratio,
    change: f64,
    shift: f64,
    slope: f64,
}

impl LinearizedSample<'_> {
    /// Contribution of a location to the error of the draw.
    fn at(&self, location: usize) -> f64 {
        let (residual, weight) = self.of.terms[location];
        self.slope * (residual - self.shift * weight)
    }
}

fn linearize<'a>(of: &'a Ratio, drawn: &[usize]) -> LinearizedSample<'a> {
    let mut sums = Sums::default();
    for i in drawn {
        let (residual, weight) = of.terms[*i];
        sums.residual += residual;
        sums.weight += weight;
    }
    let shift = sums.residual / sums.weight;
    let (value, slope) = of.scale.of(of.ratio + shift);
    LinearizedSample {
        of,
        change: value - of.scale.of(of.ratio).0,
        shift,
        slope: slope / sums.weight,
    }
}

fn studentised(change: f64, k: usize, squares: f64) -> f64 {
    ratio_or_infinite(change, (squares * k as f64 / (k as f64 - 1.0)).sqrt())
}

/// Infinite for a draw without spread, or 0 if it also has no error.
fn ratio_or_infinite(change: f64, error: f64) -> f64 {
    if error > 0.0 {
        change / error
    } else if change == 0.0 {
        0.0
    } else {
        change.signum() * f64::INFINITY
    }
}

fn sorted(draws: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut draws: Vec<f64> = draws.collect();
    draws.sort_by(f64::total_cmp);
    draws
}
