//! Turns camera observations of the presses into verdicts and locations, by the rules of the settings.

use skinrig_model::{AnalysisSettings, CameraId, PressId, PressRole, Verdict};

use crate::calibrate::{SessionCalibration, calibrate_session, reject_presses};
use crate::check;
use crate::error::RecalibrationError;
use crate::exclusion::Exclusion;
use crate::input::SessionInput;
use crate::locator::{
    self, CameraFeatures, EarlierCalibration, Effort, FittedLocator, LocatorChoice,
};
use crate::result::{LocationOutcome, PressResult, PressView, Recalibration, Warning};
use crate::sets::CalibrationSet;
use crate::tie::UntimedPress;
use crate::triangulate::locate;
use crate::verdict;

/// Observations of one camera, by rows of the plan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CameraObservations<'a> {
    pub has_clock: bool,
    pub views: &'a [Option<PressView>],
    /// Rows with lost bytes in their window.
    pub data_lost: &'a [bool],
    /// Rows that this camera's clock does not time.
    pub untimed: &'a [Option<UntimedPress>],
}

/// Every planned press with its verdict, and what located it.
pub(crate) struct LocatedPresses {
    pub presses: Vec<PressResult>,
    pub calibrated: SessionCalibration,
    pub locator: Option<LocatorChoice>,
}

impl LocatedPresses {
    /// The locator; the rays of the geometry if nothing could be learnt.
    pub(crate) fn fitted(&self) -> FittedLocator {
        let learnt = self.locator.as_ref().map(|l| l.fitted.clone());
        learnt.unwrap_or_else(|| FittedLocator::rays(self.calibrated.geometry))
    }
}

/// Where the calibration comes from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum CalibrationOrigin<'a> {
    /// The calibration presses of the session.
    Session,
    /// An earlier session, corrected by these presses.
    Earlier(&'a EarlierCalibration),
}

/// Like [`locate_presses`], by the calibration of an earlier session. Its threshold on cluster events applies too.
///
/// # Errors
/// [`RecalibrationError`] if the earlier calibration does not fit.
pub(crate) fn locate_recalibrated(
    input: &SessionInput,
    observations: [CameraObservations<'_>; 2],
    earlier: &EarlierCalibration,
    warnings: &mut Vec<Warning>,
) -> Result<(LocatedPresses, Recalibration), RecalibrationError> {
    let mut presses = rows(input, observations);
    let threshold = earlier.threshold().cloned();
    if let Some(choice) = &threshold {
        reject_presses(&mut presses, choice.events);
    }
    let set = CalibrationSet::from_presses(&presses);
    let centre = input.rig.outline.centre;
    let corrected = earlier.correct(&set, [centre.x_mm, centre.y_mm], &input.settings)?;
    warnings.extend(corrected.warnings());
    let calibrated = SessionCalibration {
        geometry: corrected.geometry,
        calibration: Some(corrected.calibration),
        threshold,
    };
    let located = located(
        input,
        presses,
        calibrated,
        Some(corrected.locator),
        Effort::Full,
    );
    Ok((located, corrected.about))
}

/// Applies journal, data and rules to the presses, calibrates, learns to locate, and locates all presses.
pub(crate) fn locate_presses(
    input: &SessionInput,
    observations: [CameraObservations<'_>; 2],
    effort: Effort,
    warnings: &mut Vec<Warning>,
) -> LocatedPresses {
    let mut presses = rows(input, observations);
    let calibrated = calibrate_session(input, &mut presses, warnings);
    let set = CalibrationSet::from_presses(&presses);
    let mut locator = locator::choose(&set, &calibrated, &input.settings, effort);
    if let Some(choice) = &mut locator {
        warnings.append(&mut choice.warnings);
    }
    located(input, presses, calibrated, locator, effort)
}

/// Locates all presses.
fn located(
    input: &SessionInput,
    mut presses: Vec<PressResult>,
    calibrated: SessionCalibration,
    mut locator: Option<LocatorChoice>,
    effort: Effort,
) -> LocatedPresses {
    let outline = &input.rig.outline;
    for row in &mut presses {
        let cameras = CameraFeatures::of_press(row);
        match &locator {
            Some(choice) => {
                let (outcome, location) = choice.fitted.outcome(outline, cameras);
                row.location_outcome = outcome;
                row.region = location.and_then(|l| l.region);
                row.extrapolated = location.is_some_and(|l| l.extrapolated);
            }
            None => {
                let columns = cameras.map(|c| c.column);
                row.location_outcome = locate(&calibrated.geometry, outline, columns);
            }
        }
        let judged = row.role != PressRole::Sync && row.verdict == Verdict::Valid;
        if judged
            && let Some(judgement) = verdict::location_rule(&row.location_outcome, &input.settings)
        {
            verdict::put(row, judgement);
        }
    }
    if let Some(choice) = &mut locator {
        choice.result.reliability = match effort {
            Effort::Full => locator::reliability(&choice.fitted, &presses, &input.settings),
            Effort::Positions => Vec::new(),
        };
    }
    LocatedPresses {
        presses,
        calibrated,
        locator,
    }
}

/// Exclusion of the press by a person, if any.
fn left_out(settings: &AnalysisSettings, press: PressId) -> Option<Exclusion> {
    let selected = settings.selected_out(press).cloned();
    let by_hand = || settings.excludes(press).then_some(Exclusion::ByHand);
    selected.map(Exclusion::BySelection).or_else(by_hand)
}

fn rows(input: &SessionInput, observations: [CameraObservations<'_>; 2]) -> Vec<PressResult> {
    let has_clock = [0, 1].map(|k| observations[k].has_clock);
    let pairs = input.planned.iter().zip(&input.outcomes).enumerate();
    pairs
        .map(|(i, (planned, outcome))| {
            let views = [0, 1].map(|k| observations[k].views[i]);
            let data_lost = [0, 1].map(|k| observations[k].data_lost[i]);
            let mut judgement = verdict::from_data(
                planned.role,
                outcome.as_ref(),
                has_clock,
                data_lost,
                &views,
                &input.settings,
            );
            if let Some(why) = left_out(&input.settings, planned.id) {
                judgement = judgement.or_left_out(why);
            }
            for camera in CameraId::ALL {
                if let Some(untimed) = observations[camera.index()].untimed[i] {
                    judgement = judgement.or_untimed(camera, untimed);
                }
            }
            let mut row = PressResult {
                press: planned.id,
                role: planned.role,
                repetition: planned.repetition,
                location: planned.location,
                planned: planned.at,
                depth_mm: planned.depth_mm,
                truth: outcome
                    .as_ref()
                    .and_then(|o| o.measured_at.filter(check::is_place)),
                verdict: Verdict::Missed,
                cause: None,
                timing: outcome.as_ref().and_then(|o| o.timing),
                views,
                location_outcome: LocationOutcome::Missing,
                region: None,
                extrapolated: false,
            };
            verdict::put(&mut row, judgement);
            row
        })
        .collect()
}
