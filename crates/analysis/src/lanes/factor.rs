//! The Cholesky factor of a covariance matrix, and its inverse.

use skinrig_simd::InstructionSet;

use super::lower::Lower;
use super::{Group, LANES, groups, total};

/// Columns that one pass over a column takes into account: enough to be limited by arithmetic instead of memory.
const BLOCK: usize = 4;

/// The lower triangular factor `L` of a positive definite matrix `L Lᵀ`.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    lower: Lower,
    instructions: InstructionSet,
}

impl Factor {
    /// `None` unless the matrix is positive definite.
    pub(crate) fn of(covariance: Lower) -> Option<Self> {
        Self::with(InstructionSet::best(), covariance)
    }

    fn with(instructions: InstructionSet, mut covariance: Lower) -> Option<Self> {
        let lower = &mut covariance;
        let positive = instructions.run(
            #[inline(always)]
            || factorise(lower),
        );
        positive.then_some(Self {
            lower: covariance,
            instructions,
        })
    }

    /// Logarithm of the square root of the determinant of the covariance.
    pub(crate) fn log_root_determinant(&self) -> f64 {
        let diagonal = (0..self.lower.n()).map(|j| self.lower.get(j, j));
        diagonal.map(libm::log).sum()
    }

    /// `vᵀ C⁻¹ v` for the covariance C and a vector v in whole groups. Values beyond the last row are ignored.
    pub(crate) fn explained(&self, mut vector: Vec<Group>) -> f64 {
        if let (Some(last), filled @ 1..) = (vector.last_mut(), self.lower.n() % LANES) {
            last[filled..].fill(0.0);
        }
        self.instructions.run(
            #[inline(always)]
            || {
                forward(&self.lower, &mut vector);
                square(&vector)
            },
        )
    }

    /// The inverse of the covariance times a vector, in whole groups.
    pub(crate) fn solve(&self, vector: impl IntoIterator<Item = f64>) -> Vec<Group> {
        let mut solved = groups(vector);
        let into = &mut solved;
        self.instructions.run(
            #[inline(always)]
            || {
                forward(&self.lower, into);
                backward(&self.lower, into);
            },
        );
        solved
    }

    /// The inverse of the covariance.
    pub(crate) fn inverse(&self) -> Lower {
        self.instructions.run(
            #[inline(always)]
            || product(&inverse_root(&self.lower)),
        )
    }

    /// The diagonal of the inverse of the covariance.
    pub(crate) fn inverse_diagonal(&self) -> Vec<f64> {
        self.instructions.run(
            #[inline(always)]
            || {
                let root = inverse_root(&self.lower);
                (0..root.n()).map(|j| square(root.column(j))).collect()
            },
        )
    }
}

/// Sum of the squares.
#[inline(always)]
fn square(values: &[Group]) -> f64 {
    let mut lanes = [0.0; LANES];
    for group in values {
        for i in 0..LANES {
            lanes[i] += group[i] * group[i];
        }
    }
    total(&lanes)
}

/// Replaces a positive definite matrix by its factor; false if it is not positive definite.
#[inline(always)]
fn factorise(matrix: &mut Lower) -> bool {
    for j in 0..matrix.n() {
        let (first, own) = (j / LANES, j % LANES);
        let (column, before) = matrix.column_after(j);
        let mut k = 0;
        while k + BLOCK <= j {
            let from: [&[Group]; BLOCK] = std::array::from_fn(|b| before.from(k + b, first));
            let factors = from.map(|column| column[0][own]);
            subtract(column, from, factors);
            k += BLOCK;
        }
        for k in k..j {
            let from = before.from(k, first);
            subtract(column, [from], [from[0][own]]);
        }
        let pivot = column[0][own];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        let root = pivot.sqrt();
        for group in column.iter_mut() {
            for value in group {
                *value /= root;
            }
        }
        column[0][..own].fill(0.0);
    }
    true
}

/// Subtracts the columns times their factors, one after the other.
#[inline(always)]
fn subtract<const N: usize>(into: &mut [Group], columns: [&[Group]; N], factors: [f64; N]) {
    let columns = columns.map(|column| &column[..into.len()]);
    for (g, group) in into.iter_mut().enumerate() {
        // Values of their own: the compiler cannot know that the columns do not overlap.
        let mut rest = *group;
        for (column, factor) in columns.iter().zip(factors) {
            let own = column[g];
            for i in 0..LANES {
                rest[i] -= factor * own[i];
            }
        }
        *group = rest;
    }
}

/// Solves `L x = vector` in place.
#[inline(always)]
fn forward(lower: &Lower, vector: &mut [Group]) {
    for k in 0..lower.n() {
        let (first, own) = (k / LANES, k % LANES);
        let column = lower.column(k);
        let value = vector[first][own] / column[0][own];
        subtract(&mut vector[first..], [column], [value]);
        vector[first][own] = value;
    }
}

/// Solves `Lᵀ x = vector` in place.
#[inline(always)]
fn backward(lower: &Lower, vector: &mut [Group]) {
    for k in (0..lower.n()).rev() {
        let (first, own) = (k / LANES, k % LANES);
        let column = lower.column(k);
        let value = vector[first][own];
        vector[first][own] = 0.0;
        let [below] = products([column], &vector[first..]);
        vector[first][own] = (value - below) / column[0][own];
    }
}

