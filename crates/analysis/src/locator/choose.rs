//! Owns the choice of a locator: cross-validation over locations, paired comparison, regions.

use rayon::prelude::*;
use skinrig_model::{AnalysisSettings, CalibrationModel, Locator, StereoGeometry};

use super::methods::{Feature, FitStart, Hyperparameters, METHODS, Method, method};
use super::parts::Parts;
use super::regions::{HeldOutError, Regions};
use super::spread::SpreadFits;
use super::{Features, FitError, FittedLocator};
use crate::calibrate::{Folds, Losses, NO_FIX_ERROR_MM, Refit, SessionCalibration, covariance};
use crate::calibrate::{root_mean_square, select_model};
use crate::distinct::distinct;
use crate::metrics::rms_over_locations;
use crate::result::{
    CalibrationResult, LocatorComparison, LocatorFallback, LocatorResult, Warning, WarningCause,
};
use crate::sets::CalibrationSet;

/// One-sided level of all comparisons of a choice together: another locator has to be better than the geometry beyond
/// reasonable doubt, because it is more to trust (`docs/adr/0038-*`).
const CHOICE: f64 = 0.1;

/// How much to learn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Effort {
    /// Compare locators and find regions.
    Full,
    /// Positions alone, with the named locator.
    Positions,
}

/// A locator, and how it was chosen.
#[derive(Debug, Clone)]
pub struct LocatorChoice {
    /// The locator.
    pub fitted: FittedLocator,
    /// How it was chosen; without reliability.
    pub result: LocatorResult,
    /// Warnings for the reader.
    pub warnings: Vec<Warning>,
}

/// Compares the methods on `set` and returns the one in `settings.locator`; for `Auto` the geometry, unless another one is
/// significantly better at held-out locations. `geometry` and `calibration` come from the same presses.
#[must_use]
pub fn choose_locator(
    set: &CalibrationSet,
    geometry: &StereoGeometry,
    calibration: Option<&CalibrationResult>,
    settings: &AnalysisSettings,
) -> Option<LocatorChoice> {
    Learner::new(set, geometry, calibration, settings).choose(Effort::Full)
}

/// Errors of each press of `set`, estimate minus truth, mm, with `locator` fitted to the other locations; `None` for a press
/// without position. `None` as a whole if there are too few locations. `geometry` and `calibration` come from the same
/// presses.
#[must_use]
pub fn held_out_errors(
    set: &CalibrationSet,
    geometry: &StereoGeometry,
    calibration: Option<&CalibrationResult>,
    settings: &AnalysisSettings,
    locator: Locator,
) -> Option<Vec<Option<[f64; 2]>>> {
    let learner = Learner::new(set, geometry, calibration, settings);
    let candidates = learner.candidates(vec![method(locator)], Effort::Full);
    let held = candidates.into_iter().next()?.held_out?;
    Some(held.into_iter().map(|h| h.error).collect())
}

/// [`choose_locator`] for a calibrated session. `None` never happens with a geometry that the analysis accepts.
pub(crate) fn choose(
    set: &CalibrationSet,
    calibrated: &SessionCalibration,
    settings: &AnalysisSettings,
    effort: Effort,
) -> Option<LocatorChoice> {
    let calibration = calibrated.calibration.as_ref();
    Learner::new(set, &calibrated.geometry, calibration, settings).choose(effort)
}

/// A method on the whole set, and on parts of it.
struct Candidate {
    method: &'static dyn Method,
    fit: Result<(FittedLocator, Option<Hyperparameters>), FitError>,
    /// Result of each press at held-out locations.
    held_out: Option<Vec<HeldOutResult>>,
    /// Errors in held-out repetitions, mm.
    over_repetitions: Option<Vec<f64>>,
}

#[derive(Debug, Clone)]
struct HeldOutResult {
    /// Estimate minus truth, mm; `None` without a position.
    error: Option<[f64; 2]>,
    error_mm: f64,
    /// `None` without a position, or if the locator has no error model.
    reached: Option<HeldOutError>,
}

impl Candidate {
    fn errors_mm(&self) -> Option<Vec<f64>> {
        let held = self.held_out.as_ref()?;
        Some(held.iter().map(|h| h.error_mm).collect())
    }
}

struct Learner<'a> {
    set: &'a CalibrationSet,
    settings: &'a AnalysisSettings,
    start: FitStart<'a>,
    refit: Option<Refit>,
    parameters: usize,
    locations: Vec<u32>,
}

