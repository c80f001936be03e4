//! Speed against accuracy: the same presses located in many ways, each with its error and costs.
//!
//! A session is read once. Then every [`Choice`] is evaluated as an analysis with its settings would be: windows, estimates,
//! rules, its own calibration on the calibration presses, metrics on the scored ones. Presses that a choice cannot locate
//! lower its located rate. A choice *competes* if it locates at least the share [`Tradeoff::least_located`] of the presses;
//! the fronts consist of competing choices, by RMSE and one cost each.

mod choice;
mod front;
mod measure;
mod plan;
mod predict;
mod replay;
mod rows;
mod rule;
mod search;
#[cfg(test)]
mod tests;
mod timing;
mod winner;
#[cfg(test)]
mod winner_tests;

pub use choice::{Choice, Region};
pub use plan::{Plan, Progress};
pub use predict::{Predicted, Prediction, Predictions};
pub use rows::{Cost, Row, Tradeoff};
pub use winner::{Measured, Requirement, Selection, Unselected};

use std::ops::ControlFlow;

use skinrig_model::{AnalysisSettings, CalibrationModel, PressRole, ReductionSettings};

use crate::error::AnalysisError;
use crate::input::{EventSource, SessionInput};
use crate::locator::FittedLocator;
use crate::press_events::Retention;
use measure::Measuring;
use replay::Replay;

/// Reads the session once and measures every choice of the plan. `stopwatch` returns the CPU time of this thread, s. `watch`
/// is called after every choice; once it breaks, only the times of the choices so far are measured.
///
/// # Errors
/// Errors of [`crate::analyze`], [`AnalysisError::Invalid`] and [`AnalysisError::NothingToCompare`].
pub fn measure(
    input: &SessionInput,
    source: &dyn EventSource,
    plan: Plan,
    stopwatch: &mut dyn FnMut() -> f64,
    watch: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Measured, AnalysisError> {
    let session = &input.settings;
    // Keep whole presses, and skip the studies of the analysis.
    let mut reading = input.clone();
    reading.settings = AnalysisSettings {
        window_after_contact_ms: None,
        reduction: ReductionSettings {
            max_power: 0,
            seeds: 1,
            ..session.reduction
        },
        ..session.clone()
    };
    let (analysis, kept) = crate::analyze_with_events(&reading, source, Retention::All)?;
    if !analysis.is_valid() {
        return Err(AnalysisError::Invalid(
            analysis.invalid_because().join("; "),
        ));
    }
    let replay = Replay::new(input, &analysis, &kept).ok_or(AnalysisError::NothingToCompare)?;
    let model = match (session.calibration, &analysis.calibration) {
        (CalibrationModel::Auto, Some(found)) => found.model,
        (CalibrationModel::Auto, None) => CalibrationModel::None,
        (named, _) => named,
    };
    let locator = FittedLocator::of(&analysis)?.locator();
    let press_s = replay.press_s(&reading.settings);
    let mut measuring = Measuring {
        replay: &replay,
        session,
        reading: &reading.settings,
        model,
        locator,
        press_s,
        plan,
        rows: Vec::new(),
        candidates: Vec::new(),
        errors: Vec::new(),
        points: Vec::new(),
        best: None,
        is_stopped: false,
        watch,
    };
    let mut predictions = measuring.measure();
    let repeats = plan.repeats.max(1);
    let timed_presses = measuring.time(repeats, stopwatch);
    measuring.predict(&mut predictions);
    let least_located = measuring.least_located();
    let is_interrupted = measuring.is_stopped;
    let Measuring { rows, errors, .. } = measuring;
    let mut tradeoff = Tradeoff {
        settings: session.clone(),
        model,
        locator,
        calibrating: replay.counts(PressRole::Calibrate),
        scored: replay.counts(PressRole::Score),
        least_located,
        timed_presses,
        repeats,
        press_s,
        rows,
        predictions,
        is_interrupted,
    };
    front::mark_fronts(&mut tradeoff);
    Ok(Measured { tradeoff, errors })
}
