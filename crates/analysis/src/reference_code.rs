//! The public code's evaluation, computed with exact intersections.
//!
//! It evaluates the calibration presses themselves (the first repetition, whatever their role here), drops estimates outside
//! the enclosing square without counting them, and reports the spread of the error lengths as population standard deviation
//! (numpy's default). Its data reduction keeps max(1, n / k) events of each press, clusters with a core threshold of one
//! event, so that the centroid is the mean of all remaining events, drops no estimate, and lets a press without an estimate
//! count with the largest error at that factor, which can be a pass. The rate with such presses failing is reported beside
//! it. Rays that meet behind a camera have no estimate here.

use skinrig_model::{
    CalibrationModel, CentroidRule, LensKind, PressRole, PressVerdict, RepetitionId, StereoGeometry,
};

use crate::background::CoreThreshold;
use crate::calibrate::calibrate;
use crate::input::SessionInput;
use crate::locator::FittedLocator;
use crate::metrics::{mean, quantile, root_mean_square};
use crate::press_events::RetainedPresses;
use crate::reduction::{Attempt, Outcome, Trials};
use crate::result::{
    Analysis, CalibrationResult, LocationOutcome, PressResult, ReferenceCode, ReferenceReduction,
    Thinning,
};
use crate::sets::CalibrationSet;
use crate::triangulate::locate;

/// Core threshold of the published data reduction, events.
const MIN_SAMPLES: u32 = 1;
/// Error of a press without an estimate if no press has one, mm.
const ERROR_OF_NOTHING_MM: f64 = 1.0;

/// The published numbers for an analysed session. `retained` holds the presses of the first repetition, including calibration
/// presses; without them there is no data reduction.
#[must_use]
pub fn reference_code(
    input: &SessionInput,
    analysis: &Analysis,
    retained: &RetainedPresses,
) -> ReferenceCode {
    let mut presses = used(input, analysis);
    let (geometry, fit) = calibrated_on_all(input, &mut presses);
    for press in &mut presses {
        press.location_outcome = locate(&geometry, &analysis.rig.outline, columns(press));
    }
    let judged: Vec<&PressResult> = presses
        .iter()
        .filter(|p| !is_left_out_by_hand(p, analysis))
        .collect();
    let with_centroids = judged
        .iter()
        .filter(|p| columns(p).iter().all(Option::is_some));
    let inside = judged.iter().filter_map(|p| {
        let in_square = analysis.rig.outline.box_contains(p.estimate()?);
        p.error_mm().filter(|_| in_square)
    });
    let (mut x, mut y): (Vec<f64>, Vec<f64>) = inside.unzip();
    let mut lengths: Vec<f64> = x.iter().zip(&y).map(|(x, y)| libm::hypot(*x, *y)).collect();
    ReferenceCode {
        presses: judged.len() as u32,
        calibrated: fit.is_some(),
        parameters: fit.map_or_else(Vec::new, |f| f.names.into_iter().zip(f.values).collect()),
        with_centroids: with_centroids.count() as u32,
        inside: lengths.len() as u32,
        std_of_errors_mm: population_std(&lengths),
        rmse_mm: root_mean_square(&mut lengths),
        rmse_x_mm: root_mean_square(&mut x),
        rmse_y_mm: root_mean_square(&mut y),
        reduction: reduction(analysis, &geometry, &presses, retained),
    }
}

/// Presses of the first repetition that were executed as planned and that the schedule uses, whatever their role.
fn used(input: &SessionInput, analysis: &Analysis) -> Vec<PressResult> {
    let rows = analysis.presses.iter().zip(&input.outcomes);
    let of_first = rows.filter(|(p, outcome)| {
        p.repetition == RepetitionId::default()
            && p.role != PressRole::Sync
            && p.truth.is_some()
            && outcome
                .as_ref()
                .is_some_and(|o| o.verdict == PressVerdict::Valid)
    });
    of_first.map(|(p, _)| p.clone()).collect()
}

fn is_left_out_by_hand(press: &PressResult, analysis: &Analysis) -> bool {
    analysis.settings.excludes(press.press) || analysis.settings.selected_out(press.press).is_some()
}

fn columns(press: &PressResult) -> [Option<f64>; 2] {
    [0, 1].map(|k| press.views[k].and_then(|v| v.centroid_u))
}

/// Fits the paper's eight parameters to all of `presses`, marked as calibration presses; the nominal geometry if they do not
/// determine it.
fn calibrated_on_all(
    input: &SessionInput,
    presses: &mut [PressResult],
) -> (StereoGeometry, Option<CalibrationResult>) {
    for press in presses.iter_mut() {
        press.role = PressRole::Calibrate;
    }
    let mut start = input.rig.nominal;
    for camera in &mut start.cameras {
        camera.lens = camera.lens.as_kind(LensKind::Exponential);
    }
    let set = CalibrationSet::from_presses(presses);
    let fit = calibrate(&set, &start, CalibrationModel::Full, input.settings.seed);
    fit.map_or((start, None), |(geometry, fit)| (geometry, Some(fit)))
}

