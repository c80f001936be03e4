//! A Python program that runs one task per request and waits in between.

use std::ffi::OsStr;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdout, Command, Stdio};

use serde_json::Value;

/// The interpreter: `SKINRIG_BENCH_PYTHON`, or else `python3`.
#[must_use]
pub fn interpreter() -> Command {
    Command::new(std::env::var("SKINRIG_BENCH_PYTHON").unwrap_or_else(|_| "python3".into()))
}

/// A running program that answers every input line with a line of JSON.
#[derive(Debug)]
pub struct Python {
    child: Child,
    answers: BufReader<ChildStdout>,
    versions: String,
}

impl Python {
    /// Starts the interpreter with these arguments. `None` if there is none or the program ends immediately, for example because of
    /// a missing package. The first line of its output contains its versions.
    pub fn start(arguments: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Option<Self> {
        let mut child = interpreter()
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .ok()?;
        let mut answers = BufReader::new(child.stdout.take()?);
        let mut versions = String::new();
        answers.read_line(&mut versions).ok()?;
        let versions = versions.trim().to_owned();
        (!versions.is_empty()).then_some(Self {
            child,
            answers,
            versions,
        })
    }

    /// Versions of the interpreter and its packages.
    #[must_use]
    pub fn versions(&self) -> &str {
        &self.versions
    }

    /// Sends a request and returns the answer.
    ///
    /// # Errors
    /// If the program has ended, or its answer is not JSON; the text contains that answer.
    pub fn query(&mut self, question: &str) -> Result<Value, String> {
        let failed = |e: std::io::Error| e.to_string();
        let questions = self.child.stdin.as_mut().ok_or("a closed pipe")?;
        writeln!(questions, "{question}").map_err(failed)?;
        let mut answer = String::new();
        self.answers.read_line(&mut answer).map_err(failed)?;
        serde_json::from_str(&answer).map_err(|e| format!("{question}: {e}: {answer:?}"))
    }
}

impl Drop for Python {
    fn drop(&mut self) {
        // Closing its input ends the program.
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}
