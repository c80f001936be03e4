//! The arm in the hands of a check: held against the rig file, moved under the guard of runs, retracted and braked in the end.

use std::time::{SystemTime, UNIX_EPOCH};

use skinrig_controller::{ControlHandle, ControllerError, ControllerSettings, Jog, Moved, Touched};
use skinrig_device::{Clock, DeviceError, Indenter, MotionLimits, RobotSample};
use skinrig_model::{HostDuration, HostTime, Point2, Point3, PoseSample, Robot, Setting, Skin};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::plan::{OnTrip, RunLimits};
use skinrig_protocol::rig::RigFile;
use skinrig_protocol::{Surface, TouchSearch};

use crate::bench::{Bench, Trouble};
use crate::cause;
use crate::findings::Findings;
use crate::room::{CLEARANCE_MM, Room};

/// How close to its target a move ends, mm: near enough to measure where exactly.
const ARRIVED_MM: f64 = 0.5;
/// For so long.
const ARRIVED_FOR: HostDuration = HostDuration::from_millis(50);
/// Ways up from an unknown place and down to the skin, mm/s.
const SLOW_MM_S: f64 = 10.0;
/// A braked robot tells where it is within this time.
const FRESH: HostDuration = HostDuration::from_millis(100);
/// How the surface is touched when the rig file does not say: as `skinrig jog` does.
const SEARCH: TouchSearch = TouchSearch {
    threshold_n: 0.2,
    samples: 5,
    speed_mm_s: 2.0,
    band_mm: 1.0,
    tare: HostDuration::from_millis(300),
};

/// How low a check goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// Never below clearance height.
    Air,
    /// Into the skin, as deep as the rig file allows.
    Skin,
}

/// An armed robot above clearance height, or at it.
pub struct Arm<'a> {
    jog: Jog<'a>,
    stop: &'a dyn Fn() -> bool,
    /// Where it may go.
    pub room: &'a Room,
    /// How it touches the surface.
    pub search: TouchSearch,
    own: MotionLimits,
}

/// What a check does with the arm.
type Work<'w> = &'w mut dyn FnMut(&mut Arm<'_>, &mut Findings) -> Result<(), Trouble>;

/// Arms the robot, takes it to clearance height where it lies below, lets `work` have it, and retracts and brakes it, whatever
/// came of that. What `work` did not measure of `metrics` is unmeasured.
pub(crate) fn with_arm(
    bench: &mut dyn Bench,
    reach: Reach,
    found: &mut Findings,
    metrics: &[&'static str],
    work: Work<'_>,
) {
    let rig = bench.rig();
    let search = match rig.surface {
        Some(Surface::Touch(search)) => search,
        _ => SEARCH,
    };
    let answer = match Room::of(rig, today()) {
        Ok(room) => borrow(bench, reach, (&room, search), found, work),
        Err(why) => Err(why),
    };
    if let Err(why) = answer {
        found.evidence.push(*why);
    }
    for metric in metrics {
        if !found.values.iter().any(|v| v.metric == *metric) {
            found.unmeasured("robot", metric);
        }
    }
}

fn today() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let seconds = since.map_or(0, |d| d.as_secs());
    i64::try_from(seconds / 86_400).unwrap_or(i64::MAX)
}

/// The robot of the bench, as long as the work takes.
fn borrow(
    bench: &mut dyn Bench,
    reach: Reach,
    (room, search): (&Room, TouchSearch),
    found: &mut Findings,
    work: Work<'_>,
) -> Result<(), Trouble> {
    let (patience, control, stop) = (bench.patience(), bench.control(), bench.stopping());
    let devices = bench.devices();
    let robot = devices.robot.as_mut().map_err(|why| why.clone())?;
    let setup = Setup::new(room, reach, patience, &**robot, control);
    let hand = Hand {
        search,
        stop: &*stop,
    };
    let answer = arm_and_work(
        &mut **robot,
        &mut *devices.clock,
        &setup,
        &hand,
        found,
        work,
    );
    if answer
        .as_ref()
        .is_err_and(|e| e.kind == EvidenceKind::DeviceLost)
    {
        bench.close(); // only opening it again helps
    }
    answer
}

/// How a check arms the robot.
struct Setup<'a> {
    room: &'a Room,
    run: RunLimits,
    own: MotionLimits,
    control: ControlHandle,
    settings: ControllerSettings,
}

/// What else a check brings along.
struct Hand<'a> {
    search: TouchSearch,
    stop: &'a dyn Fn() -> bool,
}

impl<'a> Setup<'a> {
    fn new(
        room: &'a Room,
        reach: Reach,
        patience: HostDuration,
        robot: &dyn Indenter,
        control: ControlHandle,
    ) -> Self {
        let (run, own) = limits(room, reach, robot.capabilities().max_acceleration_mm_s2);
        Self {
            room,
            run,
            own,
            control,
            settings: settings(patience),
        }
    }

