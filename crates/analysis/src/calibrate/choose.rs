//! Owns the calibration of a session: choice of model and presses, and warnings about it.

use rayon::prelude::*;
use skinrig_model::{
    AnalysisSettings, CalibrationModel, CameraId, PressRole, StereoGeometry, ThresholdRule, Verdict,
};

use super::crossval::Folds;
use super::paired::{CHOICE, Difference, Losses, Step, select_model};
use super::parameters::{MODELS, parameter_count};
use super::{Fit, different_places, error_lengths, largest_supported, threshold};
use crate::distinct::distinct;
use crate::input::SessionInput;
use crate::metrics::{rms_over_locations, spread_mm};
use crate::result::{
    CalibrationResult, Estimate, ModelComparison, PairedTest, PressResult, ThresholdChoice,
    Warning, WarningCause,
};
use crate::sets::{CalibrationPress, CalibrationSet};
use crate::verdict;

/// Geometry for locating the presses of a session.
pub(crate) struct SessionCalibration {
    /// Geometry.
    pub geometry: StereoGeometry,
    /// How it was found; `None` for the nominal geometry.
    pub calibration: Option<CalibrationResult>,
    /// Threshold on cluster events, if one was chosen.
    pub threshold: Option<ThresholdChoice>,
}

/// Calibrates on the calibration presses. With [`ThresholdRule::Calibrated`] it first chooses the minimum number of cluster
/// events from cross-validated errors; presses of either role with fewer events get their verdict, and the calibration,
/// including the choice of the model, is repeated without them.
pub(crate) fn calibrate_session(
    input: &SessionInput,
    presses: &mut [PressResult],
    warnings: &mut Vec<Warning>,
) -> SessionCalibration {
    let settings = &input.settings;
    let nominal = &input.rig.nominal;
    let set = CalibrationSet::from_presses(presses);
    let mut chosen = choose(&set, nominal, settings);
    let threshold = match (settings.cluster_threshold, &chosen.errors_mm) {
        (ThresholdRule::Calibrated, Some(errors)) => threshold::choose(
            set.sights(),
            errors,
            settings.min_cluster_events,
            settings.seed,
        ),
        _ => None,
    };
    if let Some(choice) = &threshold {
        reject_presses(presses, choice.events);
        if choice.left_out > 0 {
            let kept = CalibrationSet::from_presses(presses);
            chosen = choose(&kept, nominal, settings);
        }
    }
    warnings.append(&mut chosen.warnings);
    SessionCalibration {
        geometry: chosen.geometry,
        calibration: chosen.calibration,
        threshold,
    }
}

/// Sets the verdict of valid presses of both roles with fewer cluster events than `threshold` in either camera.
pub(crate) fn reject_presses(presses: &mut [PressResult], threshold: u32) {
    let judged = |p: &&mut PressResult| p.role != PressRole::Sync && p.verdict == Verdict::Valid;
    for press in presses.iter_mut().filter(judged) {
        let views = press.views;
        let judgement = CameraId::ALL.into_iter().find_map(|camera| {
            let view = views[camera.index()].as_ref()?;
            verdict::too_few_cluster_events(view, threshold, camera)
        });
        if let Some(judgement) = judgement {
            verdict::put(press, judgement);
        }
    }
}

/// A calibration, and held-out errors of its presses.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelChoice {
    /// The nominal geometry if no calibration was possible.
    pub geometry: StereoGeometry,
    /// How it was found.
    pub calibration: Option<CalibrationResult>,
    /// In the order of the presses, mm; `None` without presses, or with too few locations for cross-validation.
    pub errors_mm: Option<Vec<f64>>,
    /// Warnings for the reader.
    pub warnings: Vec<Warning>,
}

/// Fits the nested models, compares them by leave-locations-out cross-validation, and selects the one in
/// `settings.calibration`; for `Auto` the smallest that no larger one beats significantly. If a model fails to fit, the next
/// smaller one replaces it with a warning; the nominal geometry is used only if all fail.
#[must_use]
pub fn choose(
    set: &CalibrationSet,
    nominal: &StereoGeometry,
    settings: &AnalysisSettings,
) -> ModelChoice {
    ModelChoice::for_set(set, nominal, settings)
}

impl ModelChoice {
    fn nominal(geometry: StereoGeometry, warnings: Vec<Warning>) -> Self {
        Self {
            geometry,
            calibration: None,
            errors_mm: None,
            warnings,
        }
    }

