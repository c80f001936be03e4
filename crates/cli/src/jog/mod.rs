//! `skinrig jog`: moves the robot with typed commands, under the same guard as runs, and records touched points.

mod command;
mod log;
mod points;
mod refusal;

use std::io::{BufRead, IsTerminal};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use chrono::Utc;
use skinrig_controller::{
    ControlHandle, ControllerSettings, Floor, Jog, JogSetup, MoveOutcome, RunFault, TouchOutcome,
};
use skinrig_device::{Clock, Indenter, MotionLimits, RealClock};
use skinrig_hil::lease::Lease;
use skinrig_model::{HostDuration, Point3, PoseSample, RigidTransform, Robot, SimLevel, Skin};
use skinrig_protocol::plan::{RunLimits, TripReaction};
use skinrig_protocol::{Surface, TouchSearch};
use skinrig_sim::{SimConfig, in_real_time, simulated_rig};

use crate::args::JogArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::hil::lease;
use crate::rig::bench;
use crate::signals;
use command::JogCommand;
use log::Log;
use points::NamedPoint;
use refusal::{InputError, Refusal};

/// Interval between polls of the robot while there is no input.
const IDLE: Duration = Duration::from_millis(10);
/// Initial speed, mm/s.
const FIRST_SPEED_MM_S: f64 = 5.0;
/// Depth limit below the surface of the simulated skin, mm.
const SIMULATED_DEPTH_MM: f64 = 6.0;
/// Position tolerance at the end of a motion, mm.
const TOLERANCE_MM: f64 = 0.1;
/// Touch search if the rig file sets none.
const SEARCH: TouchSearch = TouchSearch {
    threshold_n: 0.2,
    samples: 5,
    speed_mm_s: 2.0,
    band_mm: 1.0,
    tare: HostDuration::from_millis(300),
};

/// The robot and its limits.
struct Bench {
    name: String,
    indenter: Box<dyn Indenter>,
    clock: Box<dyn Clock>,
    min_mm: [f64; 3],
    max_mm: [f64; 3],
    max_speed_mm_s: f64,
    max_acceleration_mm_s2: f64,
    max_force_n: f64,
    max_depth_mm: f64,
    robot_from_skin: RigidTransform<Robot, Skin>,
    search: TouchSearch,
}

fn open(args: &JogArgs) -> Result<(Bench, Option<Lease>), Failure> {
    let Some(path) = &args.rig else {
        return Ok((simulated(), None));
    };
    let file = bench::load(path)?;
    let lease = lease::take(&file, "jog")?;
    let clock = RealClock::start();
    let search = match file.surface {
        Some(Surface::Touch(search)) => search,
        _ => SEARCH,
    };
    let indenter = bench::open_robot(&file, clock)?;
    let bench = Bench {
        name: bench::display_name(&file),
        max_acceleration_mm_s2: indenter.capabilities().max_acceleration_mm_s2,
        indenter,
        clock: Box::new(clock),
        min_mm: file.limits.workspace.min_mm,
        max_mm: file.limits.workspace.max_mm,
        max_speed_mm_s: file.limits.max_speed_mm_s,
        max_force_n: file.limits.max_force_n,
        max_depth_mm: file.limits.max_depth_mm,
        robot_from_skin: file.frame.robot_from_skin,
        search,
    };
    Ok((bench, Some(lease)))
}

/// The simulated rig: in real time at a terminal, at full speed with piped input.
fn simulated() -> Bench {
    let config = SimConfig::new(1, SimLevel::Kinematic);
    let mut rig = simulated_rig(&config);
    if std::io::stdin().is_terminal() {
        rig = in_real_time(rig);
    }
    let can = rig.indenter.capabilities();
    Bench {
        name: rig.name,
        indenter: rig.indenter,
        clock: rig.clock,
        min_mm: can.workspace_min_mm,
        max_mm: can.workspace_max_mm,
        max_speed_mm_s: can.max_speed_mm_s,
        max_acceleration_mm_s2: can.max_acceleration_mm_s2,
        max_force_n: can.max_force_n,
        max_depth_mm: SIMULATED_DEPTH_MM,
        robot_from_skin: rig.robot_from_skin,
        search: SEARCH,
    }
}