    fn start<'r>(
        &self,
        robot: &'r mut dyn Indenter,
        clock: &'r mut dyn Clock,
    ) -> Result<Jog<'r>, Trouble> {
        let started = Jog::on_skin(
            Box::new(robot),
            Box::new(clock),
            self.room.robot_from_skin,
            self.run,
            &self.own,
            &self.control,
            self.settings,
        );
        started.map(|(jog, _)| jog).map_err(of)
    }

    /// Up to clearance height where the tip lies below.
    fn rise(&self, jog: &mut Jog<'_>) -> Result<(), Trouble> {
        let at = jog.look().map_err(of)?.measured;
        if at.z_mm >= CLEARANCE_MM {
            return Ok(());
        }
        let speed = SLOW_MM_S.min(self.run.max_speed_mm_s);
        let up = at.plane().at_height(CLEARANCE_MM + 2.0 * ARRIVED_MM);
        jog.go(up, speed, &|| false).map(drop).map_err(of)
    }
}

fn arm_and_work(
    robot: &mut dyn Indenter,
    clock: &mut dyn Clock,
    setup: &Setup<'_>,
    hand: &Hand<'_>,
    found: &mut Findings,
    work: Work<'_>,
) -> Result<(), Trouble> {
    // Braked, the arm sinks: it may rest on the skin. The force at rest is taken when it is armed, and belongs to free air.
    if may_be_low(robot, clock, setup.room) {
        leave(robot, clock, setup)?;
    }
    let mut jog = setup.start(&mut *robot, &mut *clock)?;
    setup.rise(&mut jog)?;
    let mut arm = Arm {
        jog,
        stop: hand.stop,
        room: setup.room,
        search: hand.search,
        own: setup.own,
    };
    let answer = work(&mut arm, found);
    let ended = arm.jog.finish();
    drop(arm);
    let Err(e) = ended else { return answer };
    // Broken off below: once more from where it lies. What the robot says then is told beside the first reason.
    if !matches!(e, ControllerError::Device(DeviceError::Lost { .. }))
        && let Err(again) = leave(robot, clock, setup)
    {
        found.evidence.push(*again);
    }
    answer.and(Err(of(e)))
}

/// Whether the tip lies below clearance height, or nobody knows. What the braked robot told while nobody listened is of no
/// interest, nor that some of it found no room.
fn may_be_low(robot: &mut dyn Indenter, clock: &mut dyn Clock, room: &Room) -> bool {
    let mut samples = Vec::new();
    let _ = robot.poll(&mut samples);
    samples.clear();
    clock.wait_until(clock.now() + FRESH);
    // What is wrong with the robot is told when it is armed.
    let _ = robot.poll(&mut samples);
    let skin_from_robot = room.robot_from_skin.inverse();
    let height_mm = |s: &RobotSample| skin_from_robot.apply(s.measured).z_mm;
    samples.last().is_none_or(|s| height_mm(s) < CLEARANCE_MM)
}

/// Up from the skin, and braked again.
fn leave(
    robot: &mut dyn Indenter,
    clock: &mut dyn Clock,
    setup: &Setup<'_>,
) -> Result<(), Trouble> {
    let mut jog = setup.start(robot, clock)?;
    setup.rise(&mut jog)?;
    jog.finish().map(drop).map_err(of)
}

/// What the guard holds the arm to, skin frame, and what the robot itself is told.
fn limits(room: &Room, reach: Reach, max_acceleration_mm_s2: f64) -> (RunLimits, MotionLimits) {
    let l = &room.limits;
    let (mut least, mut most) = room.around();
    most[2] = room.top_mm();
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
        position_tolerance_mm: ARRIVED_MM,
        settle_time: ARRIVED_FOR,
        max_acceleration_mm_s2: None,
        on_trip: OnTrip::Retract,
    };
    let own = MotionLimits {
        min_mm: l.workspace.min_mm,
        max_mm: l.workspace.max_mm,
        max_speed_mm_s: l.max_speed_mm_s,
        max_acceleration_mm_s2,
        max_force_n: l.max_force_n,
    };
    (run, own)
}

/// How patient the guard is with stand-ins that may be so late.
fn settings(patience: HostDuration) -> ControllerSettings {
    let usual = ControllerSettings::default();
    ControllerSettings {
        late_after: usual.late_after.max(patience),
        stale_after: usual.stale_after.max(HostDuration(patience.0 / 5)),
        // An arm that was held up catches up in bursts.
        speed_over: usual.speed_over.max(HostDuration(patience.0 / 25)),
        ..usual
    }
}

