//! A process that brakes the arm if the process that drives it dies.
//!
//! A second process cannot open a device while the first one has it open. The supervisor therefore waits on a pipe from the driver. If
//! the pipe ends without a goodbye, the driver is dead and the device is free: the supervisor opens it and brakes until the robot
//! confirms. It runs in its own process group, so that Ctrl-C in a terminal does not end it first.
//!
//! It does not help if the program hangs. If the thread that owns the library hangs in a call, or the process is stopped, the device's
//! watchdog brakes, provided that the vendor's regulation thread stands still too. If the controlling program stops polling, the engine
//! brakes ([`crate::config::Trips::max_unwatched`]). If the computer fails, only the device's watchdog helps.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use skinrig_drd_abi::SERIAL_UNKNOWN;

use crate::brake::{BrakeError, brake};
use crate::config::{SupervisorCommand, Timeouts};
use crate::error::OmegaError;
use crate::load;
use crate::sdk::{CallError, Sdk};

const GREETING: &str = "skinrig supervise-arm 1";
const READY: &str = "ready";
const GOODBYE: &str = "goodbye";

/// Time limit for a dismissed supervisor to exit by itself.
const DISMISS_TIMEOUT: Duration = Duration::from_secs(2);

/// The supervisor is not known to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SupervisorFault {
    /// It exited.
    #[error("it exited with {0}")]
    Exited(ExitStatus),
    /// Its state could not be read.
    #[error("its state could not be read: {0}")]
    Unknown(ErrorKind),
}

/// Handle of the running supervisor in the driver's process.
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
        timeout: Duration,
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
            return Err(fail("cannot start", &"it has no stdin or stdout"));
        };
        let serial = serial.map_or_else(|| "any".to_owned(), |s| s.to_string());
        let order = format!("{GREETING}\n{}\n{serial}\n", library.display());
        pipe.write_all(order.as_bytes())
            .and_then(|()| pipe.flush())
            .map_err(|e| fail("cannot write to", &e))?;
        if is_ready(answers, timeout) {
            return Ok(Self { child, pipe });
        }
        let _ = child.kill();
        let _ = child.wait();
        Err(fail("no answer from", &format!("expected {READY:?}")))
    }

    /// Checks that the process is running.
    pub(crate) fn check(&mut self) -> Result<(), SupervisorFault> {
        match self.child.try_wait() {
            Ok(None) => Ok(()),
            Ok(Some(status)) => Err(SupervisorFault::Exited(status)),
            Err(e) => Err(SupervisorFault::Unknown(e.kind())),
        }
    }

    /// Dismisses the supervisor: the arm is braked and the device closed.
    pub(crate) fn dismiss(mut self) {
        let written = writeln!(self.pipe, "{GOODBYE}").and_then(|()| self.pipe.flush());
        drop(self.pipe);
        let deadline = Instant::now() + DISMISS_TIMEOUT;
        while written.is_ok() && Instant::now() < deadline {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        // It does not react; there is nothing left to supervise.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits for the ready line. Reads on a separate thread, so that the wait can time out.
fn is_ready(answers: impl Read + Send + 'static, timeout: Duration) -> bool {
    let (sender, receiver) = mpsc::sync_channel(1);
    let reader = move || {
        let mut lines = BufReader::new(answers).lines().map_while(Result::ok);
        let _ = sender.send(lines.any(|line| line == READY));
        // Keep reading, so that further output never blocks the process.
        lines.for_each(drop);
    };
    std::thread::Builder::new()
        .name("omega3-supervisor".to_owned())
        .spawn(reader)
        .is_ok()
        && receiver.recv_timeout(timeout).unwrap_or(false)
}

/// How supervision ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SuperviseOutcome {
    /// The driver dismissed the supervisor: the arm is braked.
    Dismissed,
    /// The driver died, and the supervisor braked the arm.
    Braked {
        /// Number of attempts.
        attempts: u32,
    },
}

/// Supervision failed.
#[derive(Debug, thiserror::Error)]
pub enum SuperviseError {
    /// Standard input is not a driver's.
    #[error("expected commands of a driver on standard input, found {0}")]
    Orders(String),
    /// No usable library.
    #[error(transparent)]
    Load(#[from] load::LoadError),
    /// The driver died and the arm could not be braked.
    #[error(
        "THE ARM MAY BE LIVE: the driver died and the arm could not be braked in {attempts} attempts ({last}); press the force button on its base or switch it off at the mains"
    )]
    BrakeUnconfirmed {
        /// Number of attempts.
        attempts: u32,
        /// Error of the last attempt.
        last: BrakeAllError,
    },
}

