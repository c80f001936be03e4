//! Compares models by robust differences of their errors, paired by location.
//!
//! The errors of two models are compared press by press, so that common contributions (centroid noise, a bad location)
//! cancel. Squared errors are bounded (winsorised), so that a tenth of outliers neither hides a difference nor creates one.
//! The presses of a location count as one observation, because they share its systematic error.

use super::crossval::mean_difference;
use super::{MIN_BOUND_MM, RAYLEIGH_MEDIAN};
use crate::distinct::distinct;
use crate::result::PairedTest;
use skinrig_statistics::distributions::student_quantile;

/// Bound on errors in robust standard deviations of one coordinate. Four in a million normal errors exceed it.
const BOUND_SIGMAS: f64 = 5.0;
/// One-sided level of all comparisons of a choice together. High on purpose: too large a model costs about one percent of
/// the error, too small a model ten and more (`docs/adr/0022-*`).
pub(super) const CHOICE: f64 = 0.3;
/// One-sided level at which a model is called significantly worse than another.
const CLEARLY_WORSE: f64 = 0.025;
/// Smaller differences are rounding errors on noiseless data, mm.
const NO_DIFFERENCE_MM: f64 = 1e-6;

/// Difference between the errors of two models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Difference {
    /// Bounded root mean square error of the one minus that of the other, mm. Positive: the other is better.
    pub mm: f64,
    /// Its standard error over locations, mm.
    pub standard_error_mm: f64,
    /// Standard errors required for significance.
    pub needed: f64,
}

impl Difference {
    /// The difference in its standard errors.
    pub(crate) fn ratio(&self) -> f64 {
        if self.mm.abs() <= NO_DIFFERENCE_MM {
            0.0
        } else {
            self.mm / self.standard_error_mm
        }
    }

    /// True if the other model is significantly better.
    pub(crate) fn is_significant(&self) -> bool {
        self.ratio() > self.needed
    }
}

/// Bounded squared errors of presses at known locations.
pub(crate) struct Losses<'a> {
    locations: &'a [u32],
    bound_mm: f64,
}

impl<'a> Losses<'a> {
    /// `locations[i]` belongs to press i in each of the models' `errors_mm`. The bound is common to all models and comes
    /// from the one with the smallest median error.
    pub(crate) fn new<'b>(
        locations: &'a [u32],
        errors_mm: impl Iterator<Item = &'b [f64]>,
    ) -> Self {
        let median = |errors: &[f64]| {
            let mut sorted = errors.to_vec();
            sorted.sort_unstable_by(f64::total_cmp);
            sorted.get(sorted.len() / 2).copied()
        };
        let least = errors_mm.filter_map(median).fold(f64::INFINITY, f64::min);
        let sigma_mm = least / RAYLEIGH_MEDIAN;
        Self {
            locations,
            bound_mm: (BOUND_SIGMAS * sigma_mm).max(MIN_BOUND_MM),
        }
    }

    /// Bound on the errors, mm.
    pub(crate) const fn bound_mm(&self) -> f64 {
        self.bound_mm
    }

    fn squares(&self, errors_mm: &[f64]) -> Vec<f64> {
        let bounded = errors_mm.iter().map(|e| e.min(self.bound_mm));
        bounded.map(|e| e * e).collect()
    }

    /// Root mean square of the bounded errors, mm.
    pub(crate) fn rms_mm(&self, errors_mm: &[f64]) -> f64 {
        super::root_mean_square(
            &errors_mm
                .iter()
                .map(|e| e.min(self.bound_mm))
                .collect::<Vec<_>>(),
        )
    }

    /// Tests whether `a` has larger errors than `b`. `None` with fewer than two locations.
    pub(crate) fn clearly_worse(&self, a: &[f64], b: &[f64]) -> Option<Difference> {
        self.difference(a, b, CLEARLY_WORSE)
    }

    /// Error of `a` minus error of `b`.
    ///
    /// The mean difference of squares divided by the sum of the two roots is the difference of the roots; its standard error
    /// scales alike. The limit is Student's t with locations - 1 degrees of freedom.
    fn difference(&self, a: &[f64], b: &[f64], level: f64) -> Option<Difference> {
        let (mean, error) = mean_difference(self.locations, &self.squares(a), &self.squares(b));
        let roots = self.rms_mm(a) + self.rms_mm(b);
        let scaled = |mm2: f64| if roots > 0.0 { mm2 / roots } else { 0.0 };
        let places = distinct(self.locations);
        Some(Difference {
            mm: scaled(mean),
            standard_error_mm: scaled(error?),
            needed: student_quantile(1.0 - level, places.len() as f64 - 1.0),
        })
    }
}

/// Comparison of one model with the current one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// Index of the current model.
    pub against: usize,
    /// Error of the current model minus that of the candidate.
    pub difference: Difference,
}

impl Step {
    /// The comparison as part of a result; `name` gives the model at an index.
    pub(crate) fn test<T>(&self, name: impl FnOnce(usize) -> T) -> PairedTest<T> {
        PairedTest {
            against: name(self.against),
            gain_mm: self.difference.mm,
            standard_error_mm: self.difference.standard_error_mm,
            ratio: self.difference.ratio(),
            needed: self.difference.needed,
        }
    }
}

