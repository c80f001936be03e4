//! The inverse of a covariance matrix, from its Cholesky factor.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// A factorised covariance matrix `L Lᵀ`, with `L⁻¹`.
pub(crate) struct Precision {
    factor: Cholesky<f64, Dyn>,
    /// `L⁻¹`, lower triangular.
    root: DMatrix<f64>,
}

impl Precision {
    /// `None` unless the matrix is positive definite; only its lower triangle is read.
    pub(crate) fn of(covariance: DMatrix<f64>) -> Option<Self> {
        let factor = Cholesky::new(covariance)?;
        let lower = factor.l_dirty();
        let n = lower.nrows();
        let mut root = DMatrix::zeros(n, n);
        for j in 0..n {
            root[(j, j)] = 1.0;
            for k in j..n {
                let value = root[(k, j)] / lower[(k, k)];
                root[(k, j)] = value;
                let below = n - k - 1;
                let column = lower.column(k);
                let mut rest = root.column_mut(j);
                rest.rows_mut(k + 1, below)
                    .axpy(-value, &column.rows(k + 1, below), 1.0);
            }
        }
        Some(Self { factor, root })
    }

    /// Logarithm of the square root of the determinant of the covariance.
    pub(crate) fn log_root_determinant(&self) -> f64 {
        let diagonal = self.factor.l_dirty().diagonal();
        diagonal.iter().map(|d| libm::log(*d)).sum()
    }

    /// The inverse times a vector.
    pub(crate) fn times(&self, vector: &DVector<f64>) -> DVector<f64> {
        self.factor.solve(vector)
    }

    /// Element of the inverse, `i >= j`.
    pub(crate) fn element(&self, i: usize, j: usize) -> f64 {
        let below = self.root.nrows() - i;
        let (a, b) = (self.root.column(i), self.root.column(j));
        a.rows(i, below).dot(&b.rows(i, below))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_inverts() {
        let matrix = DMatrix::from_fn(9, 9, |i, j| {
            let off = i as f64 - j as f64;
            (-0.1 * off * off).exp() + if i == j { 0.3 + 0.1 * i as f64 } else { 0.0 }
        });
        let precision = Precision::of(matrix.clone()).unwrap();
        let inverse = matrix.clone().try_inverse().unwrap();
        for i in 0..9 {
            for j in 0..=i {
                assert!((precision.element(i, j) - inverse[(i, j)]).abs() < 1e-12);
            }
        }
        let vector = DVector::from_fn(9, |i, _| i as f64);
        assert!((precision.times(&vector) - &inverse * &vector).amax() < 1e-11);
        let determinant = matrix.determinant().ln();
        assert!((2.0 * precision.log_root_determinant() - determinant).abs() < 1e-12);
        assert!(Precision::of(-matrix).is_none());
    }
}
