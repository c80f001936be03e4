//! Leave-locations-out cross-validation: errors of presses at locations that a fit has not seen.

use rayon::prelude::*;
use skinrig_model::StereoGeometry;

use super::parameters::{Parameters, is_plausible, parameters_of, with_parameters};
use super::problem::Problem;
use super::solver::minimise;
use super::{best, error_lengths};
use crate::distinct::distinct;
use crate::sets::CalibrationPress;
use skinrig_statistics::seeded;

/// Number of folds; with fewer locations, each is a fold.
const FOLDS: usize = 10;
/// Random stream for dealing locations to folds; the starts of a calibration use small numbers.
const STREAM: u64 = 1 << 32;

/// Assignment of presses to folds: all presses of a location are held out together.
pub(crate) struct Folds {
    of_sight: Vec<usize>,
    count: usize,
    /// Locations outside the largest fold.
    least_kept: usize,
}

impl Folds {
    /// Deals the locations to folds of equal size, in an order drawn from `seed`.
    pub(crate) fn deal(sights: &[CalibrationPress], seed: u64) -> Self {
        let locations = distinct(sights.iter().map(|s| s.location));
        let n = locations.len();
        let count = FOLDS.min(n);
        let mut fold_of: Vec<usize> = (0..n).map(|i| i % count.max(1)).collect();
        let mut rng = seeded::generator(seed, STREAM);
        for i in (1..n).rev() {
            fold_of.swap(i, seeded::index(&mut rng, i + 1));
        }
        let of = |s: &CalibrationPress| {
            locations
                .binary_search(&s.location)
                .map_or(0, |i| fold_of[i])
        };
        Self {
            of_sight: sights.iter().map(of).collect(),
            count,
            least_kept: n - n.div_ceil(count.max(1)),
        }
    }

    /// One fold per repetition.
    pub(crate) fn by_repetition(sights: &[CalibrationPress]) -> Self {
        let repetitions = distinct(sights.iter().map(|s| s.repetition));
        let of = |s: &CalibrationPress| repetitions.binary_search(&s.repetition).unwrap_or(0);
        Self {
            of_sight: sights.iter().map(of).collect(),
            count: repetitions.len(),
            least_kept: repetitions.len().saturating_sub(1),
        }
    }

    /// Number of folds.
    pub(crate) const fn count(&self) -> usize {
        self.count
    }

    /// Smallest number of locations in any fit.
    pub(crate) fn least_kept(&self) -> usize {
        self.least_kept
    }

    /// Error length of each press, mm, with the geometry fitted to the other folds; `None` if one of these fits fails.
    ///
    /// Every fold starts from `start` and from `full`, the solution for all presses. `full` has seen the held-out presses,
    /// but only the fold's own presses decide between the two results and bound the last fit. On a noisy planted set the
    /// folds reach the same optimum as searches with all starts and without `full` (tested below).
    pub(crate) fn held_out_errors(
        &self,
        sights: &[CalibrationPress],
        start: &StereoGeometry,
        count: usize,
        full: &Parameters,
    ) -> Option<Vec<f64>> {
        self.each(|_, others, held| {
            let pick = |rows: &[usize]| rows.iter().map(|i| sights[*i]).collect::<Vec<_>>();
            let geometry = fitted(&pick(others), start, count, full)?;
            Some(error_lengths(&pick(held), &geometry))
        })
    }

    /// Indices of the presses in a fold, and of all others.
    pub(crate) fn split(&self, fold: usize) -> (Vec<usize>, Vec<usize>) {
        (0..self.of_sight.len()).partition(|i| self.of_sight[*i] == fold)
    }

