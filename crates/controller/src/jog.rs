//! Moving the robot by hand: single motions and slow touches under the guard of runs.

mod watch;

use skinrig_device::{Clock, Indenter, MotionLimits};
use skinrig_model::{
    DeviceIdentity, HostDuration, HostTime, Point3, PoseSample, RigidTransform, Robot, Setting,
    Skin,
};
use skinrig_protocol::TouchSearch;
use skinrig_protocol::plan::RunLimits;

use crate::control::ControlHandle;
use crate::error::{ControllerError, GuardError};
use crate::guard::{Floor, GuardedIndenter};
use crate::moments::Settling;
use crate::not_arrived::NotArrived;
use crate::settings::ControllerSettings;
use crate::touch::TouchDetector;

/// After a touch the tip goes sideways only this far above its height, mm.
const LIFT_MM: f64 = 2.0;
/// From one sample of the trace to the next.
const TRACE_EVERY: HostDuration = HostDuration::from_millis(100);
/// How far the tip rises at the end, mm; less where the workspace ends.
const RETRACT_MM: f64 = 10.0;

/// Asks whether the operator wants everything to stop now.
pub type Stop<'a> = &'a dyn Fn() -> bool;

/// A robot that is moved by hand. Dropped, it holds, rises and disarms.
pub struct Jog<'a> {
    indenter: GuardedIndenter<'a>,
    clock: Box<dyn Clock + 'a>,
    settings: ControllerSettings,
    limits: RunLimits,
    fresh: Vec<PoseSample>,
    /// Height of the last touch.
    touched_mm: Option<f64>,
    /// Samples far enough apart for a log, not yet taken.
    trace: Vec<PoseSample>,
    traced: Option<HostTime>,
    finished: bool,
    control: ControlHandle,
}

/// How a motion ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moved {
    /// The tip settled at its target.
    Arrived(PoseSample),
    /// The operator stopped it; the robot holds.
    Stopped(PoseSample),
}

/// How a touch ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touched {
    /// The force rose here.
    At(PoseSample),
    /// It did not, down to here.
    Nothing(PoseSample),
    /// The operator stopped it; the robot holds.
    Stopped(PoseSample),
}

impl<'a> Jog<'a> {
    /// Limits the robot, powers it, and waits for its pose. Coordinates, those of `limits` included, are the robot's own:
    /// where the skin lies is what a touch-off is to find out. Nothing goes below the `floor`. Of `control` only a halt is
    /// heard: it disarms at once, and ends whatever is under way with [`ControllerError::Halted`].
    ///
    /// # Errors
    /// What the robot answers; [`ControllerError::PoseStream`] when it tells no pose. It is then disarmed.
    pub fn start(
        indenter: Box<dyn Indenter + 'a>,
        clock: Box<dyn Clock + 'a>,
        limits: RunLimits,
        robot_limits: &MotionLimits,
        floor: Option<Floor>,
        control: &ControlHandle,
        settings: ControllerSettings,
    ) -> Result<(Self, Vec<Setting>), ControllerError> {
        let indenter =
            GuardedIndenter::new(indenter, RigidTransform::identity(), limits, &settings)
                .above(floor);
        Self::begin(indenter, clock, limits, robot_limits, control, settings)
    }

    /// As [`start`](Self::start) in the frame of a skin whose place is known: below the clearance height of `limits` the tip
    /// moves up and down only, and no deeper than they say.
    ///
    /// # Errors
    /// As [`start`](Self::start).
    pub fn on_skin(
        indenter: Box<dyn Indenter + 'a>,
        clock: Box<dyn Clock + 'a>,
        robot_from_skin: RigidTransform<Robot, Skin>,
        limits: RunLimits,
        robot_limits: &MotionLimits,
        control: &ControlHandle,
        settings: ControllerSettings,
    ) -> Result<(Self, Vec<Setting>), ControllerError> {
        let indenter = GuardedIndenter::new(indenter, robot_from_skin, limits, &settings);
        Self::begin(indenter, clock, limits, robot_limits, control, settings)
    }

