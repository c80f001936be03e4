//! The stages from an open session to its analysis; each one returns its own value.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use skinrig_analysis::metrics::quantile;
use skinrig_analysis::motion::MotionCourse;
use skinrig_analysis::reference_code::reference_code;
use skinrig_analysis::result::{Motion, PressResult, Warning, WarningCause};
use skinrig_analysis::{
    Analysis, LegStart, Retention, SessionInput, analyze_recalibrated, analyze_with_events, legs,
};
use skinrig_model::{
    AttemptId, HostTime, PressId, PressOutcome, PressRole, Reaction, StopMetric, TouchEstimate,
    Verdict,
};
use skinrig_online::TipCourses;
use skinrig_protocol::Online;
use skinrig_recorder::{RecorderError, SessionReader};

use crate::campaign;
use crate::contacts;
use crate::earlier;
use crate::error::ResultsError;
use crate::events::SessionEvents;
use crate::session::Session;
use crate::settings::AnalysisOptions;

/// Complete input of the analysis except the events, with the times of each leg as recorded.
pub struct RecordedSession {
    /// The session.
    pub session: Session,
    /// Input of the analysis.
    pub input: SessionInput,
}

/// A session with aligned legs, and its events on the same time scale.
pub struct AlignedSession {
    /// The session.
    pub session: Session,
    /// Input of the analysis.
    pub input: SessionInput,
    /// Events of the session.
    pub events: SessionEvents,
}

/// A session and its complete analysis.
pub struct AnalyzedSession {
    /// The session.
    pub session: Session,
    /// Start of its further legs, as aligned.
    pub legs: Vec<LegStart>,
    /// The analysis.
    pub analysis: Analysis,
}

impl Session {
    /// Reads everything that the analysis needs except the events.
    ///
    /// # Errors
    /// [`ResultsError::Session`] when the file cannot be read.
    pub fn read_input(self) -> Result<RecordedSession, ResultsError> {
        let input = self.input()?;
        Ok(RecordedSession {
            session: self,
            input,
        })
    }
}

impl RecordedSession {
    /// Aligns the legs of a resumed run.
    #[must_use]
    pub fn align(mut self) -> AlignedSession {
        legs::align(&mut self.input);
        let formats = self.session.header.stream_formats;
        let events = SessionEvents::new(&self.session.path, formats, &self.input.legs);
        AlignedSession {
            session: self.session,
            input: self.input,
            events,
        }
    }
}

impl AlignedSession {
    /// The way of the tip during every press whose depth was measured: of the scored presses, or of the others.
    ///
    /// # Errors
    /// When the poses cannot be read.
    pub fn tip_courses(&self, scored: bool) -> Result<TipCourses, RecorderError> {
        let (planned, outcomes) = (&self.input.planned, &self.input.outcomes);
        contacts::tip_courses(&self.session.reader, planned, outcomes, scored)
    }

    /// Runs the complete analysis.
    ///
    /// # Errors
    /// [`ResultsError::Analysis`] when the analysis rejects its input, [`ResultsError::Session`] when the poses cannot be read.
    pub fn analyze(self) -> Result<AnalyzedSession, ResultsError> {
        // The public code also evaluates calibration presses.
        let wants_reference = self.session.reference_code;
        let keep = if wants_reference {
            Retention::All
        } else {
            Retention::Scored
        };
        let earlier = self.session.calibration_from.as_deref();
        let earlier = earlier.map(|path| earlier::calibration(&self.session, &self.events, path));
        let (mut analysis, kept) = match earlier.transpose()? {
            None => analyze_with_events(&self.input, &self.events, keep)?,
            Some(earlier) => analyze_recalibrated(&self.input, &self.events, keep, &earlier)?,
        };
        let reference = wants_reference.then(|| reference_code(&self.input, &analysis, &kept));
        let motion = motion(&self.session.reader, &analysis)?;
        let touches = self.session.reader.touches()?;
        let tips = if touches.is_empty() {
            TipCourses::new()
        } else {
            self.tip_courses(true)?
        };
        let rows = self.input.planned.iter().zip(&self.input.outcomes);
        let outcomes: BTreeMap<PressId, &PressOutcome> = rows
            .filter_map(|(press, outcome)| Some((press.id, outcome.as_ref()?)))
            .collect();
        let resumed = self.input.legs.first().map(|leg| leg.origin);
        let felt = skinrig_online::felt(&analysis, &touches, &tips, resumed, |press| {
            outcomes.get(&press).copied()
        });
        let end = self.session.reader.end()?.map(|(_, end)| end);
        let plan_json = &self.session.header.plan_json;
        let campaign = campaign::looks(&analysis, plan_json, end.as_ref())?;
        // The data chose the number of presses: the usual interval would cover less often than it says.
        let scored = &mut analysis.scored;
        for (metric, found) in [
            (StopMetric::Rmse, &mut scored.rmse_mm),
            (StopMetric::Median, &mut scored.median_mm),
        ] {
            if let Some(look) = campaign.as_ref().and_then(|c| c.look_of(metric, found)) {
                (found.low, found.high) = (look.low_mm, look.high_mm);
            }
        }
        analysis.warnings.extend(campaign.as_ref().map(|found| {
            let (looks, declared) = (found.looks.len(), found.declared);
            Warning::from(match found.decided {
                Some(_) => WarningCause::SequentialLooks { looks, declared },
                None => WarningCause::UndecidedLooks {
                    looks,
                    declared,
                    question: found.question,
                },
            })
        }));
        if self.session.reader.seal()?.is_none() {
            analysis.warnings.insert(0, WarningCause::NotSealed.into());
        }
        let without = wanted_reaction(plan_json).and_then(|wanted| {
            let attempt = |p: &PressResult| outcomes.get(&p.press).map(|o| o.attempt);
            without_reaction(&analysis, &touches, wanted, attempt)
        });
        analysis.warnings.extend(without.map(Warning::from));
        let short = stopped_when_felt(&self.input, &analysis, |press| {
            outcomes.get(&press).copied()
        });
        analysis.warnings.extend(short.map(Warning::from));
        Ok(AnalyzedSession {
            analysis: Analysis {
                campaign,
                felt,
                reference,
                motion,
                ..analysis
            },
            legs: self.input.legs,
            session: self.session,
        })
    }
}

