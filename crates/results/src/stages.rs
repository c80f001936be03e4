//! The stages from an open session to its analysis; each one returns its own value.

use std::path::Path;

use skinrig_analysis::motion::MotionCourse;
use skinrig_analysis::reference_code::reference_code;
use skinrig_analysis::result::{Motion, PressResult};
use skinrig_analysis::{Analysis, Keep, LegStart, SessionInput, analyze_and_keep, legs};
use skinrig_model::HostTime;
use skinrig_recorder::{RecorderError, SessionReader};

use crate::error::ResultsError;
use crate::events::SessionEvents;
use crate::session::Session;
use crate::settings::Choices;

/// Everything the analysis needs but the events, in the times in which each leg was recorded.
pub struct Recorded {
    /// The session.
    pub session: Session,
    /// What it holds.
    pub input: SessionInput,
}

/// The same with the legs of a resumed run in one time, and the events in it.
pub struct Aligned {
    /// The session.
    pub session: Session,
    /// What it holds.
    pub input: SessionInput,
    /// Its events.
    pub events: SessionEvents,
}

/// A session and its complete analysis.
pub struct Analyzed {
    /// The session.
    pub session: Session,
    /// Where its further legs begin, as they were aligned.
    pub legs: Vec<LegStart>,
    /// The analysis.
    pub analysis: Analysis,
}

impl Recorded {
    /// Brings the legs of a resumed run to one time.
    #[must_use]
    pub fn align(mut self) -> Aligned {
        legs::align(&mut self.input);
        let formats = self.session.header.stream_formats;
        let events = SessionEvents::new(&self.session.path, formats, &self.input.legs);
        Aligned {
            session: self.session,
            input: self.input,
            events,
        }
    }
}

impl Aligned {
    /// The complete analysis.
    ///
    /// # Errors
    /// [`ResultsError::Analysis`] when the analysis rejects its input, [`ResultsError::Session`] when the poses cannot be read.
    pub fn analyze(self) -> Result<Analyzed, ResultsError> {
        // The public code judges calibrating presses too.
        let wants_reference = self.session.reference_code;
        let keep = if wants_reference {
            Keep::All
        } else {
            Keep::Scored
        };
        let (analysis, kept) = analyze_and_keep(&self.input, &self.events, keep)?;
        let reference = wants_reference.then(|| reference_code(&self.input, &analysis, &kept));
        let motion = motion(&self.session.reader, &analysis)?;
        Ok(Analyzed {
            analysis: Analysis {
                reference,
                motion,
                ..analysis
            },
            legs: self.input.legs,
            session: self.session,
        })
    }
}

/// Opens a session and analyses it: all stages.
///
/// # Errors
/// [`ResultsError`] of any stage.
pub fn analyze(path: &Path, choices: Choices<'_>) -> Result<Analyzed, ResultsError> {
    Session::open(path, choices)?.recorded()?.align().analyze()
}

/// The robot's path against its commands, in full around the presses that the report looks at closely.
fn motion(reader: &SessionReader, analysis: &Analysis) -> Result<Option<Motion>, RecorderError> {
    let is_close = |p: &&PressResult| analysis.zooms.iter().any(|z| z.press == p.press);
    let presses = analysis.presses.iter().filter(is_close);
    let mut course = MotionCourse::new(presses.filter_map(|p| Some((p.press, p.timing?))));
    let (from, to) = (HostTime(i64::MIN), HostTime(i64::MAX));
    reader.for_each_pose_block(from, to, |samples| course.push(samples))?;
    Ok(course.finish())
}