/// Scalar products of the columns with one vector.
#[inline(always)]
fn products<const N: usize>(columns: [&[Group]; N], vector: &[Group]) -> [f64; N] {
    let columns = columns.map(|column| &column[..vector.len()]);
    let mut lanes = [[0.0; LANES]; N];
    for (g, group) in vector.iter().enumerate() {
        for (lanes, column) in lanes.iter_mut().zip(columns) {
            let own = column[g];
            for i in 0..LANES {
                lanes[i] += own[i] * group[i];
            }
        }
    }
    lanes.map(|lanes| total(&lanes))
}

/// `L⁻¹`.
#[inline(always)]
fn inverse_root(lower: &Lower) -> Lower {
    let n = lower.n();
    let mut root = Lower::zeros(n);
    for j in 0..n {
        let (start, own) = (j / LANES, j % LANES);
        let column = root.column_mut(j);
        column[0][own] = 1.0;
        for k in j..n {
            let (first, own) = (k / LANES, k % LANES);
            let from = lower.column(k);
            let rest = &mut column[first - start..];
            let value = rest[0][own] / from[0][own];
            subtract(rest, [from], [value]);
            rest[0][own] = value;
        }
    }
    root
}

/// `Rᵀ R`, lower triangle.
#[inline(always)]
fn product(root: &Lower) -> Lower {
    let n = root.n();
    let mut inverse = Lower::zeros(n);
    for j in 0..n {
        let (start, own) = (j / LANES, root.column(j));
        let mut i = j;
        while i < n {
            let first = i / LANES;
            // All columns of a block begin with the same group, as the blocks end where the groups do.
            let block = BLOCK.min(LANES - i % LANES).min(n - i);
            let vector = &own[first - start..];
            if block == BLOCK {
                let columns: [&[Group]; BLOCK] = std::array::from_fn(|b| root.column(i + b));
                for (b, value) in products(columns, vector).into_iter().enumerate() {
                    inverse.set(i + b, j, value);
                }
            } else {
                for i in i..i + block {
                    let [value] = products([root.column(i)], vector);
                    inverse.set(i, j, value);
                }
            }
            i += block;
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    /// A positive definite matrix of `n` rows: smooth, with noise.
    fn covariance(n: usize, seed: u64) -> Lower {
        Lower::from_fn(n, |i, j| {
            let off = i as f64 - j as f64 + (seed % 7) as f64 * 0.01;
            let noise = 0.3 + 0.01 * i as f64;
            libm::exp(-0.1 * off * off) + if i == j { noise } else { 0.0 }
        })
    }

    fn dense(lower: &Lower) -> DMatrix<f64> {
        let n = lower.n();
        DMatrix::from_fn(n, n, |i, j| lower.get(i.max(j), i.min(j)))
    }

    proptest! {
        #[test]
        fn it_solves_and_inverts(n in 1usize..40, seed in 0u64..7) {
            let matrix = covariance(n, seed);
            let full = dense(&matrix);
            let factor = Factor::of(matrix.clone()).unwrap();
            let expected = full.clone().try_inverse().unwrap();
            let inverse = factor.inverse();
            prop_assert!((dense(&inverse) - &expected).amax() < 1e-12);
            for (j, value) in factor.inverse_diagonal().into_iter().enumerate() {
                prop_assert!((value - expected[(j, j)]).abs() < 1e-12);
            }
            let vector = DVector::from_fn(n, |i, _| libm::sin(i as f64 + seed as f64));
            let solved = factor.solve(vector.iter().copied());
            let solved = DVector::from_column_slice(&solved.as_flattened()[..n]);
            prop_assert!((solved - &expected * &vector).amax() < 1e-11);
            let mut filled = groups(vector.iter().copied());
            filled[(n - 1) / LANES][(n - 1) % LANES + 1..].fill(7.0);
            let explained = factor.explained(filled);
            prop_assert!((explained - vector.dot(&(&expected * &vector))).abs() < 1e-11);
            let determinant = libm::log(full.determinant());
            prop_assert!((2.0 * factor.log_root_determinant() - determinant).abs() < 1e-10);
        }
    }

    #[test]
    fn all_instruction_sets_give_the_same_bits() {
        for n in [1, 5, 8, 23, 67] {
            let all = InstructionSet::available().into_iter().map(|set| {
                let factor = Factor::with(set, covariance(n, 3)).unwrap();
                let solved = factor.solve((0..n).map(|i| libm::cos(i as f64)));
                (factor.inverse(), factor.inverse_diagonal(), solved)
            });
            let all: Vec<_> = all.collect();
            assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{n}");
        }
    }

    #[test]
    fn what_is_not_positive_definite_has_no_factor() {
        let mut matrix = covariance(9, 0);
        matrix.set(8, 8, -1.0);
        assert!(Factor::of(matrix.clone()).is_none());
        matrix.set(8, 8, f64::NAN);
        assert!(Factor::of(matrix).is_none());
        assert!(Factor::of(Lower::from_fn(2, |_, _| 1.0)).is_none());
    }
}
