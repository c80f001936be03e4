//! Owns an open session: header, rig, and analysis settings.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use skinrig_analysis::{EarlierAttempt, LegStart, SessionInput};
use skinrig_model::{
    AnalysisSettings, AttemptId, CameraId, RigGeometry, RunHeader, TouchKind, TriggerEdge,
    merge_places,
};
use skinrig_recorder::{AttemptRow, RecorderError, SessionReader};

use crate::contacts;
use crate::error::ResultsError;
use crate::rig_document::RigDocument;
use crate::settings::AnalysisOptions;

/// An open session.
pub struct Session {
    /// Path of the file.
    pub path: PathBuf,
    /// The file.
    pub reader: SessionReader,
    /// Header of the run.
    pub header: RunHeader,
    /// The settings of the analysis.
    pub settings: AnalysisSettings,
    /// True if they differ from the recorded settings.
    pub is_changed: bool,
    recorded_settings: AnalysisSettings,
    pub(crate) reference_code: bool,
    pub(crate) calibration_from: Option<PathBuf>,
    pub(crate) rig: RigGeometry,
}

impl Session {
    /// Opens a session with its recorded settings, or with others.
    ///
    /// # Errors
    /// [`ResultsError`] for a file that is not a readable session, and for settings that do not parse.
    pub fn open(path: &Path, options: AnalysisOptions<'_>) -> Result<Self, ResultsError> {
        let reader = SessionReader::open_checked(path)?;
        let header = reader.header()?;
        let rig: RigDocument =
            serde_json::from_str(&header.rig_json).map_err(|source| ResultsError::Rig {
                path: path.to_owned(),
                source,
            })?;
        let settings = AnalysisSettings {
            selected_out: options.selected_out.to_vec(),
            ..options.settings(&header, rig.analysis.clone())?
        };
        Ok(Self {
            path: path.to_owned(),
            reader,
            is_changed: settings != rig.analysis
                || options.reference_code
                || options.calibration_from.is_some(),
            settings,
            recorded_settings: rig.analysis,
            reference_code: options.reference_code,
            calibration_from: options.calibration_from.map(Path::to_owned),
            header,
            rig: rig.geometry,
        })
    }

    pub(crate) fn input(&self) -> Result<SessionInput, RecorderError> {
        let reader = &self.reader;
        let (mut planned, mut outcomes, mut earlier) = (Vec::new(), Vec::new(), Vec::new());
        for (press, mut attempts) in reader.presses()? {
            planned.push(press);
            outcomes.push(attempts.pop().and_then(|last| last.outcome));
            earlier.extend(attempts.iter().filter_map(earlier_attempt));
        }
        merge_places(&mut planned);
        let (pose_interval_us, crossing_se_us) = contacts::timing(reader, &outcomes)?;
        let descents = contacts::descents(reader, &outcomes)?;
        let hold_forces_n = contacts::hold_forces(reader, &planned, &outcomes)?;
        let [one, two] = CameraId::ALL;
        let further = reader.legs()?.into_iter().skip(1);
        let legs = further.map(|leg| LegStart::recorded(leg.origin, leg.camera_origin_us));
        let [delay_1, delay_2] = self.rig.trigger_delay_us;
        let reports = reader.box_reports()?.into_iter();
        let touches = reader.touches()?.into_iter();
        let stopped = touches.filter(|t| t.kind == TouchKind::Stopped);
        let counted: BTreeSet<AttemptId> = outcomes.iter().flatten().map(|o| o.attempt).collect();
        let stopped = stopped.filter_map(|t| t.attempt.filter(|attempt| counted.contains(attempt)));
        Ok(SessionInput {
            stopped: stopped.map(|attempt| attempt.press).collect(),
            planned,
            outcomes,
            earlier,
            edges: [
                on_time(reader.trigger_edges(one)?, delay_1),
                on_time(reader.trigger_edges(two)?, delay_2),
            ],
            marks: reader.marks_sent()?,
            box_reports: reports.map(|(_, report)| report).collect(),
            gaps: [reader.gaps(one)?, reader.gaps(two)?],
            recorded: [
                reader.recorded_intervals(one)?,
                reader.recorded_intervals(two)?,
            ],
            pose_interval_us,
            crossing_se_us,
            descents,
            hold_forces_n,
            legs: legs.collect(),
            rig: self.rig,
            recorded_settings: (self.settings != self.recorded_settings)
                .then(|| self.recorded_settings.clone()),
            settings: self.settings.clone(),
        })
    }
}

/// `None` for an attempt that never began.
fn earlier_attempt(attempt: &AttemptRow) -> Option<EarlierAttempt> {
    let timing = attempt.outcome.as_ref().and_then(|o| o.timing);
    Some(EarlierAttempt {
        begun: attempt.intent.or(timing.map(|t| t.approach))?,
        clear: timing.map(|t| t.clear),
    })
}

/// Shifts edges to the instants at which they reached the camera's input, which are earlier by its timestamp delay. An edge
/// within the delay after the camera's first microsecond moves to that microsecond.
fn on_time(mut edges: Vec<TriggerEdge>, delay_us: u16) -> Vec<TriggerEdge> {
    for edge in &mut edges {
        edge.t_us = edge.t_us.saturating_sub(u64::from(delay_us));
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_moved_to_when_they_reached_the_camera() {
        let edge = |t_us| TriggerEdge {
            t_us,
            channel: 0,
            rising: true,
        };
        let edges = || vec![edge(2), edge(1_000_003), edge((1 << 34) + 1)];
        assert_eq!(on_time(edges(), 0), edges());
        let moved = vec![edge(0), edge(1_000_000), edge((1 << 34) - 2)];
        assert_eq!(on_time(edges(), 3), moved);
    }
}
