//! Exit codes and the errors behind them.

use std::fmt;
use std::process::{ExitCode, Termination};

use skinrig_nightly::NightExit;
use skinrig_protocol::Diagnostics;
use skinrig_recorder::RecorderError;
use skinrig_results::ResultsError;

/// Exit status of the program. The numbers are part of the interface and do not change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// Success.
    Ok,
    /// A fault of skinrig itself, or of the machine (disk full, no permission).
    Internal,
    /// Bad input: command line, protocol, schedule, data file or session file.
    Input,
    /// A check before a run failed, or a device, the trigger line or the recorder during it; or the run finished with presses
    /// lost to rig faults. The recorded part of the session is kept.
    Rig,
    /// A stated limit was not met: `--max-rmse`, `verify`, the alignment of the clocks (an INVALID session).
    Limit,
    /// The operator stopped or aborted the run; the recorded part of the session is kept.
    Stopped,
    /// Result of a suite of checks; `hil run` has its own codes.
    Night(NightExit),
}

impl Exit {
    /// Exit code of the process.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Ok => 0,
            Self::Internal => 1,
            Self::Input => 2,
            Self::Rig => 3,
            Self::Limit => 4,
            Self::Stopped => 5,
            Self::Night(night) => night as u8,
        }
    }

    /// All codes with their meaning, for `--help`.
    pub(crate) const HELP: &'static str = "Exit codes:\n  \
        0  done\n  \
        1  fault of skinrig or of this machine\n  \
        2  bad input: command line, protocol, schedule, data or session file\n  \
        3  rig fault, failed check before a run, or presses lost to rig faults\n     \
        (recorded data are kept)\n  \
        4  a limit was not met (--max-rmse, verify, an INVALID session)\n  \
        5  stopped by the operator (recorded data are kept)";
}

impl Termination for Exit {
    fn report(self) -> ExitCode {
        ExitCode::from(self.code())
    }
}

/// Failure of a command: a message for the user and an exit code.
#[derive(Debug)]
pub struct Failure {
    /// The exit code.
    pub exit: Exit,
    /// Complete message for standard error, without the end of line.
    pub message: String,
    /// True if a file is not a session, is damaged, or was changed after it was recorded.
    pub is_damage: bool,
}

impl Failure {
    fn new(exit: Exit, message: impl fmt::Display) -> Self {
        let message = format!("error: {message}");
        Self {
            exit,
            message,
            is_damage: false,
        }
    }

    /// Bad input.
    pub fn input(message: impl fmt::Display) -> Self {
        Self::new(Exit::Input, message)
    }

    /// Findings in a protocol or schedule; each one already begins with `error:`.
    pub fn findings(found: &Diagnostics) -> Self {
        let message = found.render(crate::terminal::is_coloured(&std::io::stderr()));
        Self {
            exit: Exit::Input,
            message: message.trim_end().to_owned(),
            is_damage: false,
        }
    }

    /// A fault of the program or the machine.
    pub fn internal(message: impl fmt::Display) -> Self {
        Self::new(Exit::Internal, message)
    }

    /// A session that could not be read: bad input, unless the machine failed.
    pub fn session(error: RecorderError) -> Self {
        let is_damage = error.is_damage();
        let failure = if error.is_system_failure() {
            Self::internal(error)
        } else {
            Self::input(error)
        };
        Self {
            is_damage,
            ..failure
        }
    }

    /// A rig fault.
    pub fn rig(message: impl fmt::Display) -> Self {
        Self::new(Exit::Rig, message)
    }

    /// The operator ended the run.
    pub(crate) fn stopped(message: String) -> Self {
        Self {
            exit: Exit::Stopped,
            message,
            is_damage: false,
        }
    }

    /// A limit that was not met.
    pub fn limit(message: impl fmt::Display) -> Self {
        Self::new(Exit::Limit, message)
    }
}

impl From<ResultsError> for Failure {
    fn from(error: ResultsError) -> Self {
        match error {
            ResultsError::Session(error) => Self::session(error),
            ResultsError::Settings(found) => Self::findings(&found),
            other => {
                let source = std::error::Error::source(&other);
                let recorder = source.and_then(|s| s.downcast_ref::<RecorderError>());
                Self {
                    is_damage: recorder.is_some_and(RecorderError::is_damage),
                    ..Self::input(&other)
                }
            }
        }
    }
}

/// What a command returns.
pub type Outcome = Result<Exit, Failure>;
