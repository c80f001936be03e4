//! Manual motion of the robot: single moves and slow touches under the same guard as runs.

mod watch;

use skinrig_device::{Clock, Indenter, MotionLimits};
use skinrig_model::{
    DeviceIdentity, GuardError, HostDuration, HostTime, NotArrived, Point3, PoseSample,
    RigidTransform, Robot, RunFault, Skin,
};
use skinrig_protocol::TouchSearch;
use skinrig_protocol::plan::RunLimits;

use crate::control::ControlHandle;
use crate::guard::{Floor, GuardedIndenter};
use crate::press_tracker::Settling;
use crate::settings::ControllerSettings;
use crate::touch::TouchDetector;

/// After a touch the tip moves sideways only this far above it, mm.
const LIFT_MM: f64 = 2.0;
/// Interval between samples of the trace.
const TRACE_EVERY: HostDuration = HostDuration::from_millis(100);
/// Height of the retraction at the end, mm; less at the edge of the workspace.
const RETRACT_MM: f64 = 10.0;

/// Returns true once the operator has requested a stop.
pub(crate) type StopCheck<'a> = &'a dyn Fn() -> bool;

/// Frame and limits of manual motion.
#[derive(Debug, Clone)]
pub struct JogSetup {
    /// Pose of the frame of all coordinates. The identity, so the robot frame, while the pose of the skin is still to be
    /// found by touching off.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// Limits in that frame. Below their clearance height the tip moves only vertically, and no deeper than they allow.
    pub limits: RunLimits,
    /// Limits that the robot itself enforces, robot frame.
    pub robot_limits: MotionLimits,
    /// Nothing goes below it.
    pub floor: Option<Floor>,
    /// Only a halt is handled: it disarms immediately and ends the current call with [`RunFault::Halted`].
    pub control: ControlHandle,
    /// Timing of the controller.
    pub settings: ControllerSettings,
}

/// A manually moved robot. Dropping it holds, retracts and disarms.
pub struct Jog<'a> {
    indenter: GuardedIndenter<'a>,
    clock: Box<dyn Clock + 'a>,
    settings: ControllerSettings,
    limits: RunLimits,
    fresh: Vec<PoseSample>,
    /// Height of the last touch.
    touched_mm: Option<f64>,
    /// Samples for a log that were not yet taken, at least 100 ms apart.
    trace: Vec<PoseSample>,
    traced: Option<HostTime>,
    finished: bool,
    control: ControlHandle,
}

/// Result of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MoveOutcome {
    /// The tip settled at its target.
    Arrived(PoseSample),
    /// The operator stopped the motion; the robot holds.
    Stopped(PoseSample),
}

/// Result of a touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TouchOutcome {
    /// The force rose at this sample.
    At(PoseSample),
    /// The force did not rise down to this sample.
    NotFound(PoseSample),
    /// The operator stopped the motion; the robot holds.
    Stopped(PoseSample),
}

impl<'a> Jog<'a> {
    /// Configures the robot's limits, powers it, and waits for its pose.
    ///
    /// # Errors
    /// The error of the robot; [`RunFault::PoseStream`] if it reports no pose. The robot is then disarmed.
    pub fn start(
        indenter: Box<dyn Indenter + 'a>,
        clock: Box<dyn Clock + 'a>,
        setup: &JogSetup,
    ) -> Result<Self, RunFault> {
        let (limits, settings) = (setup.limits, setup.settings);
        let mut jog = Self {
            indenter: GuardedIndenter::new(indenter, setup.robot_from_skin, limits, &settings)
                .with_floor(setup.floor),
            clock,
            settings,
            limits,
            fresh: Vec::new(),
            touched_mm: None,
            trace: Vec::new(),
            traced: None,
            finished: false,
            control: setup.control.clone(),
        };
        jog.indenter.configure(&setup.robot_limits)?;
        jog.indenter.arm()?;
        let until = jog.clock.now() + jog.settings.first_pose_within;
        while jog.indenter.position().is_none() {
            if jog.clock.now() >= until {
                return Err(RunFault::PoseStream {
                    expected: format!("a sample within {}", jog.settings.first_pose_within),
                    found: "none".to_owned(),
                });
            }
            jog.tick()?;
        }
        Ok(jog)
    }

    /// Identity of the robot.
    #[must_use]
    pub fn identity(&self) -> DeviceIdentity {
        self.indenter.identity()
    }

    /// Current time.
    #[must_use]
    pub fn now(&self) -> HostTime {
        self.clock.now()
    }

    /// Polls the robot and returns the tip position. Call it often: it also monitors force and pose stream.
    ///
    /// # Errors
    /// [`RunFault::Watchdog`] above the force limit or with a stale or invalid pose stream; the error of the robot.
    pub fn look(&mut self) -> Result<PoseSample, RunFault> {
        self.tick()?;
        self.position()
    }

    /// Takes the notes of the robot, such as the force that supports the arm.
    pub fn take_notes(&mut self) -> Vec<String> {
        self.indenter.take_notes()
    }

    /// Takes the path of the tip since the last call, one sample per 100 ms.
    pub fn take_trace(&mut self) -> Vec<PoseSample> {
        std::mem::take(&mut self.trace)
    }