    /// Calls `held_out(fold, others, held)` for every fold, which returns one value per held-out press, and returns the values
    /// in the order of the presses; `None` if a fold has none.
    pub(crate) fn each<T: Send>(
        &self,
        held_out: impl Fn(usize, &[usize], &[usize]) -> Option<Vec<T>> + Sync,
    ) -> Option<Vec<T>> {
        let folds: Vec<Option<Vec<T>>> = (0..self.count)
            .into_par_iter()
            .map(|fold| {
                let (held, others) = self.split(fold);
                held_out(fold, &others, &held)
            })
            .collect();
        let mut folds: Vec<_> = folds.into_iter().map(|f| f.map(Vec::into_iter)).collect();
        let next = |fold: &usize| folds[*fold].as_mut()?.next();
        self.of_sight.iter().map(next).collect()
    }
}

/// The geometry fitted to `sights`, from `start` and from the solution `full` for all presses.
pub(super) fn fitted(
    sights: &[CalibrationPress],
    start: &StereoGeometry,
    count: usize,
    full: &Parameters,
) -> Option<StereoGeometry> {
    if 2 * sights.len() < count {
        return None;
    }
    let problem = Problem::coarse(sights, start, count);
    let ends = [
        minimise(&problem, *full),
        problem.descend(parameters_of(start)),
    ];
    let coarse = best(&ends, start)?;
    let fine = problem.last_fit(coarse).1.parameters;
    is_plausible(start, &fine).then(|| with_parameters(start, &fine))
}

/// Mean of `a - b` over presses, and its standard error with whole locations as independent units (ratio estimator:
/// locations may have different numbers of presses); `None` with fewer than two locations.
pub(crate) fn mean_difference(locations: &[u32], a: &[f64], b: &[f64]) -> (f64, Option<f64>) {
    let mut rows: Vec<(u32, f64)> = locations
        .iter()
        .zip(a.iter().zip(b))
        .map(|(l, (a, b))| (*l, a - b))
        .collect();
    rows.sort_by_key(|r| r.0);
    let n = rows.len() as f64;
    let mean = rows.iter().map(|r| r.1).sum::<f64>() / n;
    let mut places = 0.0;
    let mut squares = 0.0;
    for group in rows.chunk_by(|a, b| a.0 == b.0) {
        let off: f64 = group.iter().map(|r| r.1 - mean).sum();
        squares += off * off;
        places += 1.0;
    }
    let error = (squares * places / (places - 1.0)).sqrt() / n;
    (mean, (places > 1.0).then_some(error))
}

#[cfg(test)]
mod tests {
    use skinrig_model::{Point2, PressId};

    use super::super::Fit;
    use super::super::parameters::{MODELS, parameter_count};
    use super::*;

    fn sample_presses() -> Vec<CalibrationPress> {
        let planted = StereoGeometry::paper_like([43.0, -33.0, 47.5, 38.0, -1.2, 0.4, -0.11, 0.03]);
        let mut noise = seeded::generator(5, 0);
        let mut out = Vec::new();
        for i in 0..60u32 {
            // 30 locations, each pressed twice.
            let truth = Point2::new(
                -15.0 + 9.0 * f64::from(i % 30 % 6),
                -18.0 + 9.0 * f64::from(i % 30 / 6),
            );
            let columns = planted
                .cameras
                .map(|c| c.column_of_point(truth).unwrap() + 3.0 * seeded::signed_unit(&mut noise));
            out.push(CalibrationPress {
                press: PressId::from_index(i),
                location: i % 30,
                repetition: 0,
                columns,
                spreads: [None; 2],
                truth,
                cluster_events: 100,
            });
        }
        out
    }

    #[test]
    fn locations_stay_together_and_folds_are_even() {
        let folds = Folds::deal(&sample_presses(), 3);
        assert_eq!((folds.count, folds.least_kept()), (10, 27));
        for i in 0..30 {
            assert_eq!(folds.of_sight[i], folds.of_sight[i + 30]);
        }
        for fold in 0..10 {
            assert_eq!(folds.of_sight.iter().filter(|f| **f == fold).count(), 6);
        }
        let few = Folds::deal(&sample_presses()[..7], 3);
        assert_eq!((few.count, few.least_kept()), (7, 6));
        assert_eq!(Folds::deal(&[], 3).count, 0);
    }

