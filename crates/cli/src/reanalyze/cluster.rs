//! Analyses on a Dask cluster: a Python program hands each request to a worker, which runs this program on it.

use std::ffi::OsString;
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};

use serde::Deserialize;

use super::request::{Answer, Answered, Refusal, Request};
use crate::exit::Failure;
use crate::phase::Phase;

/// Reads requests and prints a [`Line`] for each.
const PROGRAM: &str = include_str!("dask.py");
/// Names the interpreter.
const INTERPRETER: &str = "SKINRIG_PYTHON";

/// A line of the program.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Line {
    /// A request was carried out.
    Answered { at: usize, answer: Answer },
    /// A request was lost to a fault of a machine.
    Lost { at: usize, lost: String },
    /// A notice while the cluster works.
    Note { note: String },
    /// Nothing can be carried out.
    Failed { failed: String },
}

/// Carries out `requests` on the cluster of `scheduler`; calls `each` with the index of each one as it ends.
///
/// # Errors
/// [`Failure::internal`] if there is no such cluster, or no Python with the package `distributed`.
pub(super) fn run(
    requests: &[Request],
    scheduler: &str,
    phase: &Phase,
    each: &mut dyn FnMut(usize, Answered),
) -> Result<(), Failure> {
    let python = std::env::var_os(INTERPRETER).unwrap_or_else(|| OsString::from("python3"));
    let mut child = Command::new(&python)
        .args(["-c", PROGRAM, scheduler])
        .arg(std::env::current_exe().map_err(Failure::internal)?)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|e| {
            Failure::internal(format!(
                "{}: cannot start: {e}\n  next: install Python 3, or name its interpreter in {INTERPRETER}",
                python.to_string_lossy()
            ))
        })?;
    if let Some(mut input) = child.stdin.take() {
        for request in requests {
            let mut line = serde_json::to_vec(request).map_err(Failure::internal)?;
            line.push(b'\n');
            // If the program is gone, its output shows why.
            let _ = input.write_all(&line);
        }
    }
    let mut is_open = vec![true; requests.len()];
    let mut end = |at: usize, answer: Answered| {
        if let Some(open) = is_open.get_mut(at)
            && std::mem::take(open)
        {
            each(at, answer);
        }
    };
    let mut failed = None;
    for line in child
        .stdout
        .take()
        .into_iter()
        .flat_map(|out| BufReader::new(out).lines())
    {
        let line = line.map_err(Failure::internal)?;
        match serde_json::from_str(&line) {
            Ok(Line::Answered { at, answer }) => end(at, answer.error.map_or(Ok(()), Err)),
            Ok(Line::Lost { at, lost }) => end(at, Err(Refusal::machine(lost))),
            Ok(Line::Note { note }) => phase.above(|| errln!("note: {note}")),
            Ok(Line::Failed { failed: why }) => failed = Some(why),
            Err(_) => phase.above(|| errln!("{line}")),
        }
    }
    let status = child.wait().map_err(Failure::internal)?;
    if let Some(why) = failed {
        return Err(Failure::internal(why));
    }
    for (at, request) in requests.iter().enumerate() {
        if is_open[at] {
            let why = format!(
                "{}: expected an answer of the cluster at {scheduler}, found its connection ended ({status})",
                request.session.display()
            );
            each(at, Err(Refusal::machine(why)));
        }
    }
    Ok(())
}
