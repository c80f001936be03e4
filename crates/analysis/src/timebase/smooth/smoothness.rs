//! A single smoothness: the map of maximum posterior density, its covariances and its restricted likelihood.

use super::band::{Band, dot, factor, inverse_band, solve};
use super::grid::Grid;

/// Candidate smoothnesses as powers of ten of the mean information on a coefficient: below the first a map follows the
/// noise, above the last 64 bits lose the information of the points.
const LOWEST_POWER: f64 = -2.0;
const HIGHEST_POWER: f64 = 12.0;
/// Number of coefficients that no penalty affects: those of a parabola.
pub(crate) const FREE: usize = 3;

/// Model of rate wander.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Like temperature: the rate of change changes slowly.
    Third,
    /// Small independent steps.
    Second,
}

/// One smoothness: its maximum and the uncertainty there.
pub(crate) struct Candidate {
    pub log_likelihood: f64,
    pub variance: f64,
    pub coefficients: Vec<f64>,
    pub covariances: Band,
    pub rate_variance: f64,
}

/// Sums over the points.
pub(super) struct Data {
    /// Number of coefficients that no penalty affects.
    free: usize,
    n: f64,
    pub information: Band,
    right: Vec<f64>,
    squares: f64,
    /// Weights of the coefficients in the mean rate.
    pub chord: Vec<f64>,
}

impl Data {
    /// From (time, value, spread); the mean rate is that between two times, µs.
    pub(super) fn new(
        points: &[(f64, f64, f64)],
        grid: &Grid,
        free: usize,
        between_us: (f64, f64),
    ) -> Self {
        let size = grid.size();
        let mut information = vec![[0.0; 4]; size];
        for (x, _, spread) in points {
            let (k, w) = grid.weights(*x);
            for i in 0..4 {
                for j in i..4 {
                    information[k + i][j - i] += w[i] * w[j] / (spread * spread);
                }
            }
        }
        let (from, to) = between_us;
        let mut chord = vec![0.0; size];
        for (at, sign) in [(from, -1.0), (to, 1.0)] {
            let (k, w) = grid.weights(at);
            for (chord, weight) in chord[k..].iter_mut().zip(w) {
                *chord += sign * weight / (to - from);
            }
        }
        let mut data = Self {
            free,
            n: points.len() as f64,
            information,
            right: Vec::new(),
            squares: 0.0,
            chord,
        };
        data.take(points, grid);
        data
    }

    /// Replaces the values at the same times.
    pub(super) fn take(&mut self, points: &[(f64, f64, f64)], grid: &Grid) {
        self.right = vec![0.0; grid.size()];
        self.squares = 0.0;
        for (x, y, spread) in points {
            let (k, w) = grid.weights(*x);
            let counts = 1.0 / (spread * spread);
            for (right, weight) in self.right[k..].iter_mut().zip(w) {
                *right += counts * weight * y;
            }
            self.squares += counts * y * y;
        }
    }

    /// All smoothnesses except the limit; none if there are so few points that they give a line. `mean`: information on a
    /// coefficient.
    pub(crate) fn wandering(&self, mean: f64) -> Vec<Candidate> {
        let mut out = Vec::new();
        for (kind, high) in [
            (Kind::Third, HIGHEST_POWER),
            (Kind::Second, 0.5 * HIGHEST_POWER),
        ] {
            for k in 0..=(2.0 * (high - LOWEST_POWER)) as usize {
                let power = LOWEST_POWER + 0.5 * k as f64;
                if self.free == FREE {
                    out.extend(self.at(mean * libm::pow(10.0, power), kind));
                }
            }
        }
        out
    }