    /// If the fits saw the held-out location, a change of its truth would change its estimates.
    #[test]
    fn a_held_out_location_does_not_affect_its_own_error() {
        let start = StereoGeometry::PAPER;
        let mut sights = sample_presses();
        let folds = Folds::deal(&sights, 3);
        let errors = |sights: &[CalibrationPress]| {
            let problem = Problem::coarse(sights, &start, 8);
            let full = problem.descend(parameters_of(&start)).parameters;
            let geometry = |fold: usize| {
                let others: Vec<CalibrationPress> = (0..sights.len())
                    .filter(|i| folds.of_sight[*i] != fold)
                    .map(|i| sights[i])
                    .collect();
                fitted(&others, &start, 8, &full).unwrap()
            };
            let held = folds.held_out_errors(sights, &start, 8, &full).unwrap();
            (held, geometry(folds.of_sight[11]))
        };
        let (before, geometry) = errors(&sights);
        for i in [11, 41] {
            sights[i].truth.x_mm += 6.0;
        }
        let (after, same) = errors(&sights);
        for (a, b) in geometry.cameras.iter().zip(&same.cameras) {
            assert!(a.position.distance_mm(b.position) < 1e-6);
        }
        for i in [11, 41] {
            let expected = error_lengths(&sights[i..=i], &geometry)[0];
            assert!((after[i] - expected).abs() < 1e-6);
            assert!((after[i] - before[i]).abs() > 1.0);
        }
        // The others do use it.
        assert!((0..60).any(|i| i % 30 != 11 && (after[i] - before[i]).abs() > 0.01));
    }

    /// The two descents of a fold find the same optimum as the search with all starts.
    #[test]
    fn folds_converge_to_the_full_search() {
        let start = StereoGeometry::PAPER;
        let mut sights = sample_presses();
        // A distant press, so that the bounds of the fits matter.
        sights[17].columns[0] += 60.0;
        let folds = Folds::deal(&sights, 3);
        for model in MODELS {
            let count = parameter_count(model);
            let full = Fit::search(&sights, &start, model, 1).unwrap().parameters;
            let held = folds
                .held_out_errors(&sights, &start, count, &full)
                .unwrap();
            for fold in 0..folds.count {
                let (out, others): (Vec<_>, Vec<_>) =
                    (0..sights.len()).partition(|i| folds.of_sight[*i] == fold);
                let pick = |rows: &[usize]| rows.iter().map(|i| sights[*i]).collect::<Vec<_>>();
                let searched = Fit::search(&pick(&others), &start, model, 1).unwrap();
                let expected = error_lengths(&pick(&out), &searched.geometry);
                for (i, expected) in out.into_iter().zip(expected) {
                    let off = (held[i] - expected).abs();
                    assert!(off < 1e-6, "{model:?}, press {i}: {off} mm");
                }
            }
        }
    }

    #[test]
    fn the_error_of_a_mean_counts_locations_not_presses() {
        let zero = [0.0; 8];
        let once = mean_difference(&[0, 1, 2, 3], &[1.0, 2.0, 3.0, 6.0], &zero[..4]);
        let spread = (4.0f64 + 1.0 + 0.0 + 9.0) / 3.0;
        assert_eq!(once.0, 3.0);
        assert!((once.1.unwrap() - (spread / 4.0).sqrt()).abs() < 1e-12);
        let twice = [1.0, 2.0, 3.0, 6.0, 1.0, 2.0, 3.0, 6.0];
        let both = mean_difference(&[0, 1, 2, 3, 0, 1, 2, 3], &twice, &zero);
        assert_eq!(both, once);
        assert_eq!(mean_difference(&[7, 7], &[1.0, 2.0], &zero[..2]).1, None);
    }
}
