//! Looks at a running campaign: a second process analyses the session file; a replay repeats the recorded looks.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use skinrig_controller::{LookFault, LookOutcome, Looks};
use skinrig_model::{HostTime, Look};

use crate::args::TakeLookArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::subprocess::{AnswerMode, NoAnswer, Subprocess, lower_priority};

/// The hidden command that takes one look.
const TAKE_LOOK: &str = "take-look";

/// How a run takes its looks. Recorded: the look that decided, and its time.
pub(crate) type LookMode = AnswerMode<Option<(HostTime, Look)>>;

impl LookMode {
    /// Looks at the session at `path`.
    pub(crate) fn at(&self, path: &Path) -> Box<dyn Looks> {
        match self {
            Self::Recorded(decided) => Box::new(RecordedLooks(*decided)),
            source => Box::new(SessionLooks {
                session: path.to_owned(),
                waits: matches!(source, Self::Waiting),
                process: None,
                due: None,
                done: VecDeque::new(),
            }),
        }
    }
}

/// The decision of a recorded run, at its time.
struct RecordedLooks(Option<(HostTime, Look)>);

impl Looks for RecordedLooks {
    fn begin(&mut self, _: u32) {}

    fn poll(&mut self, now: HostTime) -> Option<LookOutcome> {
        let (_, look) = self.0.take_if(|(t, _)| now >= *t)?;
        Some(LookOutcome::Taken(look))
    }
}

/// Takes each look in its own process, one at a time.
struct SessionLooks {
    session: PathBuf,
    waits: bool,
    process: Option<(u32, Subprocess)>,
    /// The newest look that waits for the process.
    due: Option<u32>,
    done: VecDeque<LookOutcome>,
}

impl Looks for SessionLooks {
    fn begin(&mut self, number: u32) {
        if let Some(number) = self.due.replace(number) {
            let why = LookFault::Overtaken;
            self.done.push_back(LookOutcome::NotTaken { number, why });
        }
        self.start();
        if self.waits
            && let Some((number, process)) = self.process.take()
        {
            let outcome = outcome(number, process.finish());
            self.done.push_back(outcome);
        }
    }

    fn poll(&mut self, _: HostTime) -> Option<LookOutcome> {
        if let Some((number, mut process)) = self.process.take() {
            if process.is_running() {
                self.process = Some((number, process));
            } else {
                self.done.push_back(outcome(number, process.finish()));
                self.start();
            }
        }
        self.done.pop_front()
    }
}

impl SessionLooks {
    /// Starts the look that is due, if none is running.
    fn start(&mut self) {
        if self.process.is_some() {
            return;
        }
        let Some(number) = self.due.take() else {
            return;
        };
        let named = number.to_string();
        let session = self.session.as_os_str();
        let arguments = [
            TAKE_LOOK.as_ref(),
            session,
            "--number".as_ref(),
            named.as_ref(),
        ];
        match Subprocess::start(arguments) {
            Ok(process) => self.process = Some((number, process)),
            Err(e) => self.done.push_back(outcome(number, Err(e))),
        }
    }
}

fn outcome(number: u32, answer: Result<Look, NoAnswer>) -> LookOutcome {
    match answer {
        Ok(look) => LookOutcome::Taken(look),
        Err(e) => LookOutcome::NotTaken {
            number,
            why: LookFault::Failed(e.to_string()),
        },
    }
}

/// `skinrig take-look`: prints one look at a session as JSON.
///
/// # Errors
/// [`Failure::input`] when there is no such look.
pub(crate) fn take_look(args: &TakeLookArgs) -> Outcome {
    lower_priority();
    let look = skinrig_results::take_look(&args.session, args.number)?;
    outln!(
        "{}",
        serde_json::to_string(&look).map_err(Failure::internal)?
    );
    Ok(Exit::Ok)
}