    fn for_set(
        set: &CalibrationSet,
        nominal: &StereoGeometry,
        settings: &AnalysisSettings,
    ) -> Self {
        let sights = set.sights();
        let wanted = settings.calibration;
        if wanted == CalibrationModel::None {
            return Self {
                errors_mm: (!sights.is_empty()).then(|| error_lengths(sights, nominal)),
                ..Self::nominal(*nominal, Vec::new())
            };
        }
        if sights.is_empty() {
            return Self::nominal(*nominal, vec![WarningCause::NoCalibrationPress.into()]);
        }
        let mut start = *nominal;
        for camera in &mut start.cameras {
            camera.lens = camera.lens.as_kind(settings.lens);
        }
        let places = different_places(sights);
        let largest = largest_supported(places, wanted);
        let mut warnings = Vec::new();
        let named = wanted != CalibrationModel::Auto;
        if named && largest != wanted && largest != CalibrationModel::None {
            let used = largest;
            warnings.push(WarningCause::FewLocationsForModel { wanted, used }.into());
        }
        let candidates = candidates(sights, &start, places, settings);
        let locations = locations(sights);
        let comparison = Comparison::of(&locations, &candidates);
        let index = match wanted {
            CalibrationModel::Auto => comparison.as_ref().map(|c| c.best).or_else(|| {
                let best = candidates.iter().rposition(ModelCandidate::is_determined)?;
                let cause = WarningCause::FewLocationsToCompare {
                    locations: places,
                    used: candidates[best].model,
                };
                warnings.push(cause.into());
                Some(best)
            }),
            _ => {
                let named = candidates.iter().position(|c| c.model == largest);
                let fitted = |i: &usize| candidates[*i].fit.is_some();
                let used = named.and_then(|named| (0..=named).rev().find(fitted));
                if let Some(used) = used.filter(|i| Some(*i) != named) {
                    let cause = WarningCause::ImplausibleModel {
                        wanted: largest,
                        used: candidates[used].model,
                    };
                    warnings.push(cause.into());
                }
                used
            }
        };
        let used = index.map(|i| &candidates[i]);
        let Some((used, fit)) = used.and_then(|c| Some((c, c.fit.as_ref()?))) else {
            let cause = if largest == CalibrationModel::None {
                WarningCause::FewLocationsForAny { locations: places }
            } else if candidates.iter().any(|c| c.fit.is_some()) {
                WarningCause::Undetermined
            } else {
                WarningCause::NoPlausibleGeometry
            };
            warnings.push(cause.into());
            return Self::nominal(*nominal, warnings);
        };
        if let Some(comparison) = comparison.as_ref().filter(|_| named) {
            warnings.extend(comparison.clearly_worse(used, &candidates[comparison.best]));
        }
        let mut result = fit.result.clone();
        warnings.extend(calibration_warnings(&result, sights));
        if let Some(comparison) = &comparison {
            let rows = candidates.iter().enumerate().map(|(i, contender)| {
                let test = comparison.test(i, &candidates);
                contender.row(sights, settings, contender.model == used.model, test)
            });
            result.compared = rows.collect();
            result.bound_mm = Some(comparison.losses.bound_mm());
        }
        Self {
            geometry: fit.geometry,
            calibration: Some(result),
            errors_mm: used.errors_mm.clone(),
            warnings,
        }
    }
}

/// A candidate model.
struct ModelCandidate {
    model: CalibrationModel,
    fit: Option<Fit>,
    /// Cross-validated error of each press, mm.
    errors_mm: Option<Vec<f64>>,
}

impl ModelCandidate {
    /// True if the data determine all its parameters.
    fn is_determined(&self) -> bool {
        self.fit
            .as_ref()
            .is_some_and(|f| f.result.rank as usize == parameter_count(self.model))
    }

    fn row(
        &self,
        sights: &[CalibrationPress],
        settings: &AnalysisSettings,
        chosen: bool,
        test: (Option<f64>, Option<PairedTest<CalibrationModel>>),
    ) -> ModelComparison {
        let errors = self.errors_mm.as_deref();
        let values: Vec<(u32, f64)> = errors.map_or_else(Vec::new, |errors| {
            let pairs = sights.iter().zip(errors);
            pairs.map(|(s, e)| (s.location, *e)).collect()
        });
        let rmse_mm: Estimate =
            rms_over_locations(&values, settings.bootstrap_resamples, settings.seed);
        ModelComparison {
            model: self.model,
            parameters: parameter_count(self.model) as u32,
            rmse_mm,
            bounded_rmse_mm: test.0,
            test: test.1,
            fitted_rmse_mm: self.fit.as_ref().map(|f| f.result.rmse_after_mm),
            chosen,
        }
    }
}

