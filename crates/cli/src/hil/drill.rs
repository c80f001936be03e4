//! The watchdog drill on a real driver: a second process holds the arm in free air and is killed.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use skinrig_device::{Indenter, RealClock};
use skinrig_hil::{Bench, DrillResult, Problem};
use skinrig_model::{Point3, Robot};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_omega3::{Omega, Remark};

use super::hold::HOLDING;
use super::real_bench::RealBench;
use super::trouble;
use crate::rig::bench;

/// The hidden command that holds the arm.
const HOLD: &str = "hold-arm";
/// Time limit until the process holds the arm: open, arm, rise and travel.
const HOLD_TIMEOUT: Duration = Duration::from_secs(60);
/// Time limit until the robot can be opened again.
const REOPEN_TIMEOUT: Duration = Duration::from_secs(20);
/// Wait after the kill. The watchdog (at most 32 ms) and the supervisor of the killed process brake
/// the arm in this time. Opening the robot earlier would brake it too, and spoil the drill.
const BRAKING_TIME: Duration = Duration::from_millis(300);
/// Polling interval of waits.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Time limit for the first position sample of a braked robot.
const POSITION_TIMEOUT: Duration = Duration::from_secs(2);

/// Starts another process that holds the arm, kills it, and reopens the robot to measure the
/// result. All devices must be closed.
///
/// # Errors
/// [`Problem`] when the drill could not be carried out.
pub(super) fn watchdog(bench: &mut RealBench) -> Result<DrillResult, Problem> {
    let mut holder = ArmHolder::start(&bench.rig().file_name)?;
    let held = holder.wait_until_held(bench)?;
    let killed = Instant::now();
    holder.kill()?;
    std::thread::sleep(BRAKING_TIME);
    // So far, only the watchdog or the supervisor can have braked the arm.
    let (mut omega, after) = reopen(bench, killed)?;
    let live = omega.remarks().contains(&Remark::MotorsWereLive);
    let why = omega.remarks().iter();
    let why = why.filter(|r| matches!(r, Remark::MotorsWentOff(_)));
    let note = why.map(ToString::to_string).next();
    let at = position(&mut omega)?;
    Ok(DrillResult {
        braked_within_s: (!live).then_some(after.as_secs_f64()),
        drop_mm: at.distance_mm(held),
        note,
    })
}

/// The process that holds the arm. When its standard input closes, or its parent dies, it releases
/// the arm and ends.
struct ArmHolder {
    child: Child,
    lines: Receiver<String>,
}

impl ArmHolder {
    fn start(rig: &str) -> Result<Self, Problem> {
        let program = std::env::current_exe().map_err(|e| software(&e))?;
        let mut command = Command::new(program);
        command
            .args([HOLD, "--rig", rig])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        // A ctrl-C in the terminal must reach only its parent.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(|e| software(&e))?;
        let (sender, lines) = channel();
        let stdout = child.stdout.take();
        let reader = std::thread::Builder::new()
            .name("drill".to_owned())
            .spawn(move || {
                let lines = stdout.into_iter().flat_map(|s| BufReader::new(s).lines());
                for line in lines.map_while(Result::ok) {
                    if sender.send(line).is_err() {
                        return; // the receiver was dropped
                    }
                }
            });
        let holder = Self { child, lines };
        // If the thread fails to start, dropping the holder kills the process.
        reader.map(|_| holder).map_err(|e| software(&e))
    }

    /// Waits until the process reports the position at which it holds the arm.
    fn wait_until_held(&mut self, bench: &RealBench) -> Result<Point3<Robot>, Problem> {
        let until = Instant::now() + HOLD_TIMEOUT;
        loop {
            match self.lines.recv_timeout(POLL_INTERVAL) {
                Ok(line) => {
                    if let Some(position) = line.strip_prefix(HOLDING).and_then(point) {
                        return Ok(position);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    let status = self.child.wait().map_err(|e| software(&e))?;
                    return Err(robot(
                        EvidenceKind::State,
                        format!(
                            "expected the arm to be held in free air, but the process that holds it ended with {status}"
                        ),
                    ));
                }
            }
            if bench.stop_requested() {
                return Err(robot(
                    EvidenceKind::Stopped,
                    "stopped: the suite must end".to_owned(),
                ));
            }
            if Instant::now() >= until {
                return Err(robot(
                    EvidenceKind::TimeOut,
                    format!("expected the arm to be held in free air within {HOLD_TIMEOUT:?}"),
                ));
            }
        }
    }

    /// Kills the process, so that it cannot release the arm.
    fn kill(mut self) -> Result<(), Problem> {
        self.child.kill().map_err(|e| software(&e))?;
        self.child.wait().map(drop).map_err(|e| software(&e))
    }
}

impl Drop for ArmHolder {
    fn drop(&mut self) {
        // These calls fail only if the process has already ended. If it does not release the arm in time, its supervisor brakes it.
        drop(self.child.stdin.take());
        let until = Instant::now() + RELEASE_TIMEOUT;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(POLL_INTERVAL);
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Time limit for a process that must release the arm: it retracts and brakes.
const RELEASE_TIMEOUT: Duration = Duration::from_secs(5);

/// Reopens the robot as soon as possible. Returns the time since `killed`.
fn reopen(bench: &RealBench, killed: Instant) -> Result<(Omega, Duration), Problem> {
    let rig = bench.rig();
    loop {
        let config = bench::omega_config(rig).map_err(|f| software(&f.message))?;
        match bench::omega(config, RealClock::start()) {
            Ok(omega) => return Ok((omega, killed.elapsed())),
            Err(e) if killed.elapsed() >= REOPEN_TIMEOUT => return Err(trouble::robot(&e, rig)),
            // The dead process or its supervisor may still have it open.
            Err(_) => std::thread::sleep(POLL_INTERVAL),
        }
    }
}

/// Position of the braked tip.
fn position(omega: &mut Omega) -> Result<Point3<Robot>, Problem> {
    let until = Instant::now() + POSITION_TIMEOUT;
    let mut samples = Vec::new();
    while Instant::now() < until {
        omega
            .poll(&mut samples)
            .map_err(|e| skinrig_hil::device_evidence::from_error(&e))?;
        if let Some(sample) = samples.first() {
            return Ok(sample.measured);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Err(robot(
        EvidenceKind::DeviceLost,
        format!("expected a position from the robot within {POSITION_TIMEOUT:?}, found none"),
    ))
}

/// Parses `x y z`, mm.
fn point(words: &str) -> Option<Point3<Robot>> {
    let mut numbers = words.split_whitespace().map(str::parse::<f64>);
    let mut next = || numbers.next()?.ok().filter(|n| n.is_finite());
    Some(Point3::new(next()?, next()?, next()?))
}

fn robot(kind: EvidenceKind, what: String) -> Problem {
    Box::new(
        Evidence::new(kind, "robot", what)
            .next("read the messages of `hold-arm` above, then run `skinrig doctor`"),
    )
}

fn software(why: &dyn std::fmt::Display) -> Problem {
    robot(EvidenceKind::Software, format!("watchdog drill: {why}"))
}