/// Jogs in robot coordinates, because the location of the skin is not known before a touch-off. The [`Floor`] limits the depth below
/// the surface of the current frame.
fn setup(bench: &Bench, beyond_frame: bool, control: ControlHandle) -> JogSetup {
    let limits = RunLimits {
        workspace_min_mm: bench.min_mm,
        workspace_max_mm: bench.max_mm,
        // In these coordinates the workspace limits the depth.
        clearance_mm: bench.min_mm[2],
        max_depth_mm: (-bench.min_mm[2]).max(f64::MIN_POSITIVE),
        max_speed_mm_s: bench.max_speed_mm_s,
        max_force_n: bench.max_force_n,
        position_tolerance_mm: TOLERANCE_MM,
        settle_time: HostDuration::from_millis(50),
        max_acceleration_mm_s2: None,
        on_trip: TripReaction::Retract,
    };
    let robot_limits = MotionLimits {
        min_mm: bench.min_mm,
        max_mm: bench.max_mm,
        max_speed_mm_s: bench.max_speed_mm_s,
        max_acceleration_mm_s2: bench.max_acceleration_mm_s2,
        max_force_n: bench.max_force_n,
    };
    let floor = Floor {
        skin_from_robot: bench.robot_from_skin.inverse(),
        max_depth_mm: bench.max_depth_mm,
    };
    JogSetup {
        robot_from_skin: RigidTransform::identity(),
        limits,
        robot_limits,
        floor: (!beyond_frame).then_some(floor),
        control,
        settings: ControllerSettings {
            stale_after: bench::SLOW_STALE,
            ..ControllerSettings::default()
        },
    }
}

/// Sets `stop` at the first ctrl-C, switches the motors off at the third, and ends the program at the fourth.
fn on_ctrl_c(stop: Arc<AtomicBool>, control: ControlHandle) -> Result<(), Failure> {
    signals::on_ctrl_c(move |times| {
        stop.store(true, Ordering::SeqCst);
        match times {
            1 => errln!(
                "\nholding, retracting, disarming; ctrl-C twice more switches the motors off"
            ),
            2 => errln!("\nctrl-C once more switches the motors off where the tip is"),
            3 => {
                errln!("\nswitching the motors off");
                control.halt();
            }
            // Something hangs; after the exit the supervisor brakes the arm.
            _ => std::process::exit(i32::from(Exit::Stopped.code())),
        }
    })
    .map_err(Failure::internal)
}

/// `skinrig jog`.
///
/// # Errors
/// [`Failure::rig`] when the robot fails; [`Failure::input`] for a wrong line of a piped file, which ends the jog.
pub(crate) fn jog(args: &JogArgs) -> Outcome {
    let path = args.log.clone().unwrap_or_else(default_log);
    let mut log = Log::create(&path)?;
    let idle = Duration::try_from_secs_f64(args.idle)
        .map_err(|e| Failure::input(format!("--idle: {e}")))?;
    let stop = Arc::new(AtomicBool::new(false));
    let control = ControlHandle::new();
    on_ctrl_c(Arc::clone(&stop), control.clone())?;

    // Opened after the ctrl-C handler is set: from here on the arm may be live.
    let (bench, _lease) = open(args)?;
    let setup = setup(&bench, args.beyond_frame, control);
    let jog = Jog::start(bench.indenter, bench.clock, &setup).map_err(Failure::rig)?;
    let mut console = Console {
        jog,
        stop,
        search: bench.search,
        speed_mm_s: FIRST_SPEED_MM_S.min(setup.limits.max_speed_mm_s),
        most_mm_s: setup.limits.max_speed_mm_s,
        idle,
        skin_from_robot: bench.robot_from_skin.inverse(),
        last_touch: None,
        points: Vec::new(),
    };
    console.print_start(&bench.name, setup.floor, &mut log);
    let outcome = console.execute_input(&mut log);
    let ended = console.jog.finish();
    console.print_end(&ended, &mut log);
    let exit = outcome?;
    ended.map_err(|e| {
        Failure::rig(format!(
            "{e}\n  next: look at the arm; if it is live, press the force button on its base"
        ))
    })?;
    Ok(exit)
}

fn default_log() -> PathBuf {
    let now = Utc::now().format("%Y%m%dT%H%M%S%.3fZ");
    PathBuf::from("sessions").join(format!("jog-{now}.log"))
}

/// `(x, y, z) mm, force F N`.
fn describe_pose(p: &PoseSample) -> String {
    let [x, y, z] = p.measured.to_array();
    format!("({x:.3}, {y:.3}, {z:.3}) mm, force {:.2} N", p.force_n)
}

