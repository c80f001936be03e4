//! Learns how the skin of a session, which may still be recorded, responds to touch.

use std::path::Path;

use skinrig_online::SkinModel;

use crate::error::{NotLearnt, ResultsError};
use crate::session::Session;
use crate::settings::AnalysisOptions;
use crate::stages::analyze;

/// Learns from the calibration presses of the session at `path`, which may still be recorded. `false_alarms_hz`: highest rate of false
/// alarms, above 0. The clocks are those of its only leg.
///
/// # Errors
/// [`ResultsError`] if it has no analysis; [`ResultsError::NotLearnt`] if that is INVALID or has too few usable presses.
pub fn learn_skin(path: &Path, false_alarms_hz: f64) -> Result<SkinModel, ResultsError> {
    let analyzed = analyze(path, AnalysisOptions::default())?;
    if !analyzed.legs.is_empty() {
        let legs = analyzed.legs.len() + 1;
        return Err(NotLearnt::Legs { legs }.into());
    }
    if !analyzed.analysis.may_calibrate() {
        let because = analyzed.analysis.invalid_because();
        return Err(NotLearnt::Invalid { because }.into());
    }
    let aligned = Session::open(path, AnalysisOptions::default())?
        .read_input()?
        .align();
    let tips = aligned.tip_courses(false)?;
    let skin = SkinModel::learn(&analyzed.analysis, &aligned.events, &tips, false_alarms_hz);
    Ok(skin.map_err(NotLearnt::Presses)?)
}