    /// Moves straight to `target`. After a touch, sideways motion needs 2 mm of height above it.
    ///
    /// # Errors
    /// [`RunFault::Guard`] for a motion that is not allowed: nothing moved. [`RunFault::NotArrived`]:
    /// the robot holds. Otherwise as [`look`](Self::look).
    pub fn go(
        &mut self,
        target: Point3<Skin>,
        speed_mm_s: f64,
        stop: StopCheck<'_>,
    ) -> Result<MoveOutcome, RunFault> {
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
                return Ok(MoveOutcome::Stopped(self.look()?));
            }
            if self.clock.now() >= t + allowed {
                self.indenter.hold()?;
                return Err(NotArrived {
                    what: "jog".to_owned(),
                    tolerance_mm: self.limits.position_tolerance_mm,
                    target,
                    allowed,
                    max_force_n: self.limits.max_force_n,
                    found: self.indenter.position().map(Box::new),
                }
                .into());
            }
            self.tick()?;
            self.fresh.iter().for_each(|s| settling.feed(s));
        }
        let at = self.position()?;
        Ok(MoveOutcome::Arrived(at))
    }

    /// Moves down slowly, at most `way_mm`, until the force rises, then back up off the surface.
    ///
    /// # Errors
    /// As [`go`](Self::go); [`RunFault::PoseStream`] for a robot that reports no force.
    pub fn touch(
        &mut self,
        search: TouchSearch,
        way_mm: f64,
        stop: StopCheck<'_>,
    ) -> Result<TouchOutcome, RunFault> {
        let above = self.look()?;
        let current = above.commanded;
        let t = self.command(current, search.speed_mm_s)?;
        let mut detector = TouchDetector::new(search, t);
        let until = t + search.tare + self.settings.first_pose_within;
        while detector.tare_n().is_none() {
            if detector.is_blind() || self.clock.now() >= until {
                return Err(RunFault::PoseStream {
                    expected: "forces".to_owned(),
                    found: "none".to_owned(),
                });
            }
            if stop() {
                return Ok(TouchOutcome::Stopped(self.position()?));
            }
            self.tick()?;
            self.fresh.iter().for_each(|s| detector.feed(s));
        }
        let lowest = current.z_mm - way_mm;
        let t = self.command(current.plane().at_height(lowest), search.speed_mm_s)?;
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
                // Back along the same path, and no higher than the start.
                let z_mm = (found.measured.z_mm + LIFT_MM).min(current.z_mm);
                self.go(current.plane().at_height(z_mm), search.speed_mm_s, stop)?;
                return Ok(TouchOutcome::At(found));
            }
            if stop() {
                self.indenter.hold()?;
                return Ok(TouchOutcome::Stopped(at));
            }
            let low = at.measured.z_mm <= lowest + self.limits.position_tolerance_mm;
            if low || detector.is_blind() || self.clock.now() >= until {
                self.indenter.hold()?;
                return Ok(TouchOutcome::NotFound(at));
            }
        }
    }

    /// Holds, retracts if possible, and disarms; after a halt only disarms. Returns the last tip position, or the first error; the
    /// robot is always commanded to disarm.
    ///
    /// # Errors
    /// The first thing that failed.
    pub fn finish(&mut self) -> Result<Option<PoseSample>, RunFault> {
        if std::mem::replace(&mut self.finished, true) {
            return Ok(self.indenter.position());
        }
        let rose = match self.indenter.is_armed() && !self.control.is_halted() {
            true => self.rise(),
            false => Ok(()),
        };
        // The operator interrupted the retraction; the result of disarming is reported below.
        let rose = rose.or_else(|e| match e {
            RunFault::Halted => Ok(()),
            other => Err(other),
        });
        let disarmed = (0..3)
            .map(|_| self.indenter.disarm())
            .find(Result::is_ok)
            .unwrap_or_else(|| self.indenter.disarm());
        rose.and(disarmed)?;
        Ok(self.indenter.position())
    }

    fn rise(&mut self) -> Result<(), RunFault> {
        self.indenter.hold()?;
        let at = self.look()?.measured;
        let z_mm = (at.z_mm + RETRACT_MM).min(self.limits.workspace_max_mm[2]);
        if z_mm <= at.z_mm {
            return Ok(()); // already at the top
        }
        let speed = self
            .settings
            .rise_speed_mm_s
            .min(self.limits.max_speed_mm_s);
        self.go(at.plane().at_height(z_mm), speed, &|| false)
            .map(drop)
    }

    /// A safe height above a touch at this height, mm.
    fn clear_of(&self, touched_mm: f64) -> f64 {
        touched_mm + LIFT_MM - self.limits.position_tolerance_mm
    }

    /// After a touch, sideways motion would shear the touched object.
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

    fn command(&mut self, target: Point3<Skin>, speed_mm_s: f64) -> Result<HostTime, RunFault> {
        // A slow log may have delayed the loop: poll again before moving.
        if self.indenter.check_fresh(self.clock.now()).is_err() {
            self.tick()?;
        }
        self.indenter
            .command(target, speed_mm_s, self.clock.now())?;
        Ok(self.clock.now())
    }

    fn position(&self) -> Result<PoseSample, RunFault> {
        self.indenter
            .position()
            .ok_or_else(|| RunFault::PoseStream {
                expected: "a known position".to_owned(),
                found: "none".to_owned(),
            })
    }

    fn tick(&mut self) -> Result<(), RunFault> {
        self.clock.wait_until(self.clock.now() + self.settings.tick);
        self.fresh.clear();
        if self.control.is_halted() && self.indenter.is_armed() {
            self.indenter.disarm()?;
            return Err(RunFault::Halted);
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
