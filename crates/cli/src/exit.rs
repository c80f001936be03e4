//! Exit codes and the errors behind them.

use std::fmt;
use std::io::IsTerminal;
use std::process::{ExitCode, Termination};

use skinrig_protocol::Diagnostics;

/// How the program ended. The numbers are part of the interface and do not change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Everything asked for was done.
    Ok = 0,
    /// A fault of skinrig itself, or of the machine (disk full, no permission).
    Internal = 1,
    /// Bad input: command line, protocol, schedule, data file or session file.
    Input = 2,
    /// A check before a run failed, or a device, the trigger line or the recorder during it; the session up to there is
    /// kept.
    Rig = 3,
    /// A stated limit was not met: `--max-rmse`, `verify`, the alignment of the clocks (an INVALID session).
    Limit = 4,
    /// The operator stopped or aborted the run; the session up to there is kept.
    Stopped = 5,
}

impl Exit {
    /// All codes with their meaning, for `--help`.
    pub const HELP: &'static str = "Exit codes:\n  \
        0  done\n  \
        1  fault of skinrig or of this machine\n  \
        2  bad input: command line, protocol, schedule, data or session file\n  \
        3  rig fault, or a failed check before a run (the session up to there is kept)\n  \
        4  a limit was not met (--max-rmse, verify, an INVALID session)\n  \
        5  stopped by the operator (the session up to there is kept)";
}

impl Termination for Exit {
    fn report(self) -> ExitCode {
        ExitCode::from(self as u8)
    }
}

/// What a command failed with: a message for the user and the code to end with.
#[derive(Debug)]
pub struct Failure {
    /// The code to end with.
    pub exit: Exit,
    /// Complete message for standard error, without the end of line.
    pub message: String,
}

impl Failure {
    fn new(exit: Exit, message: impl fmt::Display) -> Self {
        let message = format!("error: {message}");
        Self { exit, message }
    }

    /// Bad input.
    pub fn input(message: impl fmt::Display) -> Self {
        Self::new(Exit::Input, message)
    }

    /// Findings in a protocol or schedule; each one already begins with `error:`.
    pub fn findings(found: &Diagnostics) -> Self {
        let message = found.render(std::io::stderr().is_terminal());
        Self {
            exit: Exit::Input,
            message: message.trim_end().to_owned(),
        }
    }

    /// A fault of the program or the machine.
    pub fn internal(message: impl fmt::Display) -> Self {
        Self::new(Exit::Internal, message)
    }

    /// A rig fault.
    pub fn rig(message: impl fmt::Display) -> Self {
        Self::new(Exit::Rig, message)
    }

    /// A limit that was not met.
    pub fn limit(message: impl fmt::Display) -> Self {
        Self::new(Exit::Limit, message)
    }
}

/// What a command returns.
pub type Outcome = Result<Exit, Failure>;
