//! Damped least squares (Levenberg 1944, Marquardt 1963) on normal equations with at most ten unknowns.
//!
//! Each step solves `(JᵀJ + lambda D) delta = -Jᵀr` with D the largest diagonal of JᵀJ so far (Moré 1978), which makes it
//! independent of the parameters' units; lambda follows the gain ratio (Nielsen 1999). Normal equations square the condition
//! number, which is harmless here: gradient and cost are exact whatever the step, so only the speed of the last digits
//! suffers. Parameter errors come from the Jacobian itself (`uncertainty`).

use nalgebra::Cholesky;

use super::parameters::{PARAMETERS, Parameters};
use super::problem::{NormalEquations, Problem};
use crate::result::Termination;

/// Maximum number of steps.
const MAX_STEPS: usize = 200;
/// Initial damping, relative to D.
const FIRST_DAMPING: f64 = 1e-3;
/// Smallest and largest damping.
const DAMPING: (f64, f64) = (1e-14, 1e16);
/// Converged: the cosine between residuals and each column of the Jacobian is at most this.
const FLAT: f64 = 1e-10;
/// At most this many steps of [`polish`], their damping, the share of the squared gradient that a step may leave, and the share of
/// the cost that is rounding.
const POLISHING: usize = 10;
const POLISHING_DAMPING: f64 = 1e-12;
const SHRINKS: f64 = 0.25;
const ROUNDING: f64 = 1e-10;
/// A step is accepted if it lowers the cost by at least this share of its prediction.
const MIN_GAIN_RATIO: f64 = 1e-4;

/// Result of a descent.
pub(super) struct Descent {
    pub parameters: Parameters,
    pub cost: f64,
    /// Why it ended.
    pub termination: Termination,
}

/// Minimises from `from`.
pub(crate) fn minimise(problem: &Problem<'_>, from: Parameters) -> Descent {
    let mut at = from;
    let mut current = problem.normal(&at);
    let mut scale = Parameters::repeat(0.0);
    let (mut damping, mut growth) = (FIRST_DAMPING, 2.0);
    let ended = |parameters, cost, termination| Descent {
        parameters,
        cost,
        termination,
    };
    for _ in 0..MAX_STEPS {
        if !current.cost.is_finite() {
            return ended(at, current.cost, Termination::NotANumber);
        }
        if is_flat(&current, problem.count) {
            return ended(at, current.cost, Termination::ZeroGradient);
        }
        for i in 0..PARAMETERS {
            scale[i] = scale[i].max(current.matrix[(i, i)]);
        }
        let Some(step) = step(&current, &scale, damping) else {
            damping *= growth;
            growth *= 2.0;
            if damping > DAMPING.1 {
                return ended(at, current.cost, Termination::NoStep);
            }
            continue;
        };
        let promised =
            damping * step.component_mul(&step).dot(&scale) - step.dot(&current.gradient);
        if promised <= problem.tolerance * current.cost {
            return ended(at, current.cost, Termination::NoChange);
        }
        let there = at + step;
        let next = problem.normal(&there);
        let ratio = (current.cost - next.cost) / promised;
        if ratio > MIN_GAIN_RATIO {
            (at, current) = (there, next);
            let slack = 2.0 * ratio - 1.0;
            damping = (damping * (1.0 - slack * slack * slack).max(1.0 / 3.0)).max(DAMPING.0);
            growth = 2.0;
        } else {
            damping *= growth;
            growth *= 2.0;
            if damping > DAMPING.1 {
                return ended(at, current.cost, Termination::FloatingPoint);
            }
        }
    }
    ended(at, current.cost, Termination::TooManySteps)
}

/// Takes steps that the cost is too coarse to judge, as long as they shrink the gradient, which still has digits there, and do not
/// raise the cost by more than its rounding. The small damping matters only in directions that the data do not determine; there it
/// keeps the steps short.
pub(super) fn polish(problem: &Problem<'_>, from: Parameters) -> Parameters {
    let mut at = from;
    let mut current = problem.normal(&at);
    let scale = current.matrix.diagonal();
    for _ in 0..POLISHING {
        let Some(step) = step(&current, &scale, POLISHING_DAMPING) else {
            break;
        };
        let there = at + step;
        let next = problem.normal(&there);
        let steepness = |n: &NormalEquations| {
            let each = (0..problem.count).map(|i| n.gradient[i] * n.gradient[i] / scale[i]);
            each.filter(|s| s.is_finite()).fold(0.0, f64::max)
        };
        let is_no_higher = next.cost <= current.cost * (1.0 + ROUNDING);
        if !is_no_higher || steepness(&next) > SHRINKS * steepness(&current) {
            break;
        }
        (at, current) = (there, next);
    }
    at
}