impl<'a> Learner<'a> {
    fn new(
        set: &'a CalibrationSet,
        geometry: &StereoGeometry,
        calibration: Option<&CalibrationResult>,
        settings: &'a AnalysisSettings,
    ) -> Self {
        Self {
            set,
            settings,
            start: FitStart {
                geometry: *geometry,
                covariance: calibration.and_then(covariance),
                near: None,
                spreads: None,
            },
            refit: calibration.map(Refit::new),
            parameters: calibration.map_or(0, |c| c.values.len()),
            locations: set.sights().iter().map(|s| s.location).collect(),
        }
    }

    fn distinct_locations(&self) -> usize {
        distinct(&self.locations).len()
    }

    fn choose(&self, effort: Effort) -> Option<LocatorChoice> {
        let wanted = self.settings.locator;
        let learns = wanted != Locator::Auto || self.settings.calibration != CalibrationModel::None;
        let methods: Vec<&'static dyn Method> = METHODS
            .into_iter()
            .filter(|m| match (m.locator(), wanted) {
                (Locator::Geometry, _) => true,
                (_, Locator::Auto) => learns && effort == Effort::Full,
                (own, named) => own == named,
            })
            .collect();
        let candidates = self.candidates(methods, effort);
        let errors: Vec<Option<Vec<f64>>> = candidates.iter().map(Candidate::errors_mm).collect();
        let slices: Vec<Option<&[f64]>> = errors.iter().map(Option::as_deref).collect();
        let losses = Losses::new(&self.locations, slices.iter().flatten().copied());
        // The geometry is the first: without its errors there is nothing to compare with.
        let compared = slices.first().copied().flatten();
        let (best, steps) = compared
            .and_then(|_| select_model(&losses, &slices, CHOICE))
            .unwrap_or((0, vec![None; candidates.len()]));
        let named = candidates.iter().position(|c| c.method.locator() == wanted);
        let (mut used, mut fallback) = match (wanted, named) {
            (Locator::Auto, _) => (best, self.why_geometry(&candidates, best, learns)),
            (_, Some(named)) => (named, None),
            (_, None) => (0, None),
        };
        let mut warnings = Vec::new();
        if let Err(unfit) = &candidates[used].fit {
            let (wanted, why) = (candidates[used].method.locator(), *unfit);
            (used, fallback) = (0, Some(LocatorFallback::CannotLearn { wanted, why }));
            warnings.push(WarningCause::LocatorUnfit { wanted, why }.into());
        }
        let rows = candidates.iter().enumerate().map(|(i, candidate)| {
            let errors = errors[i].as_deref();
            let pairs = errors.map_or_else(Vec::new, |errors| {
                let pairs = self.locations.iter().zip(errors);
                pairs.map(|(l, e)| (*l, *e)).collect::<Vec<_>>()
            });
            let (resamples, seed) = (self.settings.bootstrap_resamples, self.settings.seed);
            LocatorComparison {
                locator: candidate.method.locator(),
                rmse_mm: rms_over_locations(&pairs, resamples, seed),
                bounded_rmse_mm: errors.map(|e| losses.rms_mm(e)),
                over_repetitions_mm: candidate.over_repetitions.as_deref().map(root_mean_square),
                test: steps[i].map(|step| step.test(|at| candidates[at].method.locator())),
                unfit: candidate.fit.as_ref().err().copied(),
                chosen: i == used,
            }
        });
        let compared: Vec<LocatorComparison> = match effort {
            Effort::Full if compared.is_some() => rows.collect(),
            _ => Vec::new(),
        };
        let bound_mm = (!compared.is_empty()).then(|| losses.bound_mm());
        let candidate = candidates.into_iter().nth(used)?;
        let held = candidate.held_out.unwrap_or_default();
        let reached: Vec<HeldOutError> = held.into_iter().filter_map(|h| h.reached).collect();
        let regions = Regions::from_held_out(&reached, self.distinct_locations());
        let fitted = candidate.fit.ok()?.0.with_regions(regions);
        Some(LocatorChoice {
            result: LocatorResult {
                locator: fitted.locator(),
                version: candidate.method.version(),
                fallback,
                compared,
                bound_mm,
                model: fitted.model().clone(),
                reliability: Vec::new(),
            },
            fitted,
            warnings,
        })
    }

