//! The calibration of a session: which model, which presses, and what a reader must know about it.

use rayon::prelude::*;
use skinrig_model::{
    AnalysisSettings, CalibrationModel, CameraId, PressRole, PressVerdict, StereoGeometry,
    ThresholdRule,
};

use super::crossval::{Folds, mean_difference};
use super::parameters::{MODELS, model_name, parameter_count};
use super::{Fit, affordable, different_places, error_lengths, root_mean_square, threshold};
use crate::input::SessionInput;
use crate::metrics::{bootstrap_over_locations, root_mean_square as rms, spread_mm};
use crate::result::{CalibrationResult, Estimate, ModelComparison, PressResult, ThresholdChoice};
use crate::sets::{CalibrationSet, Sight};
use crate::verdict;

/// Models whose cross-validated RMSE differs by less than this do equally well, mm: rounding, on noiseless data.
const NO_DIFFERENCE_MM: f64 = 1e-6;
/// A model that the protocol names is clearly worse when it loses by more than this many standard errors.
const CLEARLY_WORSE: f64 = 2.0;

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
        (ThresholdRule::Calibrated, Some(errors)) => {
            threshold::choose(set.sights(), errors, settings.min_cluster_events)
        }
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
/// `settings.calibration` names; of `Auto` the smallest within one standard error of the best.
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
        let choice = choice(sights, &contenders);
        let index = match wanted {
            CalibrationModel::Auto => choice.or_else(|| {
                let best = contenders.iter().rposition(Contender::is_determined)?;
                warnings.push(format!(
                    "too few calibrating places ({places}) to compare calibrations by cross-validation: `{}`, the \
                     largest that they determine, is used",
                    model_name(contenders[best].model)
                ));
                Some(best)
            }),
            _ => contenders.iter().position(|c| c.model == largest),
        };
        let used = index.map(|i| &contenders[i]);
        let Some((used, fit)) = used.and_then(|c| Some((c, c.fit.as_ref()?))) else {
            warnings.push(if largest == CalibrationModel::None {
                format!(
                    "{places} calibrating places are too few for any calibration: the nominal camera geometry is used"
                )
            } else {
                "the calibration found no plausible geometry: the nominal one is used".to_owned()
            });
            return Self::nominal(*nominal, warnings);
        };
        if let Some(better) = choice.map(|i| &contenders[i]) {
            warnings.extend(clearly_worse(sights, used, better));
        }
        let mut result = fit.result.clone();
        warnings.extend(concerns(&result, sights));
        if choice.is_some() {
            let row = |c: &Contender| c.row(sights, settings, c.model == used.model);
            result.compared = contenders.iter().map(row).collect();
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

    /// Standard error of the cross-validated RMSE over locations, mm.
    fn standard_error_mm(&self, sights: &[Sight]) -> Option<f64> {
        let errors = self.errors_mm.as_deref()?;
        let rmse = root_mean_square(errors);
        let none = vec![0.0; errors.len()];
        let (_, error) = mean_difference(&locations(sights), &squares(errors), &none);
        // The error of a root is that of the square over twice the root.
        error.map(|e| if rmse > 0.0 { e / (2.0 * rmse) } else { 0.0 })
    }

    fn row(&self, sights: &[Sight], settings: &AnalysisSettings, chosen: bool) -> ModelComparison {
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
            standard_error_mm: self.standard_error_mm(sights),
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

/// The smallest model whose cross-validated RMSE is within one standard error of the best one's: the
/// one-standard-error rule (Breiman, Friedman, Olshen and Stone 1984, section 3.4.3). The standard error is that of the
/// best model's own RMSE over locations, so that the rule can be checked on the table of the report.
fn choice(sights: &[Sight], contenders: &[Contender]) -> Option<usize> {
    let compared: Vec<(usize, f64)> = contenders
        .iter()
        .enumerate()
        .filter_map(|(i, c)| Some((i, root_mean_square(c.errors_mm.as_deref()?))))
        .collect();
    let (best, least) = *compared.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let error = contenders[best].standard_error_mm(sights).unwrap_or(0.0);
    let limit = least + error.max(NO_DIFFERENCE_MM);
    compared
        .iter()
        .find(|(_, rmse)| *rmse <= limit)
        .map(|(i, _)| *i)
}

/// By how many standard errors of the paired difference `a` is worse than `b`; `None` when there is no difference.
fn loses(sights: &[Sight], a: &Contender, b: &Contender) -> Option<f64> {
    let (one, two) = (a.errors_mm.as_deref()?, b.errors_mm.as_deref()?);
    if root_mean_square(one) - root_mean_square(two) <= NO_DIFFERENCE_MM {
        return None;
    }
    let (mean, error) = mean_difference(&locations(sights), &squares(one), &squares(two));
    error.map(|e| if e > 0.0 { mean / e } else { f64::INFINITY })
}

fn clearly_worse(sights: &[Sight], used: &Contender, better: &Contender) -> Option<String> {
    let sigmas = loses(sights, used, better).filter(|s| *s > CLEARLY_WORSE)?;
    let rmse = |c: &Contender| c.errors_mm.as_deref().map_or(f64::NAN, root_mean_square);
    Some(format!(
        "the calibration `{}` named by the protocol is clearly worse than `{}`: cross-validated RMSE {:.2} mm against \
         {:.2} mm, {sigmas:.0} standard errors apart",
        model_name(used.model),
        model_name(better.model),
        rmse(used),
        rmse(better)
    ))
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

fn squares(errors: &[f64]) -> Vec<f64> {
    errors.iter().map(|e| e * e).collect()
}
