//! Arm control for checks: applies the rig file's limits and the guard that runs use, and always
//! retracts and brakes the arm at the end.

use std::time::{SystemTime, UNIX_EPOCH};

use skinrig_controller::{
    ControlHandle, ControllerSettings, Jog, JogSetup, MoveOutcome, RunFault, TouchOutcome,
};
use skinrig_device::{Clock, DeviceError, Indenter, MotionLimits, RobotSample};
use skinrig_model::{HostDuration, HostTime, Point2, Point3, PoseSample, Robot, Setting, Skin};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::plan::{RunLimits, TripReaction};
use skinrig_protocol::rig::RigFile;
use skinrig_protocol::{Surface, TouchSearch};

use crate::bench::{Bench, Problem};
use crate::findings::Findings;
use crate::run_evidence;
use crate::test_volume::{CLEARANCE_MM, TestVolume};

/// Position tolerance at the end of a move, mm. It may be coarse: checks measure the exact position
/// themselves.
const TOLERANCE_MM: f64 = 0.5;
/// Time within the tolerance that ends a move.
const SETTLE_TIME: HostDuration = HostDuration::from_millis(50);
/// Speed limit for rising from an unknown position and for descending to the skin, mm/s.
const SLOW_MM_S: f64 = 10.0;
/// Time limit for the first position sample of a braked robot.
const POSITION_TIMEOUT: HostDuration = HostDuration::from_millis(100);
/// Touch search when the rig file has none: the same as in `skinrig jog`.
const DEFAULT_SEARCH: TouchSearch = TouchSearch {
    threshold_n: 0.2,
    samples: 5,
    speed_mm_s: 2.0,
    band_mm: 1.0,
    tare: HostDuration::from_millis(300),
};

/// How low a check may move the tip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reach {
    /// Never below clearance height.
    Air,
    /// Into the skin, as deep as the rig file allows.
    Skin,
}

/// An armed robot at clearance height or above.
pub struct Arm<'a> {
    jog: Jog<'a>,
    stop: &'a dyn Fn() -> bool,
    /// Where the arm may move.
    pub volume: &'a TestVolume,
    /// How it searches for the surface.
    pub search: TouchSearch,
    robot_limits: MotionLimits,
}

/// A measurement with the arm.
type Work<'w> = &'w mut dyn FnMut(&mut Arm<'_>, &mut Findings) -> Result<(), Problem>;

/// Arms the robot, raises it to clearance height if needed, runs `work`, then retracts and brakes the robot even after an error.
/// Marks each of `metrics` that `work` did not measure as unmeasured.
pub(crate) fn with_arm(
    bench: &mut dyn Bench,
    reach: Reach,
    findings: &mut Findings,
    metrics: &[&'static str],
    work: Work<'_>,
) {
    let rig = bench.rig();
    let search = match rig.surface {
        Some(Surface::Touch(search)) => search,
        _ => DEFAULT_SEARCH,
    };
    let result = match TestVolume::from_rig(rig, today()) {
        Ok(volume) => with_robot(bench, reach, (&volume, search), findings, work),
        Err(problem) => Err(problem),
    };
    if let Err(problem) = result {
        findings.evidence.push(*problem);
    }
    for metric in metrics {
        if !findings.values.iter().any(|v| v.metric == *metric) {
            findings.unmeasured("robot", metric);
        }
    }
}

fn today() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let seconds = since.map_or(0, |d| d.as_secs());
    i64::try_from(seconds / 86_400).unwrap_or(i64::MAX)
}

/// Runs `work` with the bench's robot.
fn with_robot(
    bench: &mut dyn Bench,
    reach: Reach,
    (volume, search): (&TestVolume, TouchSearch),
    findings: &mut Findings,
    work: Work<'_>,
) -> Result<(), Problem> {
    let (timing_slack, control, stop) =
        (bench.timing_slack(), bench.control(), bench.stop_signal());
    let devices = bench.devices();
    let robot = devices.robot.as_mut().map_err(|problem| problem.clone())?;
    let setup = ArmSetup::new(volume, reach, timing_slack, &**robot, control);
    let context = ArmContext {
        search,
        stop: &*stop,
    };
    let result = arm_and_work(
        &mut **robot,
        &mut *devices.clock,
        &setup,
        &context,
        findings,
        work,
    );
    if result
        .as_ref()
        .is_err_and(|e| e.kind == EvidenceKind::DeviceLost)
    {
        bench.close(); // a lost device must be reopened
    }
    result
}

/// How a check arms the robot.
struct ArmSetup<'a> {
    volume: &'a TestVolume,
    jog: JogSetup,
}

