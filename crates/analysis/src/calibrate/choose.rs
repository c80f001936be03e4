//! The calibration of a session: which model, which presses, and what a reader must know about it.

use rayon::prelude::*;
use skinrig_model::{
    AnalysisSettings, CalibrationModel, CameraId, PressRole, PressVerdict, StereoGeometry,
    ThresholdRule,
};

use super::crossval::Folds;
use super::paired::{Difference, Losses, Step, climb};
use super::parameters::{MODELS, model_name, parameter_count};
use super::{Fit, affordable, different_places, error_lengths, threshold};
use crate::input::SessionInput;
use crate::metrics::{bootstrap_over_locations, root_mean_square as rms, spread_mm};
use crate::result::{
    CalibrationResult, Estimate, ModelComparison, ModelTest, PressResult, ThresholdChoice,
};
use crate::sets::{CalibrationSet, Sight};
use crate::verdict;

/// What locates the presses of a session.
pub struct Calibrated {
    /// The geometry.
    pub geometry: StereoGeometry,
    /// How it was found; `None`: it is the nominal one.
    pub calibration: Option<CalibrationResult>,
    /// The threshold on cluster events, when one was chosen.
    pub threshold: Option<ThresholdChoice>,
}

/// Calibrates on the calibrating presses. With [`ThresholdRule::Calibrated`] the least number of cluster events is
/// chosen first, from cross-validated errors; presses of either role that have fewer get their verdict, and the
/// calibration - the choice of the model included - is done again without them.
pub fn calibrated(
    input: &SessionInput,
    presses: &mut [PressResult],
    warnings: &mut Vec<String>,
) -> Calibrated {
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
        leave_out(presses, choice.events);
        if choice.left_out > 0 {
            let kept = CalibrationSet::from_presses(presses);
            chosen = choose(&kept, nominal, settings);
        }
    }
    warnings.append(&mut chosen.warnings);
    Calibrated {
        geometry: chosen.geometry,
        calibration: chosen.calibration,
        threshold,
    }
}

/// The verdict on valid presses of both roles with fewer cluster events than `threshold` in either camera.
fn leave_out(presses: &mut [PressResult], threshold: u32) {
    let judged =
        |p: &&mut PressResult| p.role != PressRole::Sync && p.verdict == PressVerdict::Valid.name();
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

/// A calibration and the errors of its presses at a geometry that has not seen them.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// The geometry; the nominal one where no calibration was possible.
    pub geometry: StereoGeometry,
    /// How it was found.
    pub calibration: Option<CalibrationResult>,
    /// In the order of the presses, mm; `None` when there are none, or too few locations for cross-validation.
    pub errors_mm: Option<Vec<f64>>,
    /// What a reader must know.
    pub warnings: Vec<String>,
}

/// Fits the nested models to the set, compares them by leave-locations-out cross-validation and takes the one that
/// `settings.calibration` names; of `Auto` the smallest that no larger one beats by more than noise explains. When the fit
/// of a model fails the next smaller one that was fitted takes its place, and a warning says so; the nominal geometry
/// is used only when all fail.
#[must_use]
pub fn choose(
    set: &CalibrationSet,
    nominal: &StereoGeometry,
    settings: &AnalysisSettings,
) -> Chosen {
    Chosen::for_set(set, nominal, settings)
}