/// All nested models, fitted and cross-validated as far as the number of locations allows.
fn candidates(
    sights: &[CalibrationPress],
    start: &StereoGeometry,
    places: usize,
    settings: &AnalysisSettings,
) -> Vec<ModelCandidate> {
    let folds = Folds::deal(sights, settings.seed);
    MODELS
        .into_par_iter()
        .map(|model| {
            let count = parameter_count(model);
            let fit = (count <= places)
                .then(|| Fit::search(sights, start, model, settings.seed))
                .flatten();
            let mut contender = ModelCandidate {
                model,
                fit,
                errors_mm: None,
            };
            // Every fold needs as many distinct locations as parameters, like the whole set. If there are fewer positions
            // than locations, the folds have proportionally fewer.
            let doubles = distinct(locations(sights)).len().saturating_sub(places);
            if contender.is_determined()
                && count + doubles <= folds.least_kept()
                && let Some(fit) = &contender.fit
            {
                contender.errors_mm = folds.held_out_errors(sights, start, count, &fit.parameters);
            }
            contender
        })
        .collect()
}

/// Comparison of the candidates that could be validated.
struct Comparison<'a> {
    losses: Losses<'a>,
    /// The smallest that no larger one beats.
    best: usize,
    steps: Vec<Option<Step>>,
}

impl<'a> Comparison<'a> {
    /// `None` if no model could be validated.
    fn of(locations: &'a [u32], candidates: &[ModelCandidate]) -> Option<Self> {
        let errors: Vec<Option<&[f64]>> =
            candidates.iter().map(|c| c.errors_mm.as_deref()).collect();
        let losses = Losses::new(locations, errors.iter().flatten().copied());
        let (best, steps) = select_model(&losses, &errors, CHOICE)?;
        Some(Self {
            losses,
            best,
            steps,
        })
    }

    /// Bounded error of a candidate, and its comparison with the current one.
    fn test(
        &self,
        i: usize,
        candidates: &[ModelCandidate],
    ) -> (Option<f64>, Option<PairedTest<CalibrationModel>>) {
        let bounded = candidates[i].errors_mm.as_deref();
        let test = self.steps[i].map(|step| step.test(|at| candidates[at].model));
        (bounded.map(|e| self.losses.rms_mm(e)), test)
    }

    /// A warning if the model in use has a significantly larger error than `better`.
    fn clearly_worse(&self, used: &ModelCandidate, better: &ModelCandidate) -> Option<Warning> {
        let (a, b) = (used.errors_mm.as_deref()?, better.errors_mm.as_deref()?);
        let found: Difference = self.losses.clearly_worse(a, b)?;
        let cause = WarningCause::WorseModel {
            used: used.model,
            better: better.model,
            rmse_mm: self.losses.rms_mm(a),
            better_rmse_mm: self.losses.rms_mm(b),
            bound_mm: self.losses.bound_mm(),
            difference_mm: found.mm,
            standard_error_mm: found.standard_error_mm,
        };
        found.is_significant().then_some(cause.into())
    }
}

/// Warnings about a calibration.
fn calibration_warnings(result: &CalibrationResult, sights: &[CalibrationPress]) -> Vec<Warning> {
    let mut out = Vec::new();
    let parameters = result.names.len();
    if (result.rank as usize) < parameters {
        let open = result.names.iter().zip(&result.standard_errors);
        let open = open.filter(|(_, error)| error.is_none());
        out.push(WarningCause::OpenParameters {
            determined: result.rank,
            parameters,
            model: result.model,
            open: open.map(|(name, _)| name.clone()).collect(),
        });
    }
    if result.rmse_after_mm > result.rmse_before_mm {
        out.push(WarningCause::NoImprovement {
            before_mm: result.rmse_before_mm,
            after_mm: result.rmse_after_mm,
        });
    }
    let spread_mm = spread_mm(sights.iter().map(|s| s.truth));
    if sights.len() > 1 && result.rmse_after_mm >= spread_mm {
        out.push(WarningCause::NoBetterThanMean {
            rmse_mm: result.rmse_after_mm,
            spread_mm,
        });
    }
    out.into_iter().map(Warning::from).collect()
}

fn locations(sights: &[CalibrationPress]) -> Vec<u32> {
    sights.iter().map(|s| s.location).collect()
}
