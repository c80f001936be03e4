//! Owns the DevTools connection: calls, answers, and events.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{ChildStdin, ChildStdout};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Timeout of an answer; even the slowest machine is faster.
const PATIENCE: Duration = Duration::from_secs(120);

/// Why the browser could not be driven.
#[derive(Debug, thiserror::Error)]
pub enum BrowserError {
    /// No browser on this machine.
    #[error("{0}")]
    Absent(String),
    /// It could not be started, or its pipe broke.
    #[error("browser: {0}")]
    Io(#[from] std::io::Error),
    /// It ended, or did not answer in time.
    #[error("browser: expected {0}, found none within {PATIENCE:?}")]
    Silent(String),
    /// It rejected a call.
    #[error("browser: {method}: {reason}")]
    Refused {
        /// Name of the method.
        method: String,
        /// Message of the browser.
        reason: String,
    },
}

/// An event from the browser.
#[derive(Debug, Clone)]
pub struct Event {
    /// Name, such as `Page.loadEventFired`.
    pub method: String,
    /// Parameters.
    pub params: Value,
}

/// A DevTools connection.
#[derive(Debug)]
pub(crate) struct Devtools {
    to: ChildStdin,
    from: Receiver<Value>,
    last_id: u64,
    events: VecDeque<Event>,
}

impl Devtools {
    pub(crate) fn new(to: ChildStdin, from: ChildStdout) -> Self {
        Self {
            to,
            from: listen(from),
            last_id: 0,
            events: VecDeque::new(),
        }
    }

    /// Calls a method, in a target's session or on the browser itself, and waits for its answer.
    pub(crate) fn call(
        &mut self,
        session: Option<&str>,
        method: &str,
        params: Value,
    ) -> Result<Value, BrowserError> {
        self.last_id += 1;
        let mut message = json!({ "id": self.last_id, "method": method, "params": params });
        if let Some(session) = session {
            message["sessionId"] = json!(session);
        }
        let mut bytes = message.to_string().into_bytes();
        bytes.push(0);
        self.to.write_all(&bytes)?;
        self.to.flush()?;
        let end = Instant::now() + PATIENCE;
        loop {
            let message = self.next(end, method)?;
            if message["id"] != json!(self.last_id) {
                self.events.extend(event(message));
                continue;
            }
            if let Some(error) = message.get("error") {
                return Err(BrowserError::Refused {
                    method: method.to_owned(),
                    reason: error["message"].as_str().unwrap_or_default().to_owned(),
                });
            }
            return Ok(message["result"].clone());
        }
    }

    /// The next event that `accepts` accepts; earlier ones stay queued.
    pub(crate) fn wait(
        &mut self,
        what: &str,
        accepts: impl Fn(&Event) -> bool,
    ) -> Result<Event, BrowserError> {
        let end = Instant::now() + PATIENCE;
        loop {
            let at = self.events.iter().position(&accepts);
            if let Some(event) = at.and_then(|at| self.events.remove(at)) {
                return Ok(event);
            }
            let message = self.next(end, what)?;
            self.events.extend(event(message));
        }
    }

    /// All queued events.
    pub(crate) fn events(&mut self) -> Vec<Event> {
        self.events.extend(self.from.try_iter().filter_map(event));
        self.events.drain(..).collect()
    }

    fn next(&self, end: Instant, what: &str) -> Result<Value, BrowserError> {
        let left = end.saturating_duration_since(Instant::now());
        self.from.recv_timeout(left).map_err(|e| {
            BrowserError::Silent(match e {
                RecvTimeoutError::Timeout => what.to_owned(),
                RecvTimeoutError::Disconnected => format!("{what}, but it ended"),
            })
        })
    }
}

fn event(message: Value) -> Option<Event> {
    Some(Event {
        method: message["method"].as_str()?.to_owned(),
        params: message["params"].clone(),
    })
}

/// Reads messages until the browser ends.
fn listen(from: impl Read + Send + 'static) -> Receiver<Value> {
    let (to, out) = channel();
    std::thread::spawn(move || {
        for message in BufReader::new(from).split(0) {
            let Ok(message) = message else { return };
            let Ok(message) = serde_json::from_slice(&message) else {
                continue;
            };
            if to.send(message).is_err() {
                return;
            }
        }
    });
    out
}
