//! Minimises a smooth function of a few variables: Broyden-Fletcher-Goldfarb-Shanno with backtracking.

use nalgebra::{SMatrix, SVector};

/// Longest step in any variable. The variables are logarithms.
const LONGEST: f64 = 1.0;
/// A step is accepted if it lowers the function by at least this share of what its slope promises.
const SUFFICIENT: f64 = 1e-4;
/// Halvings of a step.
const HALVINGS: usize = 25;

/// Value and gradient.
pub(crate) type ValueAndGradient<const N: usize> = (f64, SVector<f64, N>);

/// The point that `steps` steps from `from` reach, with its value; earlier if a step gains less than `tolerance`. `None`
/// if the function has no value at `from`.
pub(crate) fn minimise<const N: usize>(
    from: SVector<f64, N>,
    steps: usize,
    tolerance: f64,
    function: impl Fn(&SVector<f64, N>) -> Option<ValueAndGradient<N>>,
) -> Option<(SVector<f64, N>, f64)> {
    let mut at = from;
    let (mut value, mut gradient) = function(&at)?;
    let mut inverse = SMatrix::<f64, N, N>::identity();
    let mut scaled = false;
    for _ in 0..steps {
        let mut direction = -(inverse * gradient);
        if direction.dot(&gradient) >= 0.0 {
            (inverse, scaled) = (SMatrix::identity(), false);
            direction = -gradient;
        }
        let longest = direction.amax();
        if longest > LONGEST {
            direction *= LONGEST / longest;
        }
        let slope = direction.dot(&gradient);
        let mut share = 1.0;
        let mut reached = None;
        for _ in 0..HALVINGS {
            let there = at + direction * share;
            if let Some((new, by)) = function(&there)
                && new <= value + SUFFICIENT * share * slope
            {
                reached = Some((there, new, by));
                break;
            }
            share *= 0.5;
        }
        let Some((there, new, by)) = reached else {
            break;
        };
        let (step, turn) = (there - at, by - gradient);
        let gain = value - new;
        (at, value, gradient) = (there, new, by);
        if gain <= tolerance {
            break;
        }
        let curvature = step.dot(&turn);
        if curvature > 1e-12 {
            // The first step tells the size of the curvature (Nocedal and Wright, Numerical Optimization, 2nd edition, equation 6.20).
            if !scaled {
                inverse *= curvature / turn.norm_squared();
                scaled = true;
            }
            let shift = SMatrix::identity() - step * turn.transpose() / curvature;
            inverse = shift * inverse * shift.transpose() + step * step.transpose() / curvature;
        }
    }
    Some((at, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let valley = |p: &SVector<f64, 2>| {
            let (a, b) = (1.0 - p[0], p[1] - p[0] * p[0]);
            let by = SVector::from([-2.0 * a - 400.0 * p[0] * b, 200.0 * b]);
            (p[0] > -3.0).then_some((a * a + 100.0 * b * b, by))
        };
        let (at, value) = minimise(SVector::from([-1.2, 1.0]), 200, 0.0, valley).unwrap();
        assert!(value < 1e-16 && (at - SVector::from([1.0, 1.0])).amax() < 1e-7);
        assert_eq!(minimise(SVector::from([-4.0, 1.0]), 200, 0.0, valley), None);
    }
}