    /// Why an automatic choice ends at the geometry, if it does.
    fn why_geometry(
        &self,
        candidates: &[Candidate],
        best: usize,
        learns: bool,
    ) -> Option<LocatorFallback> {
        if best > 0 {
            return None;
        }
        Some(if !learns {
            LocatorFallback::NominalGeometry
        } else if candidates[0].held_out.is_none() {
            LocatorFallback::FewLocations {
                locations: self.distinct_locations(),
            }
        } else if candidates.iter().skip(1).all(|c| c.held_out.is_none()) {
            let mut unfit = candidates.iter().filter_map(|c| c.fit.as_ref().err());
            LocatorFallback::NoneCompared {
                why: unfit.next().copied(),
            }
        } else {
            LocatorFallback::NoneBetter
        })
    }

    /// Fits all methods, with cross-validations if there is the effort for them.
    fn candidates(&self, methods: Vec<&'static dyn Method>, effort: Effort) -> Vec<Candidate> {
        let reads_spreads = |m: &&dyn Method| m.needs().features.contains(&Feature::Spreads);
        let spreads = methods
            .iter()
            .any(reads_spreads)
            .then(|| SpreadFits::learn(self.set.sights(), None));
        let spreads = spreads.as_ref();
        let [over_locations, over_repetitions] = match effort {
            Effort::Full => self.cross_validations(spreads),
            Effort::Positions => [None, None],
        };
        let start = FitStart {
            spreads,
            ..self.start.clone()
        };
        methods
            .into_par_iter()
            .map(|method| {
                let fit = method.fit(self.set, &start);
                let near = fit.as_ref().map(|(_, near)| near.as_ref());
                let held_out = |parts: &Option<Parts>| {
                    let near = near.ok()?;
                    self.held_out(method, parts.as_ref()?, near)
                };
                Candidate {
                    method,
                    held_out: held_out(&over_locations),
                    over_repetitions: held_out(&over_repetitions)
                        .map(|held| held.iter().map(|h| h.error_mm).collect()),
                    fit,
                }
            })
            .collect()
    }

    /// Over locations and over repetitions; `None` if there are too few.
    fn cross_validations(&self, spreads: Option<&SpreadFits>) -> [Option<Parts>; 2] {
        let geometry = |part: &CalibrationSet| match &self.refit {
            Some(refit) => refit.geometry(part),
            None => Some(self.start.geometry),
        };
        let parts = |folds: Folds| Parts::new(folds, self.set, geometry, spreads);
        let locations = Folds::deal(self.set.sights(), self.settings.seed);
        let enough = locations.count() > 1 && self.parameters <= locations.least_kept();
        let repetitions = Folds::by_repetition(self.set.sights());
        let repeated = repetitions.count() > 1;
        [
            enough.then(|| parts(locations)),
            repeated.then(|| parts(repetitions)),
        ]
    }

    /// Every press located by fits of everything, geometry and hyperparameters included, to the other folds.
    fn held_out(
        &self,
        method: &dyn Method,
        parts: &Parts,
        near: Option<&Hyperparameters>,
    ) -> Option<Vec<HeldOutResult>> {
        let presses = self.set.sights();
        parts.each(|part, held| {
            let start = FitStart {
                geometry: part.geometry?,
                near,
                spreads: part.spreads.as_ref(),
                ..self.start.clone()
            };
            let (fitted, _) = method.fit(&part.presses, &start).ok()?;
            let of = |i: &usize| {
                let press = &presses[*i];
                let lost = HeldOutResult {
                    error: None,
                    error_mm: NO_FIX_ERROR_MM,
                    reached: None,
                };
                let features = Features {
                    columns: press.columns,
                    spreads: press.spreads,
                    cluster_events: press.cluster_events,
                };
                let Some(prediction) = fitted.predict(&features) else {
                    return lost;
                };
                let [x, y] = prediction.at;
                let error = [x - press.truth.x_mm, y - press.truth.y_mm];
                let reached = prediction.uncertainty;
                let reached = reached.map(|uncertainty| HeldOutError { uncertainty, error });
                HeldOutResult {
                    error: Some(error),
                    error_mm: libm::hypot(error[0], error[1]).min(NO_FIX_ERROR_MM),
                    reached,
                }
            };
            Some(held.iter().map(of).collect())
        })
    }
}