impl Arm<'_> {
    /// To `target`, and waits until it is there.
    ///
    /// # Errors
    /// What kept it from there.
    pub fn go(&mut self, target: Point3<Skin>, speed_mm_s: f64) -> Result<PoseSample, Trouble> {
        let speed = speed_mm_s.min(self.room.limits.max_speed_mm_s);
        match self.jog.go(target, speed, self.stop).map_err(of)? {
            Moved::Arrived(at) => Ok(at),
            Moved::Stopped(_) => Err(stopped()),
        }
    }

    /// Slowly down to the height of the band in which the surface is looked for.
    ///
    /// # Errors
    /// What kept it from there.
    pub fn above(&mut self, at: Point2) -> Result<PoseSample, Trouble> {
        let high_mm = 2.0 * CLEARANCE_MM;
        let here = self.look()?.measured;
        if here.z_mm < high_mm {
            self.go(here.plane().at_height(high_mm), 2.0 * SLOW_MM_S)?;
        }
        self.go(at.at_height(high_mm), 2.0 * SLOW_MM_S)?;
        self.go(at.at_height(self.search.band_mm), SLOW_MM_S)
    }

    /// Sets off to `target`, and gives when.
    ///
    /// # Errors
    /// What the guard or the robot says.
    pub fn send(&mut self, target: Point3<Skin>, speed_mm_s: f64) -> Result<HostTime, Trouble> {
        let speed = speed_mm_s.min(self.room.limits.max_speed_mm_s);
        self.jog.send(target, speed).map_err(of)
    }

    /// Every sample of so long a time, up to the first of which `enough` is true.
    ///
    /// # Errors
    /// What the watch over the arm says; the samples before are in `seen`.
    pub fn watch(
        &mut self,
        span: HostDuration,
        seen: &mut Vec<PoseSample>,
        mut enough: impl FnMut(&PoseSample) -> bool,
    ) -> Result<(), Trouble> {
        let stop = self.stop;
        let watched = self.jog.watch(span, seen, |s| enough(s) || stop());
        watched.map_err(of)?;
        if stop() { Err(stopped()) } else { Ok(()) }
    }

    /// Finds the surface below, within the band around the frame's, and gives its height, mm; the tip ends above it.
    ///
    /// # Errors
    /// When there is none, and what else the way down says.
    pub fn touch(&mut self) -> Result<f64, Trouble> {
        let search = self.search;
        let way_mm = 2.0 * search.band_mm;
        match self.jog.touch(search, way_mm, self.stop).map_err(of)? {
            Touched::At(at) => Ok(at.measured.z_mm),
            Touched::Stopped(_) => Err(stopped()),
            Touched::Nothing(at) => Err(Box::new(
                Evidence::new(
                    EvidenceKind::State,
                    "robot",
                    format!(
                        "expected the skin within {} mm of the frame's surface, found nothing down to {:.3} mm",
                        search.band_mm, at.measured.z_mm
                    ),
                )
                .next("look whether the skin is mounted, then touch it off again with `skinrig jog`"),
            )),
        }
    }

    /// Lets the robot exert this much force at most; `None`: what the rig file says.
    ///
    /// # Errors
    /// What the robot answers, and a limit that reads back with another value.
    pub fn limit_force(&mut self, force_n: Option<f64>) -> Result<Vec<Setting>, Trouble> {
        let own = MotionLimits {
            max_force_n: force_n.unwrap_or(self.own.max_force_n),
            ..self.own
        };
        self.jog.limit(&own).map_err(of)
    }

    /// Where the tip is.
    ///
    /// # Errors
    /// As [`watch`](Self::watch).
    pub fn look(&mut self) -> Result<PoseSample, Trouble> {
        self.jog.look().map_err(of)
    }

    /// Brings it to rest where it is, with live motors. Gives when that was ordered.
    ///
    /// # Errors
    /// What the robot answers.
    pub fn hold(&mut self) -> Result<HostTime, Trouble> {
        self.jog.hold().map_err(of)
    }

    /// Motors off, wherever it is; it is not armed again. Gives when that was ordered.
    ///
    /// # Errors
    /// What the robot answers.
    pub fn halt(&mut self) -> Result<HostTime, Trouble> {
        self.jog.halt().map_err(of)
    }
}

/// Takes the arm into free air, says through `held` where it is, and holds it there until `stop`; then it is retracted and braked.
///
/// # Errors
/// What kept it from that.
pub fn hold_in_air(
    robot: &mut dyn Indenter,
    clock: &mut dyn Clock,
    rig: &RigFile,
    patience: HostDuration,
    stop: &dyn Fn() -> bool,
    held: &mut dyn FnMut(Point3<Robot>),
) -> Result<(), Trouble> {
    let room = Room::of(rig, today())?;
    let setup = Setup::new(&room, Reach::Air, patience, &*robot, ControlHandle::new());
    let hand = Hand {
        search: SEARCH,
        stop,
    };
    let mut nothing = Findings::default();
    arm_and_work(robot, clock, &setup, &hand, &mut nothing, &mut |arm, _| {
        let [middle, ..] = arm.room.air();
        let at = arm.go(middle, SLOW_MM_S)?;
        held(arm.room.robot_from_skin.apply(at.measured));
        while !stop() {
            // Of no interest here; what is wrong ends it.
            arm.look()?;
        }
        Ok(())
    })
}

/// The evidence that an error of the guard is.
pub(crate) fn of(e: ControllerError) -> Trouble {
    let rows = cause::of(&e).into_iter();
    let software = || Evidence::new(EvidenceKind::Software, "robot", e.to_string());
    Box::new(rows.last().unwrap_or_else(software))
}

fn stopped() -> Trouble {
    let what = "broken off: everything is to end";
    Box::new(Evidence::new(EvidenceKind::Stopped, "robot", what))
}
