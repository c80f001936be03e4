//! A second skinrig process that analyses the session of a running campaign and prints its answer as JSON.
//!
//! It is a process and not a thread for two reasons: closing a file releases all locks of the closing process on it, here
//! those of the recorder; and a run must survive a crash of its analysis.

use std::ffi::OsStr;
use std::io::Read;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;

use serde::de::DeserializeOwned;

/// Added to the nice value of such a process: the run has priority.
const NICE: i32 = 10;

/// Lowers the priority of this process. If the system refuses, the answer only costs the run more time.
pub(crate) fn lower_priority() {
    let _ = rustix::process::nice(NICE);
}

/// How a run gets the answers of an analysis of its own session.
#[derive(Debug, Clone, Default)]
pub(crate) enum AnswerMode<R> {
    /// From a process, while the run continues.
    #[default]
    Background,
    /// From a process, while the run waits and the time of the rig stands still.
    Waiting,
    /// From a recorded run.
    Recorded(R),
}

impl<R> AnswerMode<R> {
    /// For the simulated rig, whose time stands still between two steps unless it runs in real time.
    pub(crate) const fn of_simulation(real_time: bool) -> Self {
        if real_time {
            Self::Background
        } else {
            Self::Waiting
        }
    }
}

/// Failure to get an answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoAnswer {
    /// The process could not be started or read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The process failed with this message.
    #[error("{0}")]
    Failed(String),
    /// The process ended without a message.
    #[error("its process ended with {0}")]
    Ended(ExitStatus),
    /// Its answer is not the expected JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
}

/// A running process; killed when dropped, so that it never delays the seal.
pub(crate) struct Subprocess {
    child: Child,
    answer: Option<JoinHandle<std::io::Result<String>>>,
    message: Option<JoinHandle<std::io::Result<String>>>,
}

fn read(pipe: Option<impl Read + Send + 'static>) -> Option<JoinHandle<std::io::Result<String>>> {
    let mut pipe = pipe?;
    Some(std::thread::spawn(move || {
        let mut text = String::new();
        pipe.read_to_string(&mut text).map(|_| text)
    }))
}

fn text(reader: Option<JoinHandle<std::io::Result<String>>>) -> std::io::Result<String> {
    match reader.map(JoinHandle::join) {
        Some(Ok(text)) => text,
        _ => Ok(String::new()),
    }
}

impl Subprocess {
    /// Starts this program with other arguments.
    pub(crate) fn start<A: AsRef<OsStr>>(
        arguments: impl IntoIterator<Item = A>,
    ) -> Result<Self, NoAnswer> {
        let mut child = Command::new(std::env::current_exe()?)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let (answer, message) = (read(child.stdout.take()), read(child.stderr.take()));
        Ok(Self {
            child,
            answer,
            message,
        })
    }

    pub(crate) fn is_running(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Waits for the end and returns the answer.
    pub(crate) fn finish<T: DeserializeOwned>(mut self) -> Result<T, NoAnswer> {
        let ended = self.child.wait()?;
        let answer = text(self.answer.take())?;
        let message = text(self.message.take())?;
        if ended.success() {
            return Ok(serde_json::from_str(&answer)?);
        }
        let first = message.lines().next().map(str::to_owned);
        Err(first.map_or(NoAnswer::Ended(ended), NoAnswer::Failed))
    }
}

impl Drop for Subprocess {
    fn drop(&mut self) {
        // Both fail only for a process that has ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