/// Touch search and stop signal of a check.
struct ArmContext<'a> {
    search: TouchSearch,
    stop: &'a dyn Fn() -> bool,
}

impl<'a> ArmSetup<'a> {
    fn new(
        volume: &'a TestVolume,
        reach: Reach,
        timing_slack: HostDuration,
        robot: &dyn Indenter,
        control: ControlHandle,
    ) -> Self {
        let (limits, robot_limits) =
            limits(volume, reach, robot.capabilities().max_acceleration_mm_s2);
        let jog = JogSetup {
            robot_from_skin: volume.robot_from_skin,
            limits,
            robot_limits,
            floor: None,
            control,
            settings: settings(timing_slack),
        };
        Self { volume, jog }
    }

    fn start<'r>(
        &self,
        robot: &'r mut dyn Indenter,
        clock: &'r mut dyn Clock,
    ) -> Result<Jog<'r>, Problem> {
        Jog::start(Box::new(robot), Box::new(clock), &self.jog).map_err(from_controller)
    }

    /// Rises to clearance height if the tip is below it.
    fn rise(&self, jog: &mut Jog<'_>) -> Result<(), Problem> {
        let at = jog.look().map_err(from_controller)?.measured;
        if at.z_mm >= CLEARANCE_MM {
            return Ok(());
        }
        let speed = SLOW_MM_S.min(self.jog.limits.max_speed_mm_s);
        let up = at.plane().at_height(CLEARANCE_MM + 2.0 * TOLERANCE_MM);
        jog.go(up, speed, &|| false)
            .map(drop)
            .map_err(from_controller)
    }
}

fn arm_and_work(
    robot: &mut dyn Indenter,
    clock: &mut dyn Clock,
    setup: &ArmSetup<'_>,
    context: &ArmContext<'_>,
    findings: &mut Findings,
    work: Work<'_>,
) -> Result<(), Problem> {
    // A braked arm sinks and may rest on the skin. Arming measures the force at rest, which must happen in free air.
    if may_be_low(robot, clock, setup.volume) {
        retract(robot, clock, setup)?;
    }
    let mut jog = setup.start(&mut *robot, &mut *clock)?;
    setup.rise(&mut jog)?;
    let mut arm = Arm {
        jog,
        stop: context.stop,
        volume: setup.volume,
        search: context.search,
        robot_limits: setup.jog.robot_limits,
    };
    let result = work(&mut arm, findings);
    let ended = arm.jog.finish();
    drop(arm);
    let Err(e) = ended else { return result };
    // The motion ended below clearance: retract once more from there. Report a second error next to the first.
    if !matches!(e, RunFault::Device(DeviceError::Lost { .. }))
        && let Err(second) = retract(robot, clock, setup)
    {
        findings.evidence.push(*second);
    }
    result.and(Err(from_controller(e)))
}

/// Whether the tip is below clearance height or its height is unknown. Discards old samples first, and ignores an overflow of the
/// queue.
fn may_be_low(robot: &mut dyn Indenter, clock: &mut dyn Clock, volume: &TestVolume) -> bool {
    let mut samples = Vec::new();
    let _ = robot.poll(&mut samples);
    samples.clear();
    clock.wait_until(clock.now() + POSITION_TIMEOUT);
    // Arming reports any fault of the robot.
    let _ = robot.poll(&mut samples);
    let skin_from_robot = volume.robot_from_skin.inverse();
    let height_mm = |s: &RobotSample| skin_from_robot.apply(s.measured).z_mm;
    samples.last().is_none_or(|s| height_mm(s) < CLEARANCE_MM)
}

/// Rises from the skin and brakes again.
fn retract(
    robot: &mut dyn Indenter,
    clock: &mut dyn Clock,
    setup: &ArmSetup<'_>,
) -> Result<(), Problem> {
    let mut jog = setup.start(robot, clock)?;
    setup.rise(&mut jog)?;
    jog.finish().map(drop).map_err(from_controller)
}