impl Chosen {
    fn nominal(geometry: StereoGeometry, warnings: Vec<String>) -> Self {
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
            let warning = "no usable calibrating press: the nominal camera geometry is used";
            return Self::nominal(*nominal, vec![warning.to_owned()]);
        }
        let mut start = *nominal;
        for camera in &mut start.cameras {
            camera.lens = camera.lens.as_kind(settings.lens);
        }
        let places = different_places(sights);
        let largest = affordable(places, wanted);
        let mut warnings = Vec::new();
        let named = wanted != CalibrationModel::Auto;
        if named && largest != wanted && largest != CalibrationModel::None {
            warnings.push(format!(
                "the calibrating presses touch too few places for the calibration `{}`: `{}` is used",
                model_name(wanted),
                model_name(largest)
            ));
        }
        let contenders = contenders(sights, &start, places, settings);
        let locations = locations(sights);
        let comparison = Comparison::of(&locations, &contenders);
        let index = match wanted {
            CalibrationModel::Auto => comparison.as_ref().map(|c| c.best).or_else(|| {
                let best = contenders.iter().rposition(Contender::is_determined)?;
                warnings.push(format!(
                    "too few calibrating places ({places}) to compare calibrations by cross-validation: `{}`, the \
                     largest that they determine, is used",
                    model_name(contenders[best].model)
                ));
                Some(best)
            }),
            _ => {
                let named = contenders.iter().position(|c| c.model == largest);
                let fitted = |i: &usize| contenders[*i].fit.is_some();
                let used = named.and_then(|named| (0..=named).rev().find(fitted));
                if let Some(used) = used.filter(|i| Some(*i) != named) {
                    warnings.push(format!(
                        "the fit of the calibration `{}` found no plausible geometry: `{}`, the largest smaller one that \
                         fits, is used",
                        model_name(largest),
                        model_name(contenders[used].model)
                    ));
                }
                used
            }
        };
        let used = index.map(|i| &contenders[i]);
        let Some((used, fit)) = used.and_then(|c| Some((c, c.fit.as_ref()?))) else {
            warnings.push(if largest == CalibrationModel::None {
                format!(
                    "{places} calibrating places are too few for any calibration: the nominal camera geometry is used"
                )
            } else if contenders.iter().any(|c| c.fit.is_some()) {
                "the calibrating presses determine no calibration: the nominal camera geometry is used"
                    .to_owned()
            } else {
                "no calibration found a plausible geometry: the nominal camera geometry is used"
                    .to_owned()
            });
            return Self::nominal(*nominal, warnings);
        };
        if let Some(comparison) = comparison.as_ref().filter(|_| named) {
            warnings.extend(comparison.clearly_worse(used, &contenders[comparison.best]));
        }
        let mut result = fit.result.clone();
        warnings.extend(concerns(&result, sights));
        if let Some(comparison) = &comparison {
            let rows = contenders.iter().enumerate().map(|(i, contender)| {
                let test = comparison.test(i, &contenders);
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

/// One of the nested models.
struct Contender {
    model: CalibrationModel,
    fit: Option<Fit>,
    /// Cross-validated error of each press, mm.
    errors_mm: Option<Vec<f64>>,
}

impl Contender {
    /// The data leave none of its parameters open.
    fn is_determined(&self) -> bool {
        self.fit
            .as_ref()
            .is_some_and(|f| f.result.rank as usize == parameter_count(self.model))
    }

    fn row(
        &self,
        sights: &[Sight],
        settings: &AnalysisSettings,
        chosen: bool,
        test: (Option<f64>, Option<ModelTest>),
    ) -> ModelComparison {
        let errors = self.errors_mm.as_deref();
        let values: Vec<(u32, f64)> = errors.map_or_else(Vec::new, |errors| {
            let pairs = sights.iter().zip(errors);
            pairs.map(|(s, e)| (s.location, *e)).collect()
        });
        let rmse_mm: Estimate =
            bootstrap_over_locations(&values, settings.bootstrap_resamples, settings.seed, rms);
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

/// All nested models, fitted and cross-validated as far as the number of places allows.
fn contenders(
    sights: &[Sight],
    start: &StereoGeometry,
    places: usize,
    settings: &AnalysisSettings,
) -> Vec<Contender> {
    let folds = Folds::deal(sights, settings.seed);
    MODELS
        .into_par_iter()
        .map(|model| {
            let count = parameter_count(model);
            let fit = (count <= places)
                .then(|| Fit::search(sights, start, model, settings.seed))
                .flatten();
            let mut contender = Contender {
                model,
                fit,
                errors_mm: None,
            };
            // In every fold as many different places as parameters, as for the whole; fewer positions than locations
            // are as many fewer in the folds.
            let doubles = locations_of(sights).saturating_sub(places);
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

/// The contenders that could be validated, compared.
struct Comparison<'a> {
    losses: Losses<'a>,
    /// The smallest that no larger one beats.
    best: usize,
    steps: Vec<Option<Step>>,
}

impl<'a> Comparison<'a> {
    /// `None` when no model could be validated.
    fn of(locations: &'a [u32], contenders: &[Contender]) -> Option<Self> {
        let errors: Vec<Option<&[f64]>> =
            contenders.iter().map(|c| c.errors_mm.as_deref()).collect();
        let losses = Losses::new(locations, errors.iter().flatten().copied());
        let (best, steps) = climb(&losses, &errors)?;
        Some(Self {
            losses,
            best,
            steps,
        })
    }

    /// Bounded error of a contender, and how it did against the one in hand.
    fn test(&self, i: usize, contenders: &[Contender]) -> (Option<f64>, Option<ModelTest>) {
        let bounded = contenders[i].errors_mm.as_deref();
        let test = self.steps[i].map(|step| ModelTest {
            against: contenders[step.against].model,
            gain_mm: step.difference.mm,
            standard_error_mm: step.difference.standard_error_mm,
            ratio: step.difference.ratio(),
            needed: step.difference.needed,
        });
        (bounded.map(|e| self.losses.rms_mm(e)), test)
    }

    /// Says so when the model that is used errs more than `better` by more than noise explains.
    fn clearly_worse(&self, used: &Contender, better: &Contender) -> Option<String> {
        let (a, b) = (used.errors_mm.as_deref()?, better.errors_mm.as_deref()?);
        let found: Difference = self.losses.clearly_worse(a, b)?;
        found.is_significant().then(|| {
            format!(
                "the calibration `{}` is clearly worse than `{}`: {:.2} mm against {:.2} mm at locations left out (errors \
                 bounded at {:.1} mm), a paired difference of {:.2} ± {:.2} mm (standard error)",
                model_name(used.model),
                model_name(better.model),
                self.losses.rms_mm(a),
                self.losses.rms_mm(b),
                self.losses.bound_mm(),
                found.mm,
                found.standard_error_mm
            )
        })
    }
}

/// What a reader must know about a calibration.
fn concerns(result: &CalibrationResult, sights: &[Sight]) -> Vec<String> {
    let mut out = Vec::new();
    let open: Vec<&str> = result
        .names
        .iter()
        .zip(&result.standard_errors)
        .filter(|(_, error)| error.is_none())
        .map(|(name, _)| name.as_str())
        .collect();
    let count = result.names.len();
    if (result.rank as usize) < count {
        out.push(format!(
            "the calibrating presses determine {} of the {count} parameters of the calibration `{}`: the values of {} \
             are one choice of many that fit equally well; calibrate at more places, spread over the skin",
            result.rank,
            model_name(result.model),
            open.join(", ")
        ));
    }
    if result.rmse_after_mm > result.rmse_before_mm {
        out.push(format!(
            "the calibration does not lower the error of its own presses ({:.2} mm before, {:.2} mm after): outliers \
             among them?",
            result.rmse_before_mm, result.rmse_after_mm
        ));
    }
    let spread = spread_mm(sights.iter().map(|s| s.truth));
    if sights.len() > 1 && result.rmse_after_mm >= spread {
        out.push(format!(
            "the calibrated geometry places its own presses no better than their mean would ({:.2} mm against \
             {spread:.2} mm): swapped cameras, another unit or a shifted order of presses?",
            result.rmse_after_mm
        ));
    }
    out
}

fn locations(sights: &[Sight]) -> Vec<u32> {
    sights.iter().map(|s| s.location).collect()
}

fn locations_of(sights: &[Sight]) -> usize {
    let mut all = locations(sights);
    all.sort_unstable();
    all.dedup();
    all.len()
}