/// Share of presses that pass as the public code counts: an error strictly below the threshold, where a press without an
/// error has the largest error found (1 mm if there is none). 0 without presses.
#[must_use]
pub(crate) fn published_pass_rate(errors_mm: &[Option<f64>], threshold_mm: f64) -> f64 {
    let filled = filled(errors_mm);
    share(
        filled.iter().filter(|e| **e < threshold_mm).count(),
        filled.len(),
    )
}

/// Same, with presses without an error failing.
#[must_use]
pub fn honest_pass_rate(errors_mm: &[Option<f64>], threshold_mm: f64) -> f64 {
    let passed = errors_mm.iter().flatten().filter(|e| **e < threshold_mm);
    share(passed.count(), errors_mm.len())
}

fn reduction(
    analysis: &Analysis,
    geometry: &StereoGeometry,
    presses: &[PressResult],
    retained: &RetainedPresses,
) -> Vec<ReferenceReduction> {
    let attempts: Vec<Attempt<'_>> = retained
        .presses
        .iter()
        .filter_map(|k| Attempt::new(presses.iter().find(|p| p.press == k.press)?, k))
        .collect();
    if attempts.is_empty() {
        return Vec::new();
    }
    let settings = &analysis.settings;
    let trials = Trials {
        locator: &FittedLocator::rays(*geometry),
        outline: &analysis.rig.outline,
        settings,
        core: CoreThreshold {
            min_samples: MIN_SAMPLES,
            margin: 0.0,
        },
        centroid: CentroidRule::AllClusters,
        kinds: &[Thinning::Exact],
    };
    let outcomes = trials.run(&attempts, LocationOutcome::estimate);
    let mut at_factor_1 = filled(&errors(&outcomes, 0, 0));
    let threshold_mm = quantile(&mut at_factor_1, 0.95).unwrap_or(0.0);
    let row = |power: u32| {
        let seeds = 0..settings.reduction.seeds as usize;
        let of_seeds: Vec<Vec<Option<f64>>> = seeds
            .map(|seed| errors(&outcomes, seed, power as usize))
            .collect();
        let rmse = |errors: &Vec<Option<f64>>| {
            let mut found: Vec<f64> = errors.iter().flatten().copied().collect();
            root_mean_square(&mut found)
        };
        let rate = |of: fn(&[Option<f64>], f64) -> f64| {
            let sum: f64 = of_seeds.iter().map(|e| of(e, threshold_mm)).sum();
            sum / of_seeds.len() as f64
        };
        let mut rmses: Vec<f64> = of_seeds.iter().filter_map(rmse).collect();
        ReferenceReduction {
            factor: 1 << power,
            rmse_mm: mean(&mut rmses),
            pass_rate: rate(published_pass_rate),
            honest_pass_rate: rate(honest_pass_rate),
        }
    };
    (0..=settings.reduction.max_power).map(row).collect()
}

fn errors(outcomes: &[Outcome], seed: usize, power: usize) -> Vec<Option<f64>> {
    let trials = outcomes.iter().map(|o| o.trial(seed, 0, power));
    trials.map(|t| t.error_mm).collect()
}

/// Replaces missing errors by the largest one.
fn filled(errors_mm: &[Option<f64>]) -> Vec<f64> {
    let largest = errors_mm.iter().flatten().copied().fold(0.0, f64::max);
    let largest = if largest > 0.0 {
        largest
    } else {
        ERROR_OF_NOTHING_MM
    };
    errors_mm.iter().map(|e| e.unwrap_or(largest)).collect()
}

fn population_std(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let centre = mean(&mut values.to_vec())?;
    let squares: f64 = values.iter().map(|v| (v - centre).powi(2)).sum();
    Some((squares / n).sqrt())
}

fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 {
        0.0
    } else {
        part as f64 / whole as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 250 different errors from 0.02 mm up, not sorted.
    fn errors() -> Vec<Option<f64>> {
        (0..250)
            .map(|i| Some(0.02 * f64::from(1 + i * 77 % 250)))
            .collect()
    }

    #[test]
    fn a_missing_press_passes_under_the_published_rule_and_fails_under_ours() {
        let threshold = quantile(&mut filled(&errors()), 0.95).unwrap();
        let rates = |e: &[Option<f64>]| {
            (
                published_pass_rate(e, threshold),
                honest_pass_rate(e, threshold),
            )
        };
        // 237 of 250 whatever the errors: they define the threshold.
        assert_eq!(rates(&errors()), (0.948, 0.948));
        assert_eq!(rates(&[None; 250]), (1.0, 0.0));
        let mut one = vec![None; 250];
        one[7] = Some(0.5);
        assert_eq!(rates(&one), (1.0, 0.004));
        // The largest error fails, and so do the presses that get it.
        let half = errors().into_iter().enumerate();
        let half: Vec<_> = half.map(|(i, e)| e.filter(|_| i < 125)).collect();
        assert!(half.iter().flatten().any(|e| *e >= threshold));
        let (published, honest) = rates(&half);
        assert!(published == honest && honest < 0.5);
        assert_eq!(rates(&[]), (0.0, 0.0));
    }

    #[test]
    fn the_spread_is_that_of_a_population() {
        assert_eq!(population_std(&[1.0, 3.0]), Some(1.0));
        assert_eq!(population_std(&[]), None);
    }
}