/// Scored presses that braked on their way down because they were felt, with their depth.
fn stopped_when_felt<'o>(
    input: &SessionInput,
    analysis: &Analysis,
    outcome: impl Fn(PressId) -> Option<&'o PressOutcome>,
) -> Option<WarningCause> {
    let rows = analysis.presses.iter();
    let scored = rows.filter(|p| p.role == PressRole::Score && p.verdict != Verdict::Missed);
    let stopped = scored.filter(|p| input.stopped.contains(&p.press));
    let depth_mm = |p: &PressResult| outcome(p.press)?.measured_depth_mm;
    let mut depths_mm: Vec<f64> = stopped.filter_map(depth_mm).collect();
    Some(WarningCause::StoppedWhenFelt {
        presses: depths_mm.len() as u32,
        depth_mm: quantile(&mut depths_mm, 0.5)?,
    })
}

/// Opens a session and analyses it, through all stages.
///
/// # Errors
/// [`ResultsError`] of any stage.
pub fn analyze(path: &Path, options: AnalysisOptions<'_>) -> Result<AnalyzedSession, ResultsError> {
    Session::open(path, options)?
        .read_input()?
        .align()
        .analyze()
}

/// What scored presses of a plan do when they are felt; `None` if they go on.
fn wanted_reaction(plan_json: &str) -> Option<Reaction> {
    #[derive(serde::Deserialize)]
    struct Part {
        online: Option<Online>,
    }
    let part: Part = serde_json::from_str(plan_json).ok()?;
    Some(part.online?.react?.then)
}

/// The valid scored presses that did not do what they should when they are felt; `None` if all did. `attempt` gives the one that counts.
fn without_reaction(
    analysis: &Analysis,
    touches: &[TouchEstimate],
    wanted: Reaction,
    attempt: impl Fn(&PressResult) -> Option<AttemptId>,
) -> Option<WarningCause> {
    let own = touches.iter().filter(|t| t.kind == wanted.kind());
    let reactions: BTreeSet<AttemptId> = own.filter_map(|t| t.attempt).collect();
    let counts = |p: &&PressResult| p.role == PressRole::Score && p.verdict == Verdict::Valid;
    let scored = || analysis.presses.iter().filter(counts);
    let reacted = scored().filter(|p| attempt(p).is_some_and(|a| reactions.contains(&a)));
    let (reacted, presses) = (reacted.count() as u32, scored().count() as u32);
    (reacted < presses).then_some(WarningCause::WithoutReaction {
        wanted,
        reacted,
        presses,
    })
}

/// The robot's path compared with its commands, in full around the presses with a rate close-up.
fn motion(reader: &SessionReader, analysis: &Analysis) -> Result<Option<Motion>, RecorderError> {
    let is_close = |p: &&PressResult| analysis.zooms.iter().any(|z| z.press == p.press);
    let presses = analysis.presses.iter().filter(is_close);
    let mut course = MotionCourse::new(presses.filter_map(|p| Some((p.press, p.timing?))));
    let (from, to) = (HostTime(i64::MIN), HostTime(i64::MAX));
    reader.for_each_pose_block(from, to, |samples| course.push(samples))?;
    Ok(course.finish())
}
