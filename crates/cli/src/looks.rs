//! Looks at a campaign that is under way: another process analyses the session file, and a replay repeats the recorded ones.
//!
//! Another process, because closing a file drops the locks of its process on it, here those of the recorder; and because a
//! run must survive whatever its analysis does.

use std::collections::VecDeque;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use skinrig_controller::{LookFault, LookOutcome, Looks};
use skinrig_model::{HostTime, Look};

use crate::args::TakeLookArgs;
use crate::exit::{Exit, Failure, Outcome};

/// The hidden command that takes one look.
const TAKE_LOOK: &str = "take-look";
/// Politeness of that process: the run comes first.
const NICE: i32 = 10;

/// How a run takes its looks.
#[derive(Debug, Clone, Default)]
pub(crate) enum LookMode {
    /// While the run continues.
    #[default]
    Background,
    /// While the time of the rig stands still.
    Waiting,
    /// As recorded: when, and the look that decided.
    Recorded(Option<(HostTime, Look)>),
}

impl LookMode {
    /// On the simulated rig, whose time stands still between two steps unless it runs in real time.
    pub(crate) const fn of_simulation(real_time: bool) -> Self {
        if real_time {
            Self::Background
        } else {
            Self::Waiting
        }
    }

    /// Looks at the session at `path`.
    pub(crate) fn at(&self, path: &Path) -> Box<dyn Looks> {
        match self {
            Self::Recorded(decided) => Box::new(RecordedLooks(*decided)),
            mode => Box::new(SessionLooks {
                session: path.to_owned(),
                waits: matches!(mode, Self::Waiting),
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

/// Looks by a process each, one at a time.
struct SessionLooks {
    session: PathBuf,
    waits: bool,
    process: Option<(u32, LookProcess)>,
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
        match LookProcess::start(&self.session, number) {
            Ok(process) => self.process = Some((number, process)),
            Err(e) => self
                .done
                .push_back(outcome(number, Err(LookFault::Failed(e.to_string())))),
        }
    }
}

fn outcome(number: u32, found: Result<Look, LookFault>) -> LookOutcome {
    match found {
        Ok(look) => LookOutcome::Taken(look),
        Err(why) => LookOutcome::NotTaken { number, why },
    }
}

/// A running look; killed when dropped, so that it never delays the seal.
struct LookProcess(Child);

impl LookProcess {
    fn start(session: &Path, number: u32) -> std::io::Result<Self> {
        let child = Command::new(std::env::current_exe()?)
            .arg(TAKE_LOOK)
            .arg(session)
            .args(["--number", &number.to_string()])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        Ok(Self(child))
    }

    fn is_running(&mut self) -> bool {
        matches!(self.0.try_wait(), Ok(None))
    }

    /// Waits for the end. The output is short enough for its pipe.
    fn finish(mut self) -> Result<Look, LookFault> {
        let failed = |e: &dyn std::fmt::Display| LookFault::Failed(e.to_string());
        let (mut answer, mut message) = (String::new(), String::new());
        let ended = self.0.wait().map_err(|e| failed(&e))?;
        let pipes = (self.0.stdout.take(), self.0.stderr.take());
        if let (Some(mut out), Some(mut err)) = pipes {
            out.read_to_string(&mut answer).map_err(|e| failed(&e))?;
            err.read_to_string(&mut message).map_err(|e| failed(&e))?;
        }
        if !ended.success() {
            let first = message.lines().next().map(str::to_owned);
            return Err(LookFault::Failed(
                first.unwrap_or_else(|| format!("its process ended with {ended}")),
            ));
        }
        serde_json::from_str(&answer).map_err(|e| failed(&e))
    }
}

impl Drop for LookProcess {
    fn drop(&mut self) {
        // Both fail only for a process that has ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// `skinrig take-look`: prints one look at a session as JSON.
///
/// # Errors
/// [`Failure::input`] when there is no such look.
pub(crate) fn take_look(args: &TakeLookArgs) -> Outcome {
    // A denied priority makes the look no less right.
    let _ = rustix::process::nice(NICE);
    let look = skinrig_results::take_look(&args.session, args.number)?;
    outln!(
        "{}",
        serde_json::to_string(&look).map_err(Failure::internal)?
    );
    Ok(Exit::Ok)
}
