//! The drill of the watchdog on a real driver: a second process holds the arm in free air and is killed.

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
/// It holds within this time: opened, armed, risen and travelled.
const HOLDS_WITHIN: Duration = Duration::from_secs(60);
/// The robot can be opened again within this time.
const OPENS_WITHIN: Duration = Duration::from_secs(20);
/// The killed process is left alone for so long: its watchdog (at most 32 ms) and its supervisor have braked the arm by then, and who
/// opens the robot earlier brakes it himself.
const LEFT_ALONE: Duration = Duration::from_millis(300);
/// Between two looks.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// A braked robot tells where it is within this time.
const SEEN_WITHIN: Duration = Duration::from_secs(2);

/// Lets another process hold the arm, kills it, and opens the robot again to see what became of it. Every device is closed.
///
/// # Errors
/// [`Problem`] when it could not be done.
pub(super) fn watchdog(bench: &mut RealBench) -> Result<DrillResult, Problem> {
    let mut holder = Holder::start(&bench.rig().file_name)?;
    let held = holder.holds(bench)?;
    let killed = Instant::now();
    holder.kill()?;
    std::thread::sleep(LEFT_ALONE);
    // Whoever of watchdog and supervisor brakes it, from here on nobody else does.
    let (mut omega, after) = reopen(bench, killed)?;
    let live = omega.remarks().contains(&Remark::MotorsWereLive);
    let why = omega.remarks().iter();
    let why = why.filter(|r| matches!(r, Remark::MotorsWentOff(_)));
    let note = why.map(ToString::to_string).next();
    let at = place(&mut omega)?;
    Ok(DrillResult {
        braked_within_s: (!live).then_some(after.as_secs_f64()),
        drop_mm: at.distance_mm(held),
        note,
    })
}

/// The process that holds the arm. Its standard input is its parent's life: when that ends it lets go of the arm and ends.
struct Holder {
    child: Child,
    lines: Receiver<String>,
}

impl Holder {
    fn start(rig: &str) -> Result<Self, Problem> {
        let program = std::env::current_exe().map_err(|e| software(&e))?;
        let mut command = Command::new(program);
        command
            .args([HOLD, "--rig", rig])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        // A ctrl-C in the terminal is for its parent.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(|e| software(&e))?;
        let (tell, lines) = channel();
        let said = child.stdout.take();
        let reader = std::thread::Builder::new()
            .name("drill".to_owned())
            .spawn(move || {
                let lines = said.into_iter().flat_map(|s| BufReader::new(s).lines());
                for line in lines.map_while(Result::ok) {
                    if tell.send(line).is_err() {
                        return; // nobody listens any more
                    }
                }
            });
        let holder = Self { child, lines };
        // Dropped, the holder is killed.
        reader.map(|_| holder).map_err(|e| software(&e))
    }

    /// Waits until it says where it holds the arm.
    fn holds(&mut self, bench: &RealBench) -> Result<Point3<Robot>, Problem> {
        let until = Instant::now() + HOLDS_WITHIN;
        loop {
            match self.lines.recv_timeout(LOOK_EVERY) {
                Ok(line) => {
                    if let Some(place) = line.strip_prefix(HOLDING).and_then(point) {
                        return Ok(place);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    let status = self.child.wait().map_err(|e| software(&e))?;
                    return Err(robot(
                        EvidenceKind::State,
                        format!(
                            "expected the arm to be held in free air, found that its holder ended with {status}"
                        ),
                    ));
                }
            }
            if bench.stop_requested() {
                return Err(robot(
                    EvidenceKind::Stopped,
                    "broken off: everything is to end".to_owned(),
                ));
            }
            if Instant::now() >= until {
                return Err(robot(
                    EvidenceKind::TimeOut,
                    format!("expected the arm to be held in free air within {HOLDS_WITHIN:?}"),
                ));
            }
        }
    }

    /// As the system does it: no way to let go of anything.
    fn kill(mut self) -> Result<(), Problem> {
        self.child.kill().map_err(|e| software(&e))?;
        self.child.wait().map(drop).map_err(|e| software(&e))
    }
}

impl Drop for Holder {
    fn drop(&mut self) {
        // Either fails only when it is gone already; the supervisor brakes the arm of one that did not let go.
        drop(self.child.stdin.take());
        let until = Instant::now() + LETS_GO_WITHIN;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(LOOK_EVERY);
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// One that was told to let go retracts and brakes within this time.
const LETS_GO_WITHIN: Duration = Duration::from_secs(5);

/// Opens the robot as soon as it lets itself be opened; gives how long after `killed` that was.
fn reopen(bench: &RealBench, killed: Instant) -> Result<(Omega, Duration), Problem> {
    let rig = bench.rig();
    loop {
        let config = bench::omega_config(rig).map_err(|f| software(&f.message))?;
        match bench::omega(config, RealClock::start()) {
            Ok(omega) => return Ok((omega, killed.elapsed())),
            Err(e) if killed.elapsed() >= OPENS_WITHIN => return Err(trouble::robot(&e, rig)),
            // The dead process may still hold it, or the supervisor that brakes it.
            Err(_) => std::thread::sleep(LOOK_EVERY),
        }
    }
}

/// Where the braked tip is.
fn place(omega: &mut Omega) -> Result<Point3<Robot>, Problem> {
    let until = Instant::now() + SEEN_WITHIN;
    let mut seen = Vec::new();
    while Instant::now() < until {
        omega
            .poll(&mut seen)
            .map_err(|e| skinrig_hil::device_evidence::from_error(&e))?;
        if let Some(sample) = seen.first() {
            return Ok(sample.measured);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Err(robot(
        EvidenceKind::DeviceLost,
        format!("expected the robot to tell where it is within {SEEN_WITHIN:?}, found nothing"),
    ))
}

/// `x y z`, mm.
fn point(words: &str) -> Option<Point3<Robot>> {
    let mut numbers = words.split_whitespace().map(str::parse::<f64>);
    let mut next = || numbers.next()?.ok().filter(|n| n.is_finite());
    Some(Point3::new(next()?, next()?, next()?))
}

fn robot(kind: EvidenceKind, what: String) -> Problem {
    Box::new(
        Evidence::new(kind, "robot", what)
            .next("see what the holder said above; then `skinrig doctor`"),
    )
}

fn software(why: &dyn std::fmt::Display) -> Problem {
    robot(EvidenceKind::Software, format!("watchdog drill: {why}"))
}