    fn begin(
        indenter: GuardedIndenter<'a>,
        clock: Box<dyn Clock + 'a>,
        limits: RunLimits,
        robot_limits: &MotionLimits,
        control: &ControlHandle,
        settings: ControllerSettings,
    ) -> Result<(Self, Vec<Setting>), ControllerError> {
        let mut jog = Self {
            indenter,
            clock,
            settings,
            limits,
            fresh: Vec::new(),
            touched_mm: None,
            trace: Vec::new(),
            traced: None,
            finished: false,
            control: control.clone(),
        };
        let written = jog.indenter.configure(robot_limits)?;
        jog.indenter.arm()?;
        let until = jog.clock.now() + jog.settings.first_pose_within;
        while jog.indenter.position().is_none() {
            if jog.clock.now() >= until {
                return Err(ControllerError::PoseStream {
                    expected: format!("a sample within {}", jog.settings.first_pose_within),
                    found: "none".to_owned(),
                });
            }
            jog.tick()?;
        }
        Ok((jog, written))
    }

    /// Who the robot is.
    #[must_use]
    pub fn identity(&self) -> DeviceIdentity {
        self.indenter.identity()
    }

    /// The present.
    #[must_use]
    pub fn now(&self) -> HostTime {
        self.clock.now()
    }

    /// Where the tip is, after a look at the robot. To be called often: it also watches force and stream.
    ///
    /// # Errors
    /// [`ControllerError::Watchdog`] above the force limit, with a stale or broken pose stream; what the robot answers.
    pub fn look(&mut self) -> Result<PoseSample, ControllerError> {
        self.tick()?;
        self.position()
    }

    /// What the robot has to say besides its samples, such as the force that carries the arm.
    pub fn take_notes(&mut self) -> Vec<String> {
        self.indenter.take_notes()
    }

    /// Takes the path of the tip since the last call, a sample every 100 ms.
    pub fn take_trace(&mut self) -> Vec<PoseSample> {
        std::mem::take(&mut self.trace)
    }

    /// Straight to `target`. After a touch sideways only 2 mm above its height.
    ///
    /// # Errors
    /// [`ControllerError::Guard`] for a motion that is not allowed: nothing was done. [`ControllerError::NotArrived`]:
    /// the robot holds. Otherwise as [`look`](Self::look).
    pub fn go(
        &mut self,
        target: Point3<Skin>,
        speed_mm_s: f64,
        stop: Stop<'_>,
    ) -> Result<Moved, ControllerError> {
        let from = self.look()?;
        self.check_lift(from, target)?;
        let way_mm = target.distance_mm(from.measured);
        let t = self.command(target, speed_mm_s)?;
        let allowed =
            HostDuration::from_secs_f64(2.0 * way_mm / speed_mm_s) + self.settings.rise_allowance;
        let mut settling = Settling::before_a_motion(target, &self.limits, t);
        while settling.settled().is_none() {
            if stop() {
                self.indenter.hold()?;
                return Ok(Moved::Stopped(self.look()?));
            }
            if self.clock.now() >= t + allowed {
                self.indenter.hold()?;
                return Err(NotArrived {
                    what: "jog".to_owned(),
                    tolerance_mm: self.limits.position_tolerance_mm,
                    target,
                    allowed,
                    found: self.indenter.position().map(|p| p.measured),
                }
                .into());
            }
            self.tick()?;
            self.fresh.iter().for_each(|s| settling.feed(s));
        }
        let at = self.position()?;
        Ok(Moved::Arrived(at))
    }

    /// Slowly down, at most `way_mm`, until the force rises; then back up off what was touched.
    ///
    /// # Errors
    /// As [`go`](Self::go); [`ControllerError::PoseStream`] for a robot that tells no force.
    pub fn touch(
        &mut self,
        search: TouchSearch,
        way_mm: f64,
        stop: Stop<'_>,
    ) -> Result<Touched, ControllerError> {
        let above = self.look()?;
        let here = above.commanded;
        let t = self.command(here, search.speed_mm_s)?;
        let mut detector = TouchDetector::new(search, t);
        let until = t + search.tare + self.settings.first_pose_within;
        while detector.tare_n().is_none() {
            if detector.is_blind() || self.clock.now() >= until {
                return Err(ControllerError::PoseStream {
                    expected: "forces".to_owned(),
                    found: "none".to_owned(),
                });
            }
            if stop() {
                return Ok(Touched::Stopped(self.position()?));
            }
            self.tick()?;
            self.fresh.iter().for_each(|s| detector.feed(s));
        }
        let lowest = here.z_mm - way_mm;
        let t = self.command(here.plane().at_height(lowest), search.speed_mm_s)?;
        detector.search_from(t);
        let until = t
            + HostDuration::from_secs_f64(2.0 * way_mm / search.speed_mm_s)
            + self.settings.rise_allowance;
        loop {
            self.tick()?;
            self.fresh.iter().for_each(|s| detector.feed(s));
            let at = self.position()?;
            if let Some(found) = detector.touched() {
                self.touched_mm = Some(found.measured.z_mm);
                // Off the skin the way the tip came, and no higher than it came from.
                let z_mm = (found.measured.z_mm + LIFT_MM).min(here.z_mm);
                self.go(here.plane().at_height(z_mm), search.speed_mm_s, stop)?;
                return Ok(Touched::At(found));
            }
            if stop() {
                self.indenter.hold()?;
                return Ok(Touched::Stopped(at));
            }
            let low = at.measured.z_mm <= lowest + self.limits.position_tolerance_mm;
            if low || detector.is_blind() || self.clock.now() >= until {
                self.indenter.hold()?;
                return Ok(Touched::Nothing(at));
            }
        }
    }

