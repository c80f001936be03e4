//! A small process that brakes the arm when the process that drives it dies.
//!
//! A second process cannot open a device while the first one holds it. So the supervisor waits on a pipe from the
//! driver; when the pipe ends without a goodbye, the driver is dead and the device free: the supervisor opens it and
//! brakes until the robot confirms. It has its own process group, so that Ctrl-C in a terminal does not end it first.
//!
//! It does not help against a program that hangs while alive. When the thread that owns the library hangs in a call, or
//! the whole process is stopped, the device's watchdog does, as far as the vendor's own regulation thread stands still
//! too; when whoever drives the arm stops polling, the engine does ([`crate::config::Trips::max_unwatched`]). Against a
//! broken computer only the device's watchdog helps.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use skinrig_drd_abi::SERIAL_UNKNOWN;

use crate::brake::brake;
use crate::config::{Patience, SupervisorCommand};
use crate::error::OmegaError;
use crate::load;
use crate::sdk::Sdk;

const GREETING: &str = "skinrig supervise-arm 1";
const READY: &str = "ready";
const GOODBYE: &str = "goodbye";

/// Longest time that a dismissed supervisor may take to end by itself.
const DISMISSED_WITHIN: Duration = Duration::from_secs(2);

/// The driver's end: the running supervisor.
#[derive(Debug)]
pub(crate) struct Supervisor {
    child: Child,
    pipe: ChildStdin,
}

impl Supervisor {
    /// Starts the supervisor for the robot with `serial` and waits until it has loaded the library.
    pub(crate) fn start(
        command: &SupervisorCommand,
        library: &Path,
        serial: Option<u16>,
        patience: Duration,
    ) -> Result<Self, OmegaError> {
        let fail = |what: &str, e: &dyn std::fmt::Display| {
            OmegaError::Supervisor(format!("{what} {}: {e}", command.program.display()))
        };
        let mut process = Command::new(&command.program);
        process
            .args(&command.arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut process, 0);
        let mut child = process.spawn().map_err(|e| fail("cannot start", &e))?;
        let (Some(mut pipe), Some(answers)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(fail("cannot start", &"it has no pipes"));
        };
        let serial = serial.map_or_else(|| "any".to_owned(), |s| s.to_string());
        let order = format!("{GREETING}\n{}\n{serial}\n", library.display());
        pipe.write_all(order.as_bytes())
            .and_then(|()| pipe.flush())
            .map_err(|e| fail("cannot write to", &e))?;
        if is_ready(answers, patience) {
            return Ok(Self { child, pipe });
        }
        let _ = child.kill();
        let _ = child.wait();
        Err(fail("no answer from", &format!("expected {READY:?}")))
    }

    /// Whether it still runs.
    pub(crate) fn check(&mut self) -> Result<(), String> {
        match self.child.try_wait() {
            Ok(None) => Ok(()),
            Ok(Some(status)) => Err(format!("it ended with {status}")),
            Err(e) => Err(e.to_string()),
        }
    }

    /// The arm is braked and the device closed: it may go.
    pub(crate) fn dismiss(mut self) {
        let said = writeln!(self.pipe, "{GOODBYE}").and_then(|()| self.pipe.flush());
        drop(self.pipe);
        let deadline = Instant::now() + DISMISSED_WITHIN;
        while said.is_ok() && Instant::now() < deadline {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        // It does not hear; there is nothing left to guard.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Whether a line of `answers` says so; read on a thread of its own so that the wait has an end.
fn is_ready(answers: impl Read + Send + 'static, patience: Duration) -> bool {
    let (tell, hear) = mpsc::sync_channel(1);
    let reader = move || {
        let mut lines = BufReader::new(answers).lines().map_while(Result::ok);
        let _ = tell.send(lines.any(|line| line == READY));
        // Whatever it still prints goes nowhere, and does not stop it.
        lines.for_each(drop);
    };
    std::thread::Builder::new()
        .name("omega3-supervisor".to_owned())
        .spawn(reader)
        .is_ok()
        && hear.recv_timeout(patience).unwrap_or(false)
}

/// How a watch ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Watch {
    /// The driver said goodbye: the arm is braked.
    Dismissed,
    /// The driver died; the arm was braked after this many attempts.
    Braked {
        /// Attempts to open and brake.
        attempts: u32,
    },
}

/// A watch that could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// Not started by a driver.
    #[error("expected the orders of a driver on standard input, found {0}")]
    Orders(String),
    /// No usable library.
    #[error(transparent)]
    Load(#[from] load::LoadError),
    /// The driver died and the arm could not be braked.
    #[error(
        "THE ARM MAY BE LIVE: the driver died and the arm could not be braked in {attempts} attempts ({last}); press the force button on its base or switch it off at the mains"
    )]
    MayBeLive {
        /// How often it was tried.
        attempts: u32,
        /// What the last attempt met.
        last: String,
    },
}

