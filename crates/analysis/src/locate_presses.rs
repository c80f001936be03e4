//! Turns camera observations of the presses into verdicts and locations, by the rules of the settings.

use skinrig_model::{CameraId, PressRole, Verdict};

use crate::calibrate::{SessionCalibration, calibrate_session};
use crate::check;
use crate::input::SessionInput;
use crate::result::{LocationOutcome, PressResult, PressView};
use crate::triangulate::locate;
use crate::untimed::Untimed;
use crate::verdict;

/// Observations of one camera, by rows of the plan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CameraObservations<'a> {
    pub has_clock: bool,
    pub views: &'a [Option<PressView>],
    /// Rows with lost bytes in their window.
    pub data_lost: &'a [bool],
    /// Rows that this camera's clock does not time.
    pub untimed: &'a [Option<Untimed>],
}

/// Every planned press with its verdict, and the geometry that located it.
pub(crate) struct LocatedPresses {
    pub presses: Vec<PressResult>,
    pub calibrated: SessionCalibration,
}

/// Applies journal, data and rules to the presses, calibrates, and locates all presses.
pub(crate) fn locate_presses(
    input: &SessionInput,
    seen: [CameraObservations<'_>; 2],
    warnings: &mut Vec<String>,
) -> LocatedPresses {
    let mut presses = rows(input, seen);
    let calibrated = calibrate_session(input, &mut presses, warnings);
    for row in &mut presses {
        let column = |k: usize| row.views[k].and_then(|v| v.centroid_u);
        row.location_outcome = locate(
            &calibrated.geometry,
            &input.rig.outline,
            [column(0), column(1)],
        );
        let judged = row.role != PressRole::Sync && row.verdict == Verdict::Valid;
        if judged
            && let Some(judgement) = verdict::location_rule(&row.location_outcome, &input.settings)
        {
            verdict::put(row, judgement);
        }
    }
    LocatedPresses {
        presses,
        calibrated,
    }
}

fn rows(input: &SessionInput, seen: [CameraObservations<'_>; 2]) -> Vec<PressResult> {
    let has_clock = [0, 1].map(|k| seen[k].has_clock);
    let pairs = input.planned.iter().zip(&input.outcomes).enumerate();
    pairs
        .map(|(i, (planned, outcome))| {
            let views = [0, 1].map(|k| seen[k].views[i]);
            let data_lost = [0, 1].map(|k| seen[k].data_lost[i]);
            let mut judgement = verdict::from_data(
                planned.role,
                outcome.as_ref(),
                has_clock,
                data_lost,
                &views,
                &input.settings,
            );
            if input.settings.excludes(planned.id) {
                judgement = judgement.or_by_hand();
            }
            for camera in CameraId::ALL {
                if let Some(untimed) = seen[camera.index()].untimed[i] {
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
                reason: None,
                rule: None,
                timing: outcome.as_ref().and_then(|o| o.timing),
                views,
                location_outcome: LocationOutcome::Missing,
            };
            verdict::put(&mut row, judgement);
            row
        })
        .collect()
}