    /// With a penalty of this size, on third differences or on the scatter of second differences about their mean: neither
    /// affects a parabola.
    fn at(&self, penalty: f64, kind: Kind) -> Option<Candidate> {
        let size = self.right.len();
        let differences: &[f64] = match kind {
            Kind::Third => &[-1.0, 3.0, -3.0, 1.0],
            Kind::Second => &[1.0, -2.0, 1.0],
        };
        let rows = size + 1 - differences.len();
        let mut a = self.information.clone();
        for k in 0..rows {
            for (i, d) in differences.iter().enumerate() {
                for (j, e) in differences.iter().enumerate().skip(i) {
                    a[k + i][j - i] += penalty * d * e;
                }
            }
        }
        let l = factor(&a)?;
        let mut determinant: f64 = l.iter().map(|r| 2.0 * libm::log(r[0])).sum();
        let mut covariances = inverse_band(&l);
        // Without their mean: subtract the square of their sum, which depends only on the outermost coefficients (Sherman
        // and Morrison 1950).
        let mut apart = vec![0.0; size];
        if kind == Kind::Second {
            let share = penalty / rows as f64;
            let mut sum = vec![0.0; size];
            for (at, sign) in [(0, 1.0), (1, -1.0), (size - 2, -1.0), (size - 1, 1.0)] {
                sum[at] += sign;
            }
            let solved = solve(&l, &sum);
            let left = 1.0 - share * dot(&solved, &sum);
            if left.is_nan() || left <= 1e-9 {
                return None;
            }
            // The determinant of these penalties is that of the third differences divided by their number.
            determinant += libm::log(left) + libm::log(rows as f64);
            let scale = (share / left).sqrt();
            apart = solved.iter().map(|v| scale * v).collect();
        }
        for i in 0..size {
            for k in 0..4.min(size - i) {
                covariances[i][k] += apart[i] * apart[i + k];
            }
        }
        let inverse = |b: &[f64]| -> Vec<f64> {
            let along = dot(&apart, b);
            let solved = solve(&l, b).into_iter().zip(&apart);
            solved.map(|(v, a)| v + along * a).collect()
        };
        let coefficients = inverse(&self.right);
        let variance = self.variance(dot(&coefficients, &self.right));
        for v in covariances.iter_mut().flatten() {
            *v *= variance;
        }
        let free = self.free_of_noise();
        let held = (size - FREE) as f64;
        Some(Candidate {
            log_likelihood: -0.5
                * (free * libm::log(variance) + determinant - held * libm::log(penalty)),
            variance,
            coefficients,
            covariances,
            rate_variance: variance * dot(&inverse(&self.chord), &self.chord),
        })
    }

    /// With an infinite penalty: a parabola, or the line.
    pub(crate) fn parabola(&self) -> Option<Candidate> {
        let size = self.right.len();
        let middle = 0.5 * (size - 1) as f64;
        let scale = middle.max(1.0);
        let basis: Vec<[f64; 3]> = (0..size)
            .map(|i| {
                let s = (i as f64 - middle) / scale;
                [1.0, s, if self.free == FREE { s * s } else { 0.0 }]
            })
            .collect();
        let mut m = nalgebra::Matrix3::<f64>::zeros();
        let (mut b, mut c) = (nalgebra::Vector3::zeros(), nalgebra::Vector3::zeros());
        for i in 0..size {
            for k in 0..4.min(size - i) {
                for p in 0..3 {
                    for q in 0..3 {
                        let v = self.information[i][k] * basis[i][p] * basis[i + k][q];
                        m[(p, q)] += v;
                        if k > 0 {
                            m[(q, p)] += v;
                        }
                    }
                }
            }
            for p in 0..3 {
                b[p] += basis[i][p] * self.right[i];
                c[p] += basis[i][p] * self.chord[i];
            }
        }
        if self.free < FREE {
            m[(2, 2)] = 1.0;
        }
        let inverse = m.try_inverse()?;
        let found = inverse * b;
        let variance = self.variance(found.dot(&b));
        let at = |i: usize| nalgebra::Vector3::from(basis[i]);
        let covariances = (0..size)
            .map(|i| {
                let mut row = [0.0; 4];
                for (k, v) in row.iter_mut().enumerate().take(4.min(size - i)) {
                    *v = variance * at(i).dot(&(inverse * at(i + k)));
                }
                row
            })
            .collect();
        // The limit of the determinants: that of the third differences is that of the monomials divided by 4.
        let determinant = libm::log(m.determinant()) + 6.0 * libm::log(scale) - libm::log(4.0);
        Some(Candidate {
            log_likelihood: -0.5 * (self.free_of_noise() * libm::log(variance) + determinant),
            variance,
            coefficients: (0..size).map(|i| found.dot(&at(i))).collect(),
            covariances,
            rate_variance: variance * c.dot(&(inverse * c)),
        })
    }

    /// Variance of a point, kept above 0 despite cancellation.
    fn variance(&self, explained: f64) -> f64 {
        let left = (self.squares - explained)
            .max(1e-12 * self.squares)
            .max(1e-12);
        left / self.free_of_noise()
    }

    fn free_of_noise(&self) -> f64 {
        self.n - self.free as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_of_smoothness_is_the_parabola() {
        let noise = |k: u32| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let point = |k: u32| {
            let x = f64::from(k) * 1e6;
            (x, 1e-13 * x * x + noise(k), 1.0)
        };
        let all: Vec<(f64, f64, f64)> = (0..60).map(point).collect();
        let grid = Grid {
            start_us: 0.0,
            step_us: 59e6 / 5.0,
            steps: 5,
        };
        let data = Data::new(&all, &grid, FREE, (0.0, 59e6));
        let limit = data.parabola().unwrap();
        for (kind, penalty) in [(Kind::Third, 1e9), (Kind::Second, 1e7)] {
            let near = data.at(penalty, kind).unwrap();
            let off = near.log_likelihood - limit.log_likelihood;
            assert!(off.abs() < 0.05, "{kind:?}: {off}");
            for (a, b) in near.covariances.iter().zip(&limit.covariances) {
                assert!((a[0] - b[0]).abs() < 0.02 * b[0]);
            }
        }
    }
}
