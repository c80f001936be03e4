//! Speed against accuracy: the same presses located in many ways, each with its error and costs.
//!
//! A session is read once. Then every [`Choice`] is evaluated as an analysis with its settings would be: windows, estimates,
//! rules, its own calibration on the calibration presses, metrics on the scored ones. Presses that a choice cannot locate
//! lower its located rate. A choice *competes* if it locates at least the share [`Tradeoff::least_located`] of the presses;
//! the fronts consist of competing choices, by RMSE and one cost each.

mod choice;
mod front;
mod replay;
mod rows;
#[cfg(test)]
mod tests;
mod timing;
mod winner;
#[cfg(test)]
mod winner_tests;

pub use choice::{Choice, Region};
pub use rows::{Cost, Row, Tradeoff};
pub use winner::{Measured, Requirement, Selection, Unselected};

use skinrig_model::{AnalysisSettings, CalibrationModel, PressRole, ReductionSettings};

use crate::error::AnalysisError;
use crate::input::{EventSource, SessionInput};
use crate::locator::FittedLocator;
use crate::press_events::Retention;
use replay::Replay;
use timing::Candidate;

/// A choice does not compete if it locates fewer presses than the session's own by more than this share.
const LOCATED_MARGIN: f64 = 0.01;

/// Choices to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Try every combination instead of single changes and promising combinations.
    pub full: bool,
    /// Timed runs per choice, at least 1.
    pub repeats: u32,
    /// Minimum located rate to compete, 0..=1; `None`: that of the session's own settings minus 1 %.
    pub least_located: Option<f64>,
}

/// Reads the session once and measures every choice of the plan. `stopwatch` returns the CPU time of this thread, s.
///
/// # Errors
/// Errors of [`crate::analyze`], [`AnalysisError::Invalid`] and [`AnalysisError::NothingToCompare`].
pub fn measure(
    input: &SessionInput,
    source: &dyn EventSource,
    plan: Plan,
    stopwatch: &mut dyn FnMut() -> f64,
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
    let mut rows = Vec::new();
    let mut candidates = Vec::new();
    let mut errors = Vec::new();
    for choice in choice::sweep(Choice::of(session), plan.full) {
        let crop = replay.region_rows(&reading.settings, choice.region);
        let settings = choice.settings(session, crop, model, locator);
        let outcome = replay.run(&settings);
        let bits = bits_per_event(&settings);
        errors.push(outcome.errors);
        rows.push(Row {
            choice,
            rows: crop,
            overrides: choice::overrides(session, &settings),
            rmse_mm: outcome.metrics.rmse_mm,
            penalised_rmse_mm: outcome.penalised.rmse_mm,
            located_rate: outcome.metrics.located_rate,
            within_rate: outcome.metrics.within_rate,
            events_per_press: outcome.events_per_press,
            bytes_per_s: outcome.events_per_press * bits / 8.0 / press_s,
            delay_ms: outcome.delay_ms,
            cpu_us: 0.0,
            cpu_range_us: (0.0, 0.0),
            competes: false,
            fronts: Vec::new(),
        });
        candidates.push(Candidate {
            settings,
            locator: outcome.located.fitted(),
        });
    }
    let outline = &input.rig.outline;
    let repeats = plan.repeats.max(1);
    let (times, timed_presses) = timing::run(&replay, outline, &candidates, repeats, stopwatch);
    for (row, time) in rows.iter_mut().zip(times) {
        (row.cpu_us, row.cpu_range_us) = (time.median_us, time.range_us);
    }
    let own = rows[0].located_rate.value.unwrap_or(0.0);
    let mut tradeoff = Tradeoff {
        settings: session.clone(),
        model,
        locator,
        calibrating: replay.counts(PressRole::Calibrate),
        scored: replay.counts(PressRole::Score),
        least_located: plan
            .least_located
            .unwrap_or((own - LOCATED_MARGIN).max(0.0)),
        timed_presses,
        repeats,
        press_s,
        rows,
    };
    front::mark_fronts(&mut tradeoff);
    Ok(Measured { tradeoff, errors })
}

/// Bits per event of the settings; halving columns or rows shortens a pixel address by one bit.
fn bits_per_event(settings: &AnalysisSettings) -> f64 {
    let saved = 2 * u32::from(settings.bin_px).trailing_zeros();
    (settings.bits_per_event - f64::from(saved)).max(1.0)
}
