//! Localisation on thinned events: how much of the data the skin needs.
//!
//! Everything but the number of events stays as it is: one clustering for all factors, the centroid rule, the calibrated
//! geometry and the location rules of the settings. In the study are the kept scored presses that were done as planned:
//! valid ones, and those that a rule on the data left out; what the journal or the settings leave out by hand is no
//! question to the skin. A press is *located* when its rays meet where no location rule excludes it (behind a camera,
//! parallel, outside the outline as far as the settings say so). The rules on the amount of events (threshold, response)
//! do not apply: they ask the very thing that the study changes, and at high factors they would leave nothing to study.
//!
//! The study asks about the paper's method: all events of the press window, DBSCAN on single pixels. An estimator, a thinning
//! or bins that the settings choose for the analysis are not part of it; without such a choice factor 1 is the analysis.

mod curve;
mod thinning;
mod trials;

use skinrig_model::PressRole;

use crate::kept::Kept;
use crate::metrics::{bootstrap_over_locations, mean, quantile};
use crate::result::{Analysis, Reduction, ReductionCurve, Thinning};
use crate::verdict;

pub(crate) use trials::{Attempt, Outcome, Trials};

/// Thins the kept scored presses and locates them again; `None` when there are none.
#[must_use]
pub fn study(analysis: &Analysis, kept: &Kept) -> Option<Reduction> {
    let settings = &analysis.settings;
    let attempts = attempts(analysis, kept);
    if attempts.is_empty() {
        return None;
    }
    let trials = Trials {
        geometry: &analysis.geometry,
        outline: &analysis.rig.outline,
        settings,
        min_samples: match settings.reduction.min_samples {
            0 => settings.min_samples,
            named => named,
        },
        centroid: settings.centroid,
        kinds: &[Thinning::Exact, Thinning::Bernoulli],
    };
    let outcomes = trials.run(&attempts, |outcome| {
        let allowed = verdict::location_rule(outcome, settings).is_none();
        outcome.estimate().filter(|_| allowed)
    });
    let mut errors: Vec<f64> = outcomes.iter().filter_map(|o| o.full.error_mm).collect();
    let pass_threshold_mm = quantile(&mut errors, 0.95);
    let idle: Vec<(u32, f64)> = attempts
        .iter()
        .filter_map(|a| Some((a.location, a.idle_events_per_s()?)))
        .collect();
    let course = curve::Course {
        settings,
        pass_threshold_mm,
        idle_events_per_s: bootstrap_over_locations(
            &idle,
            settings.bootstrap_resamples,
            settings.seed,
            mean,
        ),
    };
    Some(Reduction {
        eps_px: settings.eps_px,
        min_samples: trials.min_samples,
        seeds: settings.reduction.seeds,
        presses: attempts.len() as u32,
        pass_threshold_mm,
        within_mm: settings.within_mm,
        curves: trials
            .kinds
            .iter()
            .enumerate()
            .map(|(kind, &thinning)| ReductionCurve {
                thinning,
                rows: course.rows(&outcomes, kind),
            })
            .collect(),
    })
}

/// The presses of the study.
fn attempts<'a>(analysis: &Analysis, kept: &'a Kept) -> Vec<Attempt<'a>> {
    let presses = kept.presses.iter().filter_map(|k| {
        let row = analysis.presses.get(k.row)?;
        let attempt = Attempt::new(row, k)?;
        (row.role == PressRole::Score && verdict::is_done_as_planned(row)).then_some(attempt)
    });
    presses.collect()
}