/// The robot and the state of the typed commands.
struct Console {
    jog: Jog<'static>,
    stop: Arc<AtomicBool>,
    search: TouchSearch,
    speed_mm_s: f64,
    /// Limit of the rig.
    most_mm_s: f64,
    /// Time without input after which the arm is disarmed.
    idle: Duration,
    skin_from_robot: RigidTransform<Skin, Robot>,
    last_touch: Option<Point3<Robot>>,
    points: Vec<NamedPoint>,
}

impl Console {
    /// Prints and logs the robot, the limit of the depth and the robot's notes.
    fn print_start(&mut self, bench: &str, floor: Option<Floor>, log: &mut Log) {
        let identity = self.jog.identity();
        outln!(
            "{bench}: {} {}; coordinates in the robot's frame; `help` lists the commands; ctrl-C holds, retracts and disarms;\n\
             so do {} s without input (--idle)\nlog       {}",
            identity.model,
            identity.serial,
            self.idle.as_secs_f64(),
            log.path().display()
        );
        let started = format!("{bench}: {} {}", identity.model, identity.serial);
        log.line(self.jog.now(), "start", &started);
        if let Some(floor) = floor {
            let words = format!("{} mm below the frame's surface", floor.max_depth_mm);
            log.line(self.jog.now(), "limit", &words);
            outln!("limit     {words} (--beyond-frame for a lower skin)");
        } else {
            let words = "--beyond-frame: only the workspace limits the depth";
            log.line(self.jog.now(), "limit", words);
            outln!("limit     {words}");
        }
        for note in self.jog.take_notes() {
            log.line(self.jog.now(), "note", &note);
            outln!("note      {note}");
        }
    }

    /// Prints and logs the named points and where the robot was disarmed.
    fn print_end(&mut self, ended: &Result<Option<PoseSample>, RunFault>, log: &mut Log) {
        log.path_of_tip(&self.jog.take_trace());
        let t = self.jog.now();
        if !self.points.is_empty() {
            let block = self.block();
            log.line(t, "points", &block);
            outln!("{block}");
        }
        match ended {
            Ok(at) => {
                let place = at.map_or_else(|| "no known pose".to_owned(), |p| describe_pose(&p));
                log.line(t, "end", &format!("disarmed at {place}"));
                outln!("disarmed at {place}");
            }
            Err(e) => log.line(t, "end", &format!("error: {e}")),
        }
    }

    /// Executes commands until the end of input, `quit`, ctrl-C, the idle timeout or a fault.
    fn execute_input(&mut self, log: &mut Log) -> Outcome {
        let interactive = std::io::stdin().is_terminal();
        let lines = read_lines()?;
        let mut last_input = Instant::now();
        loop {
            if self.stop.load(Ordering::SeqCst) {
                log.line(self.jog.now(), "ctrl-C", "");
                return Ok(Exit::Stopped);
            }
            let line = match lines.recv_timeout(IDLE) {
                Ok(line) => line,
                Err(RecvTimeoutError::Disconnected) => return Ok(Exit::Ok),
                Err(RecvTimeoutError::Timeout) => {
                    let polled = self.jog.look();
                    log.path_of_tip(&self.jog.take_trace());
                    match polled {
                        Err(RunFault::Halted) => continue,
                        other => other.map_err(Failure::rig)?,
                    };
                    if last_input.elapsed() < self.idle {
                        continue;
                    }
                    let why = format!("no input for {} s", self.idle.as_secs_f64());
                    log.line(self.jog.now(), "idle", &why);
                    outln!(
                        "{why}: holding, retracting and disarming; start `skinrig jog` again to continue"
                    );
                    return Ok(Exit::Ok);
                }
            };
            log.line(self.jog.now(), "order", &line);
            let answer = match command::parse(&line) {
                Ok(None) => continue,
                Ok(Some(JogCommand::Quit)) => return Ok(Exit::Ok),
                Ok(Some(command)) => self.execute(command),
                Err(e) => Err(Refusal::Input(e.into())),
            };
            log.path_of_tip(&self.jog.take_trace());
            last_input = Instant::now(); // a long motion does not count as idle
            match answer {
                Ok(text) => {
                    log.line(self.jog.now(), "answer", &text);
                    outln!("{text}");
                }
                // The next turn of the loop ends it: a halt also sets the stop flag.
                Err(Refusal::Rig(RunFault::Halted)) => {
                    log.line(self.jog.now(), "ctrl-C", "motors off");
                }
                Err(Refusal::Rig(e)) => {
                    log.line(self.jog.now(), "fault", &e.to_string());
                    return Err(Failure::rig(e));
                }
                Err(Refusal::Input(e)) => {
                    log.line(self.jog.now(), "refused", &e.to_string());
                    if !interactive {
                        // Later lines of a piped file may depend on the line that failed.
                        return Err(Failure::input(format!("`{line}`: {e}")));
                    }
                    errln!("refused: {e}");
                }
            }
        }
    }

