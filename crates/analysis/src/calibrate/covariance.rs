//! Standard errors of fitted parameters from the residuals and Jacobian at the solution.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Directions in which the (column-scaled) normal matrix is weaker than this, relative to its strongest, are not
/// determined by the data: about the square of the rounding error of a double.
const WEAKEST: f64 = 1e-13;
/// A parameter with a larger share than this in an undetermined direction has no standard error.
const SHARE: f64 = 1e-4;

/// Standard error of each parameter: the square root of the diagonal of `s² (JᵀJ)⁻¹` with
/// `s² = |r|² / (residuals - parameters)`. `None` where the data do not determine the parameter.
pub fn standard_errors(residuals: &DVector<f64>, jacobian: &DMatrix<f64>) -> Vec<Option<f64>> {
    let count = jacobian.ncols();
    let freedom = residuals.len() as f64 - count as f64;
    let norms: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    if freedom < 1.0 || !norms.iter().all(|n| n.is_finite()) {
        return vec![None; count];
    }
    let mut scaled = jacobian.clone();
    for (mut column, norm) in scaled.column_iter_mut().zip(&norms) {
        if *norm > 0.0 {
            column /= *norm;
        }
    }
    let eigen = SymmetricEigen::new(scaled.transpose() * &scaled);
    let strongest = eigen.eigenvalues.amax();
    let variance = residuals.norm_squared() / freedom;
    (0..count)
        .map(|p| {
            let mut sum = 0.0;
            for (value, vector) in eigen
                .eigenvalues
                .iter()
                .zip(eigen.eigenvectors.column_iter())
            {
                let share = vector[p] * vector[p];
                if *value > WEAKEST * strongest {
                    sum += share / value;
                } else if share > SHARE * SHARE {
                    return None;
                }
            }
            let error = (variance * sum).sqrt() / norms[p];
            (norms[p] > 0.0 && error.is_finite()).then_some(error)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_fit_has_the_textbook_errors() {
        // y = a + b x on x = 0..=4 with residuals of unit size: se(b) = s / sqrt(10), se(a) = s sqrt(0.6).
        let jacobian = DMatrix::from_fn(5, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let residuals = DVector::from_column_slice(&[1.0, -1.0, 0.0, 1.0, -1.0]);
        let s = (4.0f64 / 3.0).sqrt();
        let found = standard_errors(&residuals, &jacobian);
        assert!((found[0].unwrap() - s * 0.6f64.sqrt()).abs() < 1e-12);
        assert!((found[1].unwrap() - s / 10f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn an_undetermined_pair_has_none_and_spares_the_others() {
        let jacobian = DMatrix::from_fn(6, 3, |i, j| match j {
            0 => 1.0,
            1 => i as f64,
            _ => 2.0 * i as f64, // the same as parameter 1, twice as strong
        });
        let residuals = DVector::from_element(6, 0.1);
        let found = standard_errors(&residuals, &jacobian);
        assert!(found[0].is_some());
        assert_eq!(&found[1..], &[None, None]);
        let dead = DMatrix::from_fn(6, 2, |_, j| if j == 0 { 1.0 } else { 0.0 });
        assert_eq!(standard_errors(&residuals, &dead)[1], None);
    }
}
