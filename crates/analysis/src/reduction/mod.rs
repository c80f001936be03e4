//! The data-reduction study: localisation on thinned events.
//!
//! Everything except the number of events is fixed: one clustering for all factors (whose core threshold follows the
//! background as it thins), and the centroid rule, locator
//! and location rules of the settings. The study uses the retained scored presses that were executed as planned:
//! valid ones, and those excluded by a rule on the data, but not those that the journal or the settings exclude by hand. A
//! press is *located* if its rays meet where no location rule excludes it (behind a camera, parallel, outside the outline,
//! depending on the settings). Rules on the number of events (threshold, response) do not apply: the study varies exactly
//! that, and at high factors they would leave nothing.
//!
//! The study evaluates the paper's method: all events of the press window, DBSCAN on single pixels. Estimators, thinning or
//! bins chosen in the settings do not apply; with default settings factor 1 equals the analysis.

mod curve;
mod thinning;
mod trials;

use skinrig_model::PressRole;

use crate::background::CoreThreshold;
use crate::locator::FittedLocator;
use crate::metrics::quantile;
use crate::over_locations::rate_over_locations;
use crate::press_events::RetainedPresses;
use crate::result::{Analysis, Reduction, ReductionCurve, Thinning};
use crate::verdict;

pub(crate) use trials::{Attempt, Outcome, Trials};

/// Thins the retained scored presses and locates them again with the locator of the analysis; `None` if there are none.
#[must_use]
pub fn study(
    analysis: &Analysis,
    locator: &FittedLocator,
    retained: &RetainedPresses,
) -> Option<Reduction> {
    let settings = &analysis.settings;
    let attempts = attempts(analysis, retained);
    if attempts.is_empty() {
        return None;
    }
    let trials = Trials {
        locator,
        outline: &analysis.rig.outline,
        settings,
        core: match settings.reduction.min_samples {
            0 => CoreThreshold::of(settings),
            named => CoreThreshold {
                min_samples: named,
                ..CoreThreshold::of(settings)
            },
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
    let course = curve::CurveContext {
        settings,
        pass_threshold_mm,
        idle_events_per_s: rate_over_locations(&idle, settings.bootstrap_resamples, settings.seed),
    };
    Some(Reduction {
        eps_px: settings.eps_px,
        min_samples: trials.core.min_samples,
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

/// Presses of the study.
fn attempts<'a>(analysis: &Analysis, retained: &'a RetainedPresses) -> Vec<Attempt<'a>> {
    let presses = retained.presses.iter().filter_map(|k| {
        let row = analysis.presses.get(k.row)?;
        let attempt = Attempt::new(row, k)?;
        (row.role == PressRole::Score && verdict::is_done_as_planned(row)).then_some(attempt)
    });
    presses.collect()
}