/// Limits for the guard, in the skin frame, and for the robot itself.
fn limits(
    volume: &TestVolume,
    reach: Reach,
    max_acceleration_mm_s2: f64,
) -> (RunLimits, MotionLimits) {
    let l = &volume.limits;
    let (mut least, mut most) = volume.workspace_bounds();
    most[2] = volume.top_mm();
    let max_depth_mm = match reach {
        Reach::Air => f64::MIN_POSITIVE,
        Reach::Skin => l.max_depth_mm,
    };
    least[2] = match reach {
        Reach::Air => CLEARANCE_MM,
        Reach::Skin => -max_depth_mm,
    };
    let run = RunLimits {
        workspace_min_mm: least,
        workspace_max_mm: most,
        clearance_mm: CLEARANCE_MM,
        max_depth_mm,
        max_speed_mm_s: l.max_speed_mm_s,
        max_force_n: l.max_force_n,
        position_tolerance_mm: TOLERANCE_MM,
        settle_time: SETTLE_TIME,
        max_acceleration_mm_s2: None,
        on_trip: TripReaction::Retract,
    };
    let robot_limits = MotionLimits {
        min_mm: l.workspace.min_mm,
        max_mm: l.workspace.max_mm,
        max_speed_mm_s: l.max_speed_mm_s,
        max_acceleration_mm_s2,
        max_force_n: l.max_force_n,
    };
    (run, robot_limits)
}

/// Controller settings that tolerate emulated devices that are late by `timing_slack`.
fn settings(timing_slack: HostDuration) -> ControllerSettings {
    let usual = ControllerSettings::default();
    ControllerSettings {
        late_after: usual.late_after.max(timing_slack),
        stale_after: usual.stale_after.max(HostDuration(timing_slack.0 / 5)),
        // The arm's samples arrive in bursts after a delay.
        speed_over: usual.speed_over.max(HostDuration(timing_slack.0 / 25)),
        ..usual
    }
}

