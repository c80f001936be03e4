//! How well the data determine the fitted parameters: rank, condition, standard errors, correlations.
//!
//! Standard errors come from the jackknife over locations: leave out each location once and see how far the solution moves
//! (to first order). Unlike `s² (JᵀJ)⁻¹` this requires neither errors of equal size everywhere (distant presses have larger
//! ones) nor independent repetitions at one location (MacKinnon, Nielsen and Webb 2023, "CV3").

use nalgebra::{Cholesky, DMatrix, DVector};

/// Directions in which the Jacobian (columns scaled to unit length) is weaker than this, relative to its strongest, are not
/// determined by the data: about the square root of the rounding error of a double.
const WEAKEST: f64 = 1e-7;
/// A parameter with a larger share in an undetermined direction has no standard error.
const SHARE: f64 = 1e-4;
/// A location that determines all but this share of some direction decides it alone, and its error cannot be estimated.
const MIN_LEFT: f64 = 1e-9;

/// Uncertainty of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Uncertainty {
    /// Number of determined directions.
    pub rank: usize,
    /// Condition number of the Jacobian with columns scaled to unit length, if all directions are determined.
    pub condition: Option<f64>,
    /// Standard error of each parameter; `None` if not determined.
    pub standard_errors: Vec<Option<f64>>,
    /// Correlation of each pair; `None` if one is not determined.
    pub correlation: Vec<Vec<Option<f64>>>,
}

/// `residuals` and `jacobian` at the solution; `locations[i]` belongs to rows 2i and 2i + 1.
pub(super) fn uncertainty(
    residuals: &DVector<f64>,
    jacobian: &DMatrix<f64>,
    locations: &[u32],
) -> Uncertainty {
    let count = jacobian.ncols();
    let norms: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    let unknown = Uncertainty {
        rank: 0,
        condition: None,
        standard_errors: vec![None; count],
        correlation: vec![vec![None; count]; count],
    };
    if !norms.iter().all(|n| n.is_finite()) {
        return unknown;
    }
    let mut scaled = jacobian.clone();
    for (mut column, norm) in scaled.column_iter_mut().zip(&norms) {
        if *norm > 0.0 {
            column /= *norm;
        }
    }
    let svd = scaled.clone().svd(false, true);
    let Some(v_t) = svd.v_t else {
        return unknown;
    };
    let values = svd.singular_values;
    let strongest = values.amax();
    let determined: Vec<usize> = (0..values.len())
        .filter(|i| values[*i] > WEAKEST * strongest)
        .collect();
    let rank = determined.len();
    let condition = (rank == count).then(|| strongest / values.min());
    let is_determined = |p: usize| {
        let share: f64 = determined.iter().map(|i| v_t[(*i, p)].powi(2)).sum();
        norms[p] > 0.0 && 1.0 - share < SHARE * SHARE
    };
    // Coordinates in which the Jacobian is orthonormal: parameters = `basis` * coordinates.
    let basis = DMatrix::from_fn(count, rank, |p, i| {
        let value = v_t[(determined[i], p)] / values[determined[i]];
        if norms[p] > 0.0 {
            value / norms[p]
        } else {
            0.0
        }
    });
    let Some(spread) = jackknife(residuals, &(jacobian * &basis), locations) else {
        return Uncertainty {
            rank,
            condition,
            ..unknown
        };
    };
    let covariance = &basis * spread * basis.transpose();
    let standard_errors: Vec<Option<f64>> = (0..count)
        .map(|p| {
            let error = covariance[(p, p)].sqrt();
            (is_determined(p) && error.is_finite()).then_some(error)
        })
        .collect();
    let correlation = |p: usize, q: usize| {
        let scale = standard_errors[p]? * standard_errors[q]?;
        (scale > 0.0).then(|| (covariance[(p, q)] / scale).clamp(-1.0, 1.0))
    };
    Uncertainty {
        rank,
        condition,
        correlation: (0..count)
            .map(|p| (0..count).map(|q| correlation(p, q)).collect())
            .collect(),
        standard_errors,
    }
}

