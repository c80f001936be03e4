//! Analyses on this computer: one process per session, a few at a time. A process that dies takes only its session with it.

use std::io::{Read, Write};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

use super::request::{Answer, Answered, REQUEST_COMMAND, Refusal, Request};
use crate::exit::{Exit, Failure, Outcome};

/// Carries out `requests`, `jobs` at a time (`None`: one per core); calls `each` with the index of each one as it ends.
pub(super) fn run(requests: &[Request], jobs: Option<u32>, each: &mut dyn FnMut(usize, Answered)) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = jobs.map_or(cores, |jobs| jobs as usize);
    let jobs = jobs.clamp(1, requests.len().max(1));
    let threads = (cores / jobs).max(1);
    let next = AtomicUsize::new(0);
    let (ended, answers) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            let (ended, next) = (ended.clone(), &next);
            scope.spawn(move || {
                loop {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(request) = requests.get(at) else {
                        return;
                    };
                    // Fails only if the receiver is gone, which outlives this scope.
                    let _ = ended.send((at, in_a_process(request, threads)));
                }
            });
        }
        drop(ended);
        for (at, answer) in answers {
            each(at, answer);
        }
    });
}

fn in_a_process(request: &Request, threads: usize) -> Answered {
    let attempt = || -> std::io::Result<Answered> {
        let mut command = Command::new(std::env::current_exe()?);
        command.arg(REQUEST_COMMAND);
        if std::env::var_os("RAYON_NUM_THREADS").is_none() {
            command.env("RAYON_NUM_THREADS", threads.to_string());
        }
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn()?;
        if let Some(mut input) = child.stdin.take() {
            // If the process is gone, its exit status shows why.
            let _ = input.write_all(&serde_json::to_vec(request)?);
        }
        let output = child.wait_with_output()?;
        let answer = serde_json::from_slice::<Answer>(&output.stdout);
        Ok(match answer {
            Ok(Answer { error: None }) => Ok(()),
            Ok(Answer { error: Some(error) }) => Err(error),
            Err(_) => Err(Refusal::machine(format!(
                "{}: the process of its analysis ended with {}",
                request.session.display(),
                output.status
            ))),
        })
    };
    attempt().unwrap_or_else(|e| {
        Err(Refusal::machine(format!(
            "{}: cannot start its analysis: {e}",
            request.session.display()
        )))
    })
}

/// Reads a request from standard input, carries it out and prints its answer.
///
/// # Errors
/// [`Failure::input`] for anything but a request.
pub(crate) fn analyze_request() -> Outcome {
    end_with_parent();
    let mut text = String::new();
    let read = std::io::stdin().read_to_string(&mut text);
    read.map_err(Failure::internal)?;
    let request: Request = serde_json::from_str(&text)
        .map_err(|e| Failure::input(format!("expected a request, found something else: {e}")))?;
    crate::terminal::print_json(&serde_json::json!(request.answer()));
    Ok(Exit::Ok)
}

/// Ends this process when the one that started it dies: a repeated command then never works beside it.
fn end_with_parent() {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Signal, set_parent_process_death_signal};
        // Without it the process finishes its session, which does no harm.
        let _ = set_parent_process_death_signal(Some(Signal::KILL));
    }
}
