//! What a session and each simulated skin show.

use std::path::Path;

use skinrig_compare::twin::{
    CalibrationFigures, Observed, SkinDraw, TwinConstant, calibration_only, outcomes, place_errors,
};
use skinrig_results::{AlignedSession, SessionEvents, press_statistics};

use crate::exit::Failure;
use crate::scene::replicates::Replicates;

/// The twin is simulated at the level that models the skin.
pub(super) const OPTICAL: &str = "scene.level=optical";

/// Simulates a skin by the session's protocol, and by the one with `changes` if there are any.
///
/// # Errors
/// As [`Replicates::simulate`].
pub(super) fn draw(
    own: &Replicates<'_>,
    changes: &[String],
    seed: u64,
) -> Result<Result<SkinDraw, Failure>, Failure> {
    let shares = TwinConstant::draw(seed);
    let constants = TwinConstant::ALL.iter().zip(&shares);
    let mut overrides: Vec<String> = constants.map(|(c, share)| c.setting(*share)).collect();
    overrides.push(OPTICAL.to_owned());
    let look = |aligned, at: &Path| observed(aligned, at, || "its analysis is INVALID".to_owned());
    let skin = match own.simulate(&overrides, seed, look)? {
        Ok(skin) => skin,
        Err(why) => return Ok(Err(why)),
    };
    let mut changed = None;
    if !changes.is_empty() {
        overrides.extend(changes.iter().cloned());
        changed = match own.simulate(&overrides, seed, look)? {
            Ok(skin) => Some(skin.outcomes),
            Err(why) => return Ok(Err(why)),
        };
    }
    Ok(Ok(SkinDraw {
        shares,
        figures: skin.figures,
        outcomes: skin.outcomes,
        changed,
        places: skin.places,
    }))
}

/// What a session shows, without studies, which none of it needs.
///
/// # Errors
/// [`Failure`] for a session that cannot be analysed, and `invalid` for an INVALID one.
pub(super) fn observed(
    mut aligned: AlignedSession,
    path: &Path,
    invalid: impl FnOnce() -> String,
) -> Result<Observed, Failure> {
    aligned.input.settings.study_presses = 0;
    let formats = aligned.session.header.stream_formats;
    let name = aligned.session.path.clone();
    let events = SessionEvents::new(&name, formats, &aligned.input.legs);
    let analysis = aligned.analyze()?.analysis;
    if !analysis.is_valid() {
        return Err(Failure::limit(invalid()));
    }
    let calibration = calibration_only(&analysis);
    let cameras = press_statistics(&events, &calibration)
        .map_err(|e| Failure::input(format!("{}: {e}", path.display())))?;
    Ok(Observed {
        figures: CalibrationFigures::of(&calibration, &cameras),
        outcomes: outcomes(&analysis),
        places: place_errors(&analysis),
    })
}