    /// Holds, rises where that is possible, disarms; after a halt disarms only. Gives where the tip was then, or what went wrong on the way; the
    /// robot is told to disarm in any case.
    ///
    /// # Errors
    /// The first thing that failed.
    pub fn finish(&mut self) -> Result<Option<PoseSample>, ControllerError> {
        if std::mem::replace(&mut self.finished, true) {
            return Ok(self.indenter.position());
        }
        let rose = match self.indenter.is_armed() && !self.control.is_halted() {
            true => self.rise(),
            false => Ok(()),
        };
        // The operator broke the rise off; whether the motors are off is told below.
        let rose = rose.or_else(|e| match e {
            ControllerError::Halted => Ok(()),
            other => Err(other),
        });
        let disarmed = (0..3)
            .map(|_| self.indenter.disarm())
            .find(Result::is_ok)
            .unwrap_or_else(|| self.indenter.disarm());
        rose.and(disarmed)?;
        Ok(self.indenter.position())
    }

    fn rise(&mut self) -> Result<(), ControllerError> {
        self.indenter.hold()?;
        let at = self.look()?.measured;
        let z_mm = (at.z_mm + RETRACT_MM).min(self.limits.workspace_max_mm[2]);
        if z_mm <= at.z_mm {
            return Ok(()); // nowhere to rise to
        }
        let speed = self
            .settings
            .rise_speed_mm_s
            .min(self.limits.max_speed_mm_s);
        self.go(at.plane().at_height(z_mm), speed, &|| false)
            .map(drop)
    }

    /// Well above what was touched at this height, mm.
    fn clear_of(&self, touched_mm: f64) -> f64 {
        touched_mm + LIFT_MM - self.limits.position_tolerance_mm
    }

    /// After a touch, sideways motion would shear what is touched.
    fn check_lift(&self, from: PoseSample, target: Point3<Skin>) -> Result<(), GuardError> {
        let Some(touched_mm) = self.touched_mm else {
            return Ok(());
        };
        let lateral_mm = target.plane().distance_mm(from.measured.plane());
        let height_mm = target.z_mm.min(from.measured.z_mm);
        let clearance_mm = self.clear_of(touched_mm);
        if lateral_mm > self.limits.position_tolerance_mm && height_mm < clearance_mm {
            return Err(GuardError::Lateral {
                clearance_mm,
                lateral_mm,
                height_mm,
            });
        }
        Ok(())
    }

    fn command(
        &mut self,
        target: Point3<Skin>,
        speed_mm_s: f64,
    ) -> Result<HostTime, ControllerError> {
        // A slow reader of what is said may have held this up: look again before moving.
        if self.indenter.check_fresh(self.clock.now()).is_err() {
            self.tick()?;
        }
        self.indenter
            .command(target, speed_mm_s, self.clock.now())?;
        Ok(self.clock.now())
    }

    fn position(&self) -> Result<PoseSample, ControllerError> {
        self.indenter
            .position()
            .ok_or_else(|| ControllerError::PoseStream {
                expected: "a known position".to_owned(),
                found: "none".to_owned(),
            })
    }

    fn tick(&mut self) -> Result<(), ControllerError> {
        self.clock.wait_until(self.clock.now() + self.settings.tick);
        self.fresh.clear();
        if self.control.is_halted() && self.indenter.is_armed() {
            self.indenter.disarm()?;
            return Err(ControllerError::Halted);
        }
        let polled = self.indenter.poll(self.clock.as_ref(), &mut self.fresh);
        for s in &self.fresh {
            if self.traced.is_none_or(|t| s.t - t >= TRACE_EVERY) {
                self.traced = Some(s.t);
                self.trace.push(*s);
            }
        }
        polled
    }
}

impl Drop for Jog<'_> {
    fn drop(&mut self) {
        let _ = self.finish();
    }
}