/// Chooses among nested models, smallest first: starting from the smallest, each larger one replaces the current one if its
/// errors are significantly smaller, at a one-sided `level` shared by all comparisons (Bonferroni). `errors_mm[i]`: held-out errors of
/// model i; `None` if it could not be validated. Returns the chosen model and, for each compared model, its comparison.
pub(crate) fn select_model(
    losses: &Losses<'_>,
    errors_mm: &[Option<&[f64]>],
    level: f64,
) -> Option<(usize, Vec<Option<Step>>)> {
    let mut steps = vec![None; errors_mm.len()];
    let comparisons = errors_mm.iter().flatten().count().saturating_sub(1);
    let level = level / comparisons.max(1) as f64;
    let mut validated = errors_mm.iter().enumerate();
    let (mut hand, mut least) = validated.find_map(|(i, e)| Some((i, (*e)?)))?;
    for (i, errors) in validated {
        let Some(errors) = errors else { continue };
        let Some(difference) = losses.difference(least, errors, level) else {
            continue;
        };
        steps[i] = Some(Step {
            against: hand,
            difference,
        });
        if difference.is_significant() {
            (hand, least) = (i, errors);
        }
    }
    Some((hand, steps))
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_statistics::seeded;

    fn errors(seed: u64, n: usize, mm: f64) -> Vec<f64> {
        let mut rng = seeded::generator(seed, 0);
        let mut normal = || (0..12).map(|_| seeded::signed_unit(&mut rng)).sum::<f64>() / 2.0;
        (0..n)
            .map(|_| mm * libm::hypot(normal(), normal()))
            .collect()
    }

    #[test]
    fn the_difference_is_that_of_the_roots_and_counts_locations() {
        let (a, b) = ([3.0, 4.0, 5.0, 4.0], [2.0, 3.0, 5.0, 3.0]);
        let once = Losses::new(&[0, 1, 2, 3], [&a[..], &b[..]].into_iter());
        let found = once.clearly_worse(&a, &b).unwrap();
        assert!((found.mm - (once.rms_mm(&a) - once.rms_mm(&b))).abs() < 1e-12);
        // Differences of squares 5, 7, 0, 7: mean 4.75, sample variance 10.9167.
        let roots = once.rms_mm(&a) + once.rms_mm(&b);
        assert!((found.standard_error_mm - (32.75f64 / 3.0 / 4.0).sqrt() / roots).abs() < 1e-12);
        // The same presses at the same locations twice add no information.
        let twice = |v: [f64; 4]| [v, v].concat();
        let places = [0, 1, 2, 3, 0, 1, 2, 3];
        let doubled = Losses::new(&places, [&twice(a)[..], &twice(b)[..]].into_iter());
        let both = doubled.clearly_worse(&twice(a), &twice(b)).unwrap();
        assert!((both.ratio() - found.ratio()).abs() < 1e-12 && both.needed == found.needed);
        assert_eq!(
            Losses::new(&[7, 7], [&a[..2]].into_iter()).clearly_worse(&a[..2], &b[..2]),
            None
        );
    }

    #[test]
    fn a_tenth_of_outliers_neither_hides_a_difference_nor_makes_one() {
        let n = 120;
        let places: Vec<u32> = (0..n as u32).collect();
        let (mut small, mut large) = (errors(1, n, 2.0), errors(1, n, 2.0));
        small.iter_mut().for_each(|e| *e *= 1.1);
        let ratio = |small: &[f64], large: &[f64]| {
            let losses = Losses::new(&places, [small, large].into_iter());
            losses.clearly_worse(small, large).unwrap().ratio()
        };
        assert!(ratio(&small, &large) > 4.0);
        // Distant outliers that the models place differently, in favour of the worse one.
        for i in (0..n).step_by(10) {
            (small[i], large[i]) = (60.0, 90.0);
        }
        assert!(ratio(&small, &large) > 4.0);
        let plain = |e: &[f64]| e.iter().map(|e| e * e).sum::<f64>();
        assert!(
            plain(&small) < plain(&large),
            "unbounded squares say the opposite"
        );
        let same = errors(1, n, 2.0);
        let mut other = same.clone();
        for i in (0..n).step_by(10) {
            other[i] = 120.0;
        }
        let mut third = other.clone();
        third[0] = 40.0;
        assert_eq!(ratio(&other, &third), 0.0);
    }

    #[test]
    fn the_climb_skips_a_step_that_alone_gains_nothing() {
        let n = 60;
        let places: Vec<u32> = (0..n as u32).collect();
        let noise = errors(3, n, 1.0);
        let times = |k: f64| noise.iter().map(|e| e * k).collect::<Vec<_>>();
        let (a, b, c) = (times(2.0), times(2.001), times(1.0));
        let climb_of = |list: &[Option<&[f64]>]| {
            let losses = Losses::new(&places, list.iter().flatten().copied());
            select_model(&losses, list, CHOICE)
        };
        let (chosen, steps) = climb_of(&[Some(&a), Some(&b), Some(&c), Some(&c)]).unwrap();
        assert_eq!(chosen, 2);
        let against: Vec<_> = steps.iter().map(|s| s.map(|s| s.against)).collect();
        assert_eq!(against, [None, Some(0), Some(0), Some(2)]);
        assert_eq!(steps[3].unwrap().difference.ratio(), 0.0);
        // A model that could not be validated is skipped.
        let (chosen, steps) = climb_of(&[None, Some(&a), None, Some(&c)]).unwrap();
        assert_eq!((chosen, steps[3].unwrap().against), (3, 1));
        assert_eq!(climb_of(&[None, None]), None);
    }
}