impl Arm<'_> {
    /// The speed at which a move that asks for `speed_mm_s` goes, mm/s: the rig may limit it.
    pub(crate) fn speed_mm_s(&self, speed_mm_s: f64) -> f64 {
        speed_mm_s.min(self.volume.limits.max_speed_mm_s)
    }

    /// Moves to `target` and waits for arrival.
    ///
    /// # Errors
    /// [`Problem`] when the arm does not arrive, or when the suite must stop.
    pub fn go(&mut self, target: Point3<Skin>, speed_mm_s: f64) -> Result<PoseSample, Problem> {
        let speed = self.speed_mm_s(speed_mm_s);
        match self
            .jog
            .go(target, speed, self.stop)
            .map_err(from_controller)?
        {
            MoveOutcome::Arrived(at) => Ok(at),
            MoveOutcome::Stopped(_) => Err(suite_stopped()),
        }
    }

    /// Descends slowly to the top of the band of the touch search.
    ///
    /// # Errors
    /// As [`go`](Self::go).
    pub(crate) fn go_above(&mut self, at: Point2) -> Result<PoseSample, Problem> {
        let high_mm = 2.0 * CLEARANCE_MM;
        let current = self.pose()?.measured;
        if current.z_mm < high_mm {
            self.go(current.plane().at_height(high_mm), 2.0 * SLOW_MM_S)?;
        }
        self.go(at.at_height(high_mm), 2.0 * SLOW_MM_S)?;
        self.go(at.at_height(self.search.band_mm), SLOW_MM_S)
    }

    /// Starts a move to `target` and returns its start time.
    ///
    /// # Errors
    /// [`Problem`] from the guard or the robot.
    pub fn send(&mut self, target: Point3<Skin>, speed_mm_s: f64) -> Result<HostTime, Problem> {
        let speed = self.speed_mm_s(speed_mm_s);
        self.jog.send(target, speed).map_err(from_controller)
    }

    /// Collects samples for `span`, or until `enough` returns true for a sample.
    ///
    /// # Errors
    /// [`Problem`] from the watchdog or the robot. `samples` keeps the samples collected before it.
    pub fn watch(
        &mut self,
        span: HostDuration,
        samples: &mut Vec<PoseSample>,
        mut enough: impl FnMut(&PoseSample) -> bool,
    ) -> Result<(), Problem> {
        let stop = self.stop;
        let watched = self.jog.watch(span, samples, |s| enough(s) || stop());
        watched.map_err(from_controller)?;
        if stop() { Err(suite_stopped()) } else { Ok(()) }
    }

    /// Searches for the surface within the band around the frame's surface. Returns its height, mm; the tip ends above it.
    ///
    /// # Errors
    /// [`Problem`] when there is no surface in the band, or the descent fails.
    pub fn touch(&mut self) -> Result<f64, Problem> {
        let search = self.search;
        let way_mm = 2.0 * search.band_mm;
        match self.jog.touch(search, way_mm, self.stop).map_err(from_controller)? {
            TouchOutcome::At(at) => Ok(at.measured.z_mm),
            TouchOutcome::Stopped(_) => Err(suite_stopped()),
            TouchOutcome::NotFound(at) => Err(Box::new(
                Evidence::new(
                    EvidenceKind::State,
                    "robot",
                    format!(
                        "expected the skin within {} mm of the frame's surface, found nothing down to {:.3} mm",
                        search.band_mm, at.measured.z_mm
                    ),
                )
                .next("check that the skin is mounted, then touch it off again with `skinrig jog`"),
            )),
        }
    }

    /// Limits the robot's force; `None` restores the limit of the rig file.
    ///
    /// # Errors
    /// [`Problem`] from the robot, also when the limit reads back with another value.
    pub fn limit_force(&mut self, force_n: Option<f64>) -> Result<Vec<Setting>, Problem> {
        let robot_limits = MotionLimits {
            max_force_n: force_n.unwrap_or(self.robot_limits.max_force_n),
            ..self.robot_limits
        };
        self.jog.limit(&robot_limits).map_err(from_controller)
    }

    /// The latest pose of the tip.
    ///
    /// # Errors
    /// As [`watch`](Self::watch).
    pub fn pose(&mut self) -> Result<PoseSample, Problem> {
        self.jog.look().map_err(from_controller)
    }

    /// Stops the arm where it is, with live motors. Returns the time of the command.
    ///
    /// # Errors
    /// [`Problem`] from the robot.
    pub fn hold(&mut self) -> Result<HostTime, Problem> {
        self.jog.hold().map_err(from_controller)
    }

    /// Switches the motors off; the arm cannot be armed again afterwards. Returns the time of the
    /// command.
    ///
    /// # Errors
    /// [`Problem`] from the robot.
    pub fn halt(&mut self) -> Result<HostTime, Problem> {
        self.jog.halt().map_err(from_controller)
    }
}

/// Moves the arm into free air, reports its position through `held`, holds it until `stop`, then retracts and brakes it.
///
/// # Errors
/// [`Problem`] from the motion.
pub fn hold_in_air(
    robot: &mut dyn Indenter,
    clock: &mut dyn Clock,
    rig: &RigFile,
    timing_slack: HostDuration,
    stop: &dyn Fn() -> bool,
    held: &mut dyn FnMut(Point3<Robot>),
) -> Result<(), Problem> {
    let volume = TestVolume::from_rig(rig, today())?;
    let setup = ArmSetup::new(
        &volume,
        Reach::Air,
        timing_slack,
        &*robot,
        ControlHandle::new(),
    );
    let context = ArmContext {
        search: DEFAULT_SEARCH,
        stop,
    };
    let mut ignored = Findings::default();
    arm_and_work(
        robot,
        clock,
        &setup,
        &context,
        &mut ignored,
        &mut |arm, _| {
            let [middle, ..] = arm.volume.air_points();
            let at = arm.go(middle, SLOW_MM_S)?;
            held(arm.volume.robot_from_skin.apply(at.measured));
            while !stop() {
                // The pose does not matter here; an error ends the loop.
                arm.pose()?;
            }
            Ok(())
        },
    )
}

/// Evidence from a controller error.
pub(crate) fn from_controller(e: RunFault) -> Problem {
    let rows = run_evidence::from_error(&e).into_iter();
    let software = || Evidence::new(EvidenceKind::Software, "robot", e.to_string());
    Box::new(rows.last().unwrap_or_else(software))
}

fn suite_stopped() -> Problem {
    let what = "stopped: the suite must end";
    Box::new(Evidence::new(EvidenceKind::Stopped, "robot", what))
}
