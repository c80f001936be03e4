//! From what the cameras saw of the presses to where each was, by the rules of the settings.

use skinrig_model::{CameraId, PressRole, PressVerdict};

use crate::calibrate::{Calibrated, calibrated};
use crate::check;
use crate::input::SessionInput;
use crate::result::{LocationOutcome, PressResult, PressView};
use crate::triangulate::locate;
use crate::untimed::Untimed;
use crate::verdict;

/// What one camera saw, by rows of the plan.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    pub has_clock: bool,
    pub views: &'a [Option<PressView>],
    /// Rows with bytes lost in their window.
    pub data_lost: &'a [bool],
    /// Rows that this camera's clock does not time.
    pub untimed: &'a [Option<Untimed>],
}

/// Every planned press with its verdict, and the geometry that located it.
pub struct Judged {
    pub presses: Vec<PressResult>,
    pub calibrated: Calibrated,
}

/// Judges the presses by journal, data and rules, calibrates on those that calibrate, and locates all.
pub fn judge(input: &SessionInput, seen: [Seen<'_>; 2], warnings: &mut Vec<String>) -> Judged {
    let mut presses = rows(input, seen);
    let calibrated = calibrated(input, &mut presses, warnings);
    for row in &mut presses {
        let column = |k: usize| row.views[k].and_then(|v| v.centroid_u);
        row.location_outcome = locate(
            &calibrated.geometry,
            &input.rig.outline,
            [column(0), column(1)],
        );
        let judged = row.role != PressRole::Sync && row.verdict == PressVerdict::Valid.name();
        if judged
            && let Some(judgement) = verdict::location_rule(&row.location_outcome, &input.settings)
        {
            verdict::put(row, judgement);
        }
    }
    Judged {
        presses,
        calibrated,
    }
}

fn rows(input: &SessionInput, seen: [Seen<'_>; 2]) -> Vec<PressResult> {
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
                verdict: String::new(),
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