/// Why the arm of a dead driver could not be braked.
#[derive(Debug, thiserror::Error)]
pub enum BrakeAllError {
    /// The connected devices could not be counted.
    #[error(transparent)]
    Count(CallError),
    /// Some devices could not be opened or braked.
    #[error("{}", list(.0))]
    Devices(Vec<DeviceBrakeError>),
    /// The robot is not connected.
    #[error("the robot is not among the {count} connected devices")]
    NotConnected {
        /// Number of connected devices.
        count: i8,
    },
}

/// Why one device could not be braked.
#[derive(Debug, thiserror::Error)]
pub enum DeviceBrakeError {
    /// It could not be opened.
    #[error(transparent)]
    Open(CallError),
    /// It did not confirm the brake.
    #[error(transparent)]
    Brake(BrakeError),
}

fn list(errors: &[DeviceBrakeError]) -> String {
    let texts: Vec<String> = errors.iter().map(ToString::to_string).collect();
    texts.join("; ")
}

/// Attempts to open and brake the arm of a dead driver, 100 ms apart: one minute in total.
const ATTEMPTS: u32 = 600;

/// Runs the supervisor: waits on `orders` (standard input) for the driver's goodbye or its death, and brakes the arm after a death.
/// Writes progress for the operator to `log`.
///
/// # Errors
/// [`SuperviseError`]; the caller must display it prominently and exit with a failure.
pub fn supervise(
    orders: impl Read,
    mut answers: impl Write,
    mut log: impl Write,
) -> Result<SuperviseOutcome, SuperviseError> {
    let mut orders = BufReader::new(orders);
    let mut line = || {
        let mut line = String::new();
        orders
            .read_line(&mut line)
            .map(|_| line.trim_end().to_owned())
    };
    let mut order = || line().map_err(|e| SuperviseError::Orders(e.to_string()));
    let greeting = order()?;
    if greeting != GREETING {
        return Err(SuperviseError::Orders(format!("{greeting:?}")));
    }
    let library = PathBuf::from(order()?);
    let serial = match order()?.as_str() {
        "any" => None,
        text => Some(
            text.parse::<u16>()
                .map_err(|_| SuperviseError::Orders(format!("serial {text:?}")))?,
        ),
    };
    let loaded = load::load(Some(&library))?;
    writeln!(answers, "{READY}")
        .and_then(|()| answers.flush())
        .map_err(|e| SuperviseError::Orders(e.to_string()))?;
    // A broken pipe also means that the driver died.
    if line().is_ok_and(|word| word == GOODBYE) {
        return Ok(SuperviseOutcome::Dismissed);
    }
    // Ignore write errors: braking matters more than the log.
    let _ = writeln!(
        log,
        "supervisor: the driver of the arm died; braking the arm"
    );
    let attempts = brake_until_confirmed(&loaded.library, serial)?;
    let _ = writeln!(log, "supervisor: the arm is braked ({attempts} attempts)");
    Ok(SuperviseOutcome::Braked { attempts })
}

fn brake_until_confirmed(sdk: &dyn Sdk, serial: Option<u16>) -> Result<u32, SuperviseError> {
    let once = Timeouts {
        brake_attempts: 1,
        ..Timeouts::default()
    };
    let mut last = BrakeAllError::NotConnected { count: 0 };
    for attempt in 1..=ATTEMPTS {
        match brake_all(sdk, serial, &once) {
            Ok(()) => return Ok(attempt),
            Err(error) => last = error,
        }
        std::thread::sleep(once.brake_retry);
    }
    Err(SuperviseError::BrakeUnconfirmed {
        attempts: ATTEMPTS,
        last,
    })
}

/// Brakes the robot with this serial number, or every robot whose serial number is unknown.
pub(crate) fn brake_all(
    sdk: &dyn Sdk,
    serial: Option<u16>,
    once: &Timeouts,
) -> Result<(), BrakeAllError> {
    let count = sdk.device_count().map_err(BrakeAllError::Count)?;
    let mut braked = 0;
    let mut failures = Vec::new();
    for index in 0..count {
        let id = match sdk.open(index) {
            Ok(id) => id,
            Err(e) => {
                failures.push(DeviceBrakeError::Open(e));
                continue;
            }
        };
        // A robot with an unreadable serial number may be the one; braking another free robot is harmless.
        let found = sdk.serial(id).ok().filter(|s| *s != SERIAL_UNKNOWN);
        let is_other = serial.is_some() && found.is_some() && found != serial;
        if is_other {
            let _ = sdk.close(id);
            continue;
        }
        let result = brake(sdk, id, once, |_| ());
        let _ = sdk.close(id);
        match result {
            Ok(_) if serial.is_some() && found == serial => return Ok(()),
            Ok(_) => braked += 1,
            Err(e) => failures.push(DeviceBrakeError::Brake(e.last)),
        }
    }
    if !failures.is_empty() {
        // A device that could not be opened or braked may be the one.
        return Err(BrakeAllError::Devices(failures));
    }
    if braked == 0 {
        return Err(BrakeAllError::NotConnected { count });
    }
    Ok(())
}