/// Covariance of the coordinates in which `rows` is orthonormal. Without location g the solution moves by `(I - U_gᵀ U_g)⁻¹
/// U_gᵀ r_g`. `None` with fewer than two remaining locations, or if one decides a direction alone.
fn jackknife(
    residuals: &DVector<f64>,
    rows: &DMatrix<f64>,
    locations: &[u32],
) -> Option<DMatrix<f64>> {
    let rank = rows.ncols();
    let mut order: Vec<usize> = (0..locations.len()).collect();
    order.sort_by_key(|i| locations[*i]);
    let mut sum = DMatrix::zeros(rank, rank);
    let mut groups = 0;
    for group in order.chunk_by(|a, b| locations[*a] == locations[*b]) {
        let mut left = DMatrix::identity(rank, rank);
        let mut pull = DVector::zeros(rank);
        for row in group.iter().flat_map(|i| [2 * i, 2 * i + 1]) {
            let u = rows.row(row).transpose();
            left.ger(-1.0, &u, &u, 1.0);
            pull.axpy(residuals[row], &u, 1.0);
        }
        let factor = Cholesky::new(left)?;
        if factor.l_dirty().diagonal().iter().any(|d| d * d < MIN_LEFT) {
            return None;
        }
        let moved = factor.solve(&pull);
        sum.ger(1.0, &moved, &moved, 1.0);
        groups += 1;
    }
    (groups > 1).then(|| sum * (f64::from(groups - 1) / f64::from(groups)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y = a + b x, two rows per location.
    fn line() -> (DVector<f64>, DMatrix<f64>, Vec<u32>) {
        let jacobian = DMatrix::from_fn(12, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let y = [
            1.0, -1.0, 0.5, 1.0, -2.0, 0.3, 0.1, -0.4, 1.2, -0.9, 0.2, 0.6,
        ];
        let y = DVector::from_column_slice(&y);
        let fit = jacobian.clone().svd(true, true).solve(&y, 0.0).unwrap();
        (y - &jacobian * fit, jacobian, (0..6).collect())
    }

    #[test]
    fn standard_errors_are_those_of_leaving_each_location_out() {
        let (residuals, jacobian, locations) = line();
        let found = uncertainty(&residuals, &jacobian, &locations);
        assert_eq!(found.rank, 2);
        // Reference: refit the line without each location.
        let mut squares = DVector::zeros(2);
        let mut product = 0.0;
        for left_out in 0..6 {
            let rows: Vec<usize> = (0..12).filter(|i| i / 2 != left_out).collect();
            let (j, r) = (jacobian.select_rows(&rows), residuals.select_rows(&rows));
            let moved = j.svd(true, true).solve(&r, 0.0).unwrap();
            product += moved[0] * moved[1];
            squares += moved.component_mul(&moved);
        }
        let errors = (squares * (5.0 / 6.0)).map(f64::sqrt);
        for p in 0..2 {
            assert!((found.standard_errors[p].unwrap() - errors[p]).abs() < 1e-12);
            assert!((found.correlation[p][p].unwrap() - 1.0).abs() < 1e-12);
        }
        let correlation = product * (5.0 / 6.0) / (errors[0] * errors[1]);
        assert!((found.correlation[0][1].unwrap() - correlation).abs() < 1e-12);
        assert!(correlation < -0.5);
    }

    #[test]
    fn the_condition_is_that_of_scaled_columns() {
        let (residuals, mut jacobian, locations) = line();
        let expected = uncertainty(&residuals, &jacobian, &locations).condition;
        jacobian.column_mut(1).scale_mut(1e9);
        let found = uncertainty(&residuals, &jacobian, &locations).condition;
        assert!((found.unwrap() - expected.unwrap()).abs() < 1e-9);
        // Unit columns at the angle whose cosine is c have the condition number sqrt((1 + c) / (1 - c)).
        let c: f64 = 66.0 / (12.0f64.sqrt() * 506.0f64.sqrt());
        assert!((expected.unwrap() - ((1.0 + c) / (1.0 - c)).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn an_undetermined_pair_has_none_and_spares_the_others() {
        let (residuals, jacobian, locations) = line();
        let with = |f: fn(usize) -> f64| {
            let wide = DMatrix::from_fn(12, 3, |i, j| match j {
                0 => 1.0,
                1 => i as f64,
                _ => f(i),
            });
            uncertainty(&residuals, &wide, &locations)
        };
        // Parameter 2 is twice parameter 1.
        let twins = with(|i| 2.0 * i as f64);
        assert_eq!((twins.rank, twins.condition), (2, None));
        assert!(twins.standard_errors[0].is_some());
        assert_eq!(&twins.standard_errors[1..], &[None, None]);
        assert_eq!(twins.correlation[0][1], None);
        let dead = with(|_| 0.0);
        let alone = uncertainty(&residuals, &jacobian, &locations);
        assert_eq!(dead.standard_errors[2], None);
        let (a, b) = (dead.standard_errors[1], alone.standard_errors[1]);
        assert!((a.unwrap() - b.unwrap()).abs() < 1e-12);
    }

    #[test]
    fn a_location_that_alone_determines_the_fit_has_no_held_out_error() {
        let (residuals, jacobian, _) = line();
        let found = uncertainty(&residuals, &jacobian, &[0; 6]);
        assert_eq!((found.rank, found.standard_errors), (2, vec![None, None]));
        let mut lonely = jacobian.clone();
        for i in 2..12 {
            lonely[(i, 1)] = 0.0;
        }
        let found = uncertainty(&residuals, &lonely, &[0, 1, 2, 3, 4, 5]);
        assert_eq!((found.rank, found.standard_errors), (2, vec![None, None]));
    }
}