    fn execute(&mut self, command: JogCommand) -> Result<String, Refusal> {
        let stop = Arc::clone(&self.stop);
        let stop = move || stop.load(Ordering::SeqCst);
        match command {
            JogCommand::By(axis, by_mm) => {
                let mut target = self.jog.look()?.commanded.to_array();
                target[axis] += by_mm;
                self.go(target, &stop)
            }
            JogCommand::To(target) => self.go(target, &stop),
            JogCommand::Speed(mm_s) if mm_s > self.most_mm_s => {
                Err(Refusal::Input(InputError::TooFast {
                    mm_s,
                    most_mm_s: self.most_mm_s,
                }))
            }
            JogCommand::Speed(speed_mm_s) => {
                self.speed_mm_s = speed_mm_s;
                Ok(format!("speed {speed_mm_s} mm/s"))
            }
            JogCommand::Where => self.place(),
            JogCommand::Touch(way_mm) => self.touch(way_mm, &stop),
            JogCommand::Point(name, skin) => self.point(name, skin),
            JogCommand::Points => Ok(self.block()),
            JogCommand::Help | JogCommand::Quit => Ok(command::HELP.to_owned()),
        }
    }

    fn go(&mut self, target: [f64; 3], stop: &dyn Fn() -> bool) -> Result<String, Refusal> {
        let [x, y, z] = target;
        let moved = self.jog.go(Point3::new(x, y, z), self.speed_mm_s, stop)?;
        Ok(match moved {
            MoveOutcome::Arrived(at) => format!("at {}", describe_pose(&at)),
            MoveOutcome::Stopped(at) => format!("stopped at {}", describe_pose(&at)),
        })
    }

    fn place(&mut self) -> Result<String, Refusal> {
        let at = self.jog.look()?;
        let [x, y, z] = at.measured.to_array();
        let [a, b, c] = self.skin_from_robot.apply(Point3::new(x, y, z)).to_array();
        Ok(format!(
            "at {}; skin ({a:.3}, {b:.3}, {c:.3}) mm by the rig's frame",
            describe_pose(&at)
        ))
    }

    fn touch(&mut self, way_mm: f64, stop: &dyn Fn() -> bool) -> Result<String, Refusal> {
        Ok(match self.jog.touch(self.search, way_mm, stop)? {
            TouchOutcome::At(found) => {
                let [x, y, z] = found.measured.to_array();
                self.last_touch = Some(Point3::new(x, y, z));
                format!(
                    "touched at {}; `point NAME` records it",
                    describe_pose(&found)
                )
            }
            TouchOutcome::NotFound(at) => format!("no contact down to {}", describe_pose(&at)),
            TouchOutcome::Stopped(at) => format!("stopped at {}", describe_pose(&at)),
        })
    }

    fn point(&mut self, name: String, skin: Option<[f64; 3]>) -> Result<String, Refusal> {
        let Some(robot) = self.last_touch.take() else {
            return Err(Refusal::Input(InputError::NoTouch));
        };
        self.points.retain(|p| p.name != name);
        let [x, y, z] = robot.to_array();
        let text = format!("point {name} at ({x:.3}, {y:.3}, {z:.3}) mm");
        self.points.push(NamedPoint { name, skin, robot });
        Ok(text)
    }

    fn block(&self) -> String {
        let today = Utc::now().format("%Y-%m-%d").to_string();
        points::block(&self.points, &today)
    }
}

/// Reads lines of standard input on a separate thread, so that the robot is polled meanwhile.
fn read_lines() -> Result<Receiver<String>, Failure> {
    let (sender, receiver) = sync_channel(16);
    std::thread::Builder::new()
        .name("jog-input".to_owned())
        .spawn(move || {
            let mut input = std::io::stdin().lock();
            let mut line = Vec::new();
            // Input that cannot be read ends the session like its end.
            while input.read_until(b'\n', &mut line).is_ok_and(|n| n > 0) {
                // A line of another encoding is a command that does not exist.
                let text = String::from_utf8_lossy(&line).trim_end().to_owned();
                line.clear();
                if sender.send(text).is_err() {
                    return; // the receiver is gone
                }
            }
        })
        .map(|_| receiver)
        .map_err(|e| Failure::internal(format!("cannot read standard input: {e}")))
}