fn is_flat(current: &NormalEquations, count: usize) -> bool {
    (0..count).all(|i| {
        let slope = current.gradient[i];
        slope * slope <= FLAT * FLAT * current.matrix[(i, i)] * current.cost
    })
}

fn step(current: &NormalEquations, scale: &Parameters, damping: f64) -> Option<Parameters> {
    let mut matrix = current.matrix;
    for i in 0..PARAMETERS {
        // A parameter without any effect (or beyond the model's) stays where it is.
        matrix[(i, i)] += if scale[i] > 0.0 {
            damping * scale[i]
        } else {
            1.0
        };
    }
    let step = -Cholesky::new(matrix)?.solve(&current.gradient);
    step.iter().all(|v| v.is_finite()).then_some(step)
}

#[cfg(test)]
mod tests {
    use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
    use nalgebra::storage::Owned;
    use nalgebra::{DMatrix, DVector, Dyn};
    use skinrig_model::{Point2, PressId, StereoGeometry};

    use super::super::parameters::parameters_of;
    use super::super::problem::Measure;
    use super::*;
    use crate::sets::CalibrationPress;
    use skinrig_statistics::seeded;

    /// The same problem for a library's orthogonal (QR) solver.
    struct Reference<'a>(Problem<'a>, Parameters);

    impl LeastSquaresProblem<f64, Dyn, Dyn> for Reference<'_> {
        type ResidualStorage = Owned<f64, Dyn>;
        type JacobianStorage = Owned<f64, Dyn, Dyn>;
        type ParameterStorage = Owned<f64, Dyn>;

        fn set_params(&mut self, x: &DVector<f64>) {
            self.1.rows_mut(0, self.0.count).copy_from(x);
        }
        fn params(&self) -> DVector<f64> {
            self.1.rows(0, self.0.count).into_owned()
        }
        fn residuals(&self) -> Option<DVector<f64>> {
            Some(self.0.rows(&self.1).0)
        }
        fn jacobian(&self) -> Option<DMatrix<f64>> {
            Some(self.0.rows(&self.1).1)
        }
    }

    #[test]
    fn it_converges_to_the_orthogonal_solution() {
        let planted = StereoGeometry::paper_like([43.0, -33.0, 47.5, 38.0, -1.2, 0.4, -0.11, 0.03]);
        let mut noise = seeded::generator(2, 0);
        let sights: Vec<CalibrationPress> = (0..80u32)
            .map(|i| {
                let at = [
                    -20.0 + 6.0 * f64::from(i % 10),
                    -20.0 + 6.0 * f64::from(i / 10),
                ];
                let truth = Point2::new(at[0], at[1]);
                let column = |c: skinrig_model::CameraModel| c.column_of_point(truth).unwrap();
                CalibrationPress {
                    press: PressId::from_index(i),
                    location: i,
                    repetition: 0,
                    columns: planted
                        .cameras
                        .map(|c| column(c) + 6.0 * seeded::signed_unit(&mut noise)),
                    spreads: [None; 2],
                    truth,
                    cluster_events: 100,
                }
            })
            .collect();
        let base = StereoGeometry::PAPER;
        let (error, arc) = (Measure::Error, Measure::Arc);
        for (count, measure, bound_mm) in [
            (4, error, 25.0),
            (6, error, 5.0),
            (8, error, 25.0),
            (10, error, 25.0),
            (10, arc, 5.0),
        ] {
            let problem = Problem {
                sights: &sights,
                base: &base,
                count,
                measure,
                bound_mm,
                tolerance: 1e-15,
            };
            let start = parameters_of(&base);
            let ours = minimise(&problem, start);
            let (theirs, _) = LevenbergMarquardt::new().minimize(Reference(problem, start));
            let cost = theirs.0.normal(&theirs.1).cost;
            assert!(ours.termination.is_converged(), "{:?}", ours.termination);
            assert!(
                (ours.cost - cost).abs() < 1e-10 * cost,
                "{count}: {} {cost}",
                ours.cost
            );
            for p in 0..PARAMETERS {
                let off = (ours.parameters[p] - theirs.1[p]).abs();
                assert!(off < 1e-4, "{count} parameters, number {p}: {off}");
                assert!(p < count || ours.parameters[p] == start[p]);
            }
        }
    }
}