/// Attempts to open and brake the arm of a dead driver, 100 ms apart: one minute.
const ATTEMPTS: u32 = 600;

/// The supervisor process: waits on `orders` (standard input) for the driver's goodbye or its death, and in the
/// second case brakes the arm. Progress for people goes to `log`.
///
/// # Errors
/// [`WatchError`]; whoever calls prints it as loudly as possible and exits with a failure.
pub fn supervise(
    orders: impl Read,
    mut answers: impl Write,
    mut log: impl Write,
) -> Result<Watch, WatchError> {
    let mut orders = BufReader::new(orders);
    let mut line = || {
        let mut line = String::new();
        orders
            .read_line(&mut line)
            .map(|_| line.trim_end().to_owned())
    };
    let mut order = || line().map_err(|e| WatchError::Orders(e.to_string()));
    let greeting = order()?;
    if greeting != GREETING {
        return Err(WatchError::Orders(format!("{greeting:?}")));
    }
    let library = PathBuf::from(order()?);
    let serial = match order()?.as_str() {
        "any" => None,
        text => Some(
            text.parse::<u16>()
                .map_err(|_| WatchError::Orders(format!("serial {text:?}")))?,
        ),
    };
    let loaded = load::load(Some(&library))?;
    writeln!(answers, "{READY}")
        .and_then(|()| answers.flush())
        .map_err(|e| WatchError::Orders(e.to_string()))?;
    // A broken pipe is the driver's death as well.
    if line().is_ok_and(|word| word == GOODBYE) {
        return Ok(Watch::Dismissed);
    }
    // Nobody may read the log any more; braking matters more.
    let _ = writeln!(
        log,
        "supervisor: the driver of the arm died: braking the arm"
    );
    let attempts = rescue(&loaded.library, serial)?;
    let _ = writeln!(log, "supervisor: the arm is braked ({attempts} attempts)");
    Ok(Watch::Braked { attempts })
}

fn rescue(sdk: &dyn Sdk, serial: Option<u16>) -> Result<u32, WatchError> {
    let once = Patience {
        brake_attempts: 1,
        ..Patience::default()
    };
    let mut last = "no device".to_owned();
    for attempt in 1..=ATTEMPTS {
        match brake_all(sdk, serial, &once) {
            Ok(()) => return Ok(attempt),
            Err(why) => last = why,
        }
        std::thread::sleep(once.brake_retry);
    }
    Err(WatchError::MayBeLive {
        attempts: ATTEMPTS,
        last,
    })
}

/// Opens the robot and brakes it; every one whose serial is not known to be another is taken for it.
pub(crate) fn brake_all(sdk: &dyn Sdk, serial: Option<u16>, once: &Patience) -> Result<(), String> {
    let count = sdk.device_count().map_err(|e| e.to_string())?;
    let mut braked = 0;
    let mut problems = Vec::new();
    for index in 0..count {
        let id = match sdk.open(index) {
            Ok(id) => id,
            Err(e) => {
                problems.push(e.to_string());
                continue;
            }
        };
        // A robot whose serial cannot be read may be the one: braking another one that is free harms nobody.
        let found = sdk.serial(id).ok().filter(|s| *s != SERIAL_UNKNOWN);
        let another = serial.is_some() && found.is_some() && found != serial;
        if another {
            let _ = sdk.close(id);
            continue;
        }
        let answer = brake(sdk, id, once, |_| ());
        let _ = sdk.close(id);
        match answer {
            Ok(_) if serial.is_some() && found == serial => return Ok(()),
            Ok(_) => braked += 1,
            Err(e) => problems.push(e.last),
        }
    }
    if !problems.is_empty() {
        // One that could not be opened or braked may be the one.
        return Err(problems.join("; "));
    }
    if braked == 0 {
        return Err(format!("it is not among the {count} connected devices"));
    }
    Ok(())
}
