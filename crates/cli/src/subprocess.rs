//! Another process of skinrig that answers one question about a session that is under way.
//!
//! Another process, because closing a file drops the locks of its process on it, here those of the recorder; and because a
//! run must survive whatever its analysis does.

use std::ffi::OsStr;
use std::io::Read;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;

/// Politeness of such a process: the run comes first.
const NICE: i32 = 10;

/// Lowers the priority of this process. A denied priority makes its answer no less right.
pub(crate) fn be_polite() {
    let _ = rustix::process::nice(NICE);
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoAnswer {
    /// It could not be started or read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// It said why.
    #[error("{0}")]
    Said(String),
    /// It ended without a word.
    #[error("its process ended with {0}")]
    Ended(ExitStatus),
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

    /// Waits for the end; returns what it printed.
    pub(crate) fn finish(mut self) -> Result<String, NoAnswer> {
        let ended = self.child.wait()?;
        let answer = text(self.answer.take())?;
        let message = text(self.message.take())?;
        if ended.success() {
            return Ok(answer);
        }
        let first = message.lines().next().map(str::to_owned);
        Err(first.map_or(NoAnswer::Ended(ended), NoAnswer::Said))
    }
}

impl Drop for Subprocess {
    fn drop(&mut self) {
        // Both fail only for a process that has ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
