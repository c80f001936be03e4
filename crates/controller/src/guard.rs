//! The only hand on the robot: every motion is checked here, against what the robot last measured.

use skinrig_device::{
    Clock, DeviceError, Indenter, IndenterCapabilities, MotionLimits, RobotSample,
};
use skinrig_model::{
    DeviceIdentity, HostDuration, HostTime, Point2, Point3, PoseSample, RigidTransform, Robot,
    Setting, Skin,
};
use skinrig_protocol::area::Surroundings;
use skinrig_protocol::plan::{OnTrip, RunLimits};

use crate::error::{ControllerError, GuardError};
use crate::settings::ControllerSettings;
use crate::watchdog::{Trip, WatchLimits, Watchdog};

/// How deep the tip may go below the surface of a frame, where the coordinates of motions are not that frame's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    /// The frame whose z = 0 is the surface.
    pub skin_from_robot: RigidTransform<Skin, Robot>,
    /// mm, positive.
    pub max_depth_mm: f64,
}

/// Owns the indenter. Takes targets in the skin frame, refuses what the limits of the run forbid, gives poses in the
/// skin frame, and feeds them to its watchdog: when that trips, the robot holds or brakes before anybody is asked.
pub struct GuardedIndenter<'a> {
    inner: Box<dyn Indenter + 'a>,
    robot_from_skin: RigidTransform<Robot, Skin>,
    skin_from_robot: RigidTransform<Skin, Robot>,
    limits: RunLimits,
    surroundings: Option<Surroundings>,
    floor: Option<Floor>,
    stale_after: HostDuration,
    armed: bool,
    watchdog: Watchdog,
    trip: Option<Trip>,
    target: Option<Point3<Skin>>,
    /// Where the tip went below clearance height: it moves up and down there until it is clear again.
    foot: Option<Point2>,
    samples: Vec<RobotSample>,
}

impl<'a> GuardedIndenter<'a> {
    /// Takes `inner` over. A newest sample older than the settings allow forbids motion.
    #[must_use]
    pub fn new(
        inner: Box<dyn Indenter + 'a>,
        robot_from_skin: RigidTransform<Robot, Skin>,
        limits: RunLimits,
        settings: &ControllerSettings,
    ) -> Self {
        Self {
            inner,
            robot_from_skin,
            skin_from_robot: robot_from_skin.inverse(),
            limits,
            surroundings: None,
            floor: None,
            stale_after: settings.stale_after,
            armed: false,
            watchdog: Watchdog::new(WatchLimits::of(&limits, settings)),
            trip: None,
            target: None,
            foot: None,
            samples: Vec::new(),
        }
    }

    /// With these surroundings: below clearance height only inside the outline, and nowhere too close to a keep-out.
    #[must_use]
    pub fn within(mut self, surroundings: Option<Surroundings>) -> Self {
        self.surroundings = surroundings;
        self
    }

    /// With this floor; rising is always allowed.
    #[must_use]
    pub const fn above(mut self, floor: Option<Floor>) -> Self {
        self.floor = floor;
        self
    }

    /// Who the robot is.
    pub fn identity(&self) -> DeviceIdentity {
        self.inner.identity()
    }

    /// What the robot can do.
    pub fn capabilities(&self) -> IndenterCapabilities {
        self.inner.capabilities()
    }

    /// Hands limits to the robot itself.
    ///
    /// # Errors
    /// What the robot answers.
    pub fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, ControllerError> {
        Ok(self.inner.configure(limits)?)
    }

    /// Powers the motors.
    ///
    /// # Errors
    /// What the robot answers.
    pub fn arm(&mut self) -> Result<(), ControllerError> {
        self.inner.arm()?;
        self.armed = true;
        self.trip = None;
        self.watchdog.start();
        Ok(())
    }

    /// What the robot has to say besides its samples.
    pub fn take_notes(&mut self) -> Vec<String> {
        let mut notes = Vec::new();
        self.inner.take_notes(&mut notes);
        notes
    }

    /// True between [`arm`](Self::arm) and [`disarm`](Self::disarm).
    #[must_use]
    pub const fn is_armed(&self) -> bool {
        self.armed
    }

    /// The newest sample.
    #[must_use]
    pub const fn position(&self) -> Option<PoseSample> {
        self.watchdog.last()
    }

    /// Why the watchdog tripped since the robot was armed; the first reason.
    #[must_use]
    pub const fn trip(&self) -> Option<&Trip> {
        self.trip.as_ref()
    }

    /// True when the tip was last seen at clearance height or above, within the tolerance.
    #[must_use]
    pub(crate) fn is_clear(&self) -> bool {
        self.position()
            .is_some_and(|p| p.measured.z_mm >= self.clear_height_mm())
    }

    fn clear_height_mm(&self) -> f64 {
        self.limits.clearance_mm - self.limits.position_tolerance_mm
    }

    /// Where the tip was told to go last.
    #[must_use]
    pub const fn target(&self) -> Option<Point3<Skin>> {
        self.target
    }

    /// The point at clearance height straight above the tip: above the present target (which does not
    /// depend on when one looks) unless the tip is away from it sideways, then above the tip as measured.
    #[must_use]
    pub(crate) fn point_above(&self) -> Option<Point3<Skin>> {
        let last = self.position()?;
        let held = self.target.unwrap_or(last.commanded);
        let near =
            held.plane().distance_mm(last.measured.plane()) <= self.limits.position_tolerance_mm;
        let foot = if near { held } else { last.measured };
        Some(
            self.inside(foot)
                .plane()
                .at_height(self.limits.clearance_mm),
        )
    }

    /// `at`, or the nearest place of the workspace when that is within the tolerance sideways: a tip that was braked at its edge
    /// may be found a little outside, and has to rise.
    fn inside(&self, at: Point3<Skin>) -> Point3<Skin> {
        let (min, max) = (self.limits.workspace_min_mm, self.limits.workspace_max_mm);
        let x_mm = at.x_mm.max(min[0]).min(max[0]);
        let y_mm = at.y_mm.max(min[1]).min(max[1]);
        let inside = Point3::new(x_mm, y_mm, at.z_mm);
        if inside.distance_mm(at) <= self.limits.position_tolerance_mm {
            inside
        } else {
            at
        }
    }

    /// Checks that the pose stream is alive.
    ///
    /// # Errors
    /// [`GuardError::StalePose`].
    pub(crate) fn check_fresh(&self, now: HostTime) -> Result<(), GuardError> {
        match self.watchdog.age(now) {
            Some(age) if (HostDuration::ZERO..=self.stale_after).contains(&age) => Ok(()),
            age => Err(GuardError::StalePose {
                limit: self.stale_after,
                found: age.map_or_else(|| "none".to_owned(), |a| a.to_string()),
            }),
        }
    }

    /// Starts a straight move to `target` when every rule allows it.
    ///
    /// # Errors
    /// [`GuardError`] when a rule forbids it (the robot hears nothing of it); what the robot answers.
    pub fn command(
        &mut self,
        target: Point3<Skin>,
        speed_mm_s: f64,
        now: HostTime,
    ) -> Result<(), ControllerError> {
        self.check(target, speed_mm_s, now)?;
        self.inner
            .command(self.robot_from_skin.apply(target), speed_mm_s)
            .map_err(|e| self.failed(e))?;
        self.target = Some(target);
        if target.z_mm < self.clear_height_mm() {
            self.foot.get_or_insert(target.plane());
        } else if self.is_clear() {
            self.foot = None;
        }
        Ok(())
    }

    fn check(
        &self,
        target: Point3<Skin>,
        speed_mm_s: f64,
        now: HostTime,
    ) -> Result<(), GuardError> {
        let limits = &self.limits;
        if !target.is_finite() || !speed_mm_s.is_finite() {
            return Err(GuardError::NotFinite {
                found: format!("{:?} at {speed_mm_s} mm/s", target.to_array()),
            });
        }
        if speed_mm_s <= 0.0 || speed_mm_s > limits.max_speed_mm_s {
            return Err(GuardError::Speed {
                limit_mm_s: limits.max_speed_mm_s,
                found_mm_s: speed_mm_s,
            });
        }
        check_target(limits, target)?;
        if !self.armed {
            return Err(GuardError::NotArmed);
        }
        self.check_fresh(now)?;
        let Some(last) = self.position() else {
            return Err(GuardError::NotArmed); // a fresh pose exists, see above
        };
        self.check_floor(last.measured, target)?;
        let lateral_mm = target.plane().distance_mm(last.measured.plane());
        // Steeply: a long way aside in small steps would be no rise.
        let rises = target.z_mm - last.measured.z_mm >= lateral_mm
            && lateral_mm <= limits.position_tolerance_mm;
        if let Some(trip) = self.trip.as_ref().filter(|_| !rises) {
            return Err(GuardError::Tripped {
                why: trip.to_string(),
            });
        }
        let height_mm = target.z_mm.min(last.measured.z_mm);
        // From where the tip went down, too: many small steps are one large one.
        let from_foot_mm = self
            .foot
            .map_or(0.0, |foot| target.plane().distance_mm(foot));
        let aside_mm = if rises {
            lateral_mm
        } else {
            lateral_mm.max(from_foot_mm)
        };
        if aside_mm > limits.position_tolerance_mm && height_mm < self.clear_height_mm() {
            return Err(GuardError::Lateral {
                clearance_mm: limits.clearance_mm,
                lateral_mm: aside_mm,
                height_mm,
            });
        }
        if rises {
            return Ok(()); // away from everything, wherever it was
        }
        self.check_surroundings(last.measured, target)
    }

    /// Half-spaces are convex: with both ends above the floor so is the way between them.
    fn check_floor(&self, from: Point3<Skin>, target: Point3<Skin>) -> Result<(), GuardError> {
        let Some(floor) = &self.floor else {
            return Ok(());
        };
        let depth_mm = |at| {
            let in_robot = self.robot_from_skin.apply(at);
            -floor.skin_from_robot.apply(in_robot).z_mm
        };
        let found_mm = depth_mm(target);
        if found_mm > floor.max_depth_mm && found_mm > depth_mm(from) {
            return Err(GuardError::Floor {
                limit_mm: floor.max_depth_mm,
                found_mm,
            });
        }
        Ok(())
    }

    fn check_surroundings(
        &self,
        from: Point3<Skin>,
        target: Point3<Skin>,
    ) -> Result<(), GuardError> {
        let Some(around) = &self.surroundings else {
            return Ok(());
        };
        let slack_mm = self.limits.position_tolerance_mm;
        let inside_mm = around.outline.clearance_mm(target.plane());
        if target.z_mm < self.clear_height_mm() && inside_mm < -slack_mm {
            return Err(GuardError::Outline {
                outside_mm: -inside_mm,
                height_mm: target.z_mm,
            });
        }
        let lowest_mm = from.z_mm.min(target.z_mm);
        for keep_out in &around.keep_outs {
            let (a, b) = (from.plane(), target.plane());
            if let Some(found_mm) = keep_out.too_close_mm(a, b, lowest_mm, slack_mm) {
                return Err(GuardError::KeepOut {
                    name: keep_out.name.clone(),
                    margin_mm: keep_out.margin_mm,
                    found_mm,
                });
            }
        }
        Ok(())
    }

    /// Appends all new samples, in the skin frame, and lets the watchdog look at them and at the present of `clock`.
    ///
    /// # Errors
    /// [`ControllerError::Watchdog`] when a limit is broken: the robot was told to hold or to brake, and until it is
    /// armed again only a rise is allowed. A sample whose form is wrong and what came after it is not appended. What the
    /// robot answers, after appending what it delivered.
    pub fn poll(
        &mut self,
        clock: &dyn Clock,
        poses: &mut Vec<PoseSample>,
    ) -> Result<(), ControllerError> {
        self.samples.clear();
        let answer = self.inner.poll(&mut self.samples);
        let mut seen = Ok(());
        for s in &self.samples {
            let pose = PoseSample {
                t: s.t,
                commanded: to_nanometre(self.skin_from_robot.apply(s.commanded)),
                measured: to_nanometre(self.skin_from_robot.apply(s.measured)),
                force_n: s.force_n,
            };
            let one = self.watchdog.see(&pose);
            let form_is_wrong = matches!(one, Err(Trip::Feedback { .. }));
            if seen.is_ok() || form_is_wrong {
                seen = one;
            }
            if form_is_wrong {
                break;
            }
            poses.push(pose);
        }
        let looked = self.watchdog.look(clock.now());
        // Both are answered: the second one may say that the robot is to brake.
        for trip in [&seen, &looked]
            .into_iter()
            .filter_map(|r| r.as_ref().err())
        {
            self.react(trip);
        }
        seen.and(looked)?;
        answer.map_err(|e| self.failed(e))
    }

    /// Holds or brakes. What the robot answers is told again by the end of the run.
    fn react(&mut self, trip: &Trip) {
        if !self.armed {
            return;
        }
        self.trip.get_or_insert_with(|| trip.clone());
        let brake = trip.is_blind() || self.limits.on_trip == OnTrip::Brake;
        if brake || self.hold().is_err() {
            let _ = self.disarm();
        }
    }

    /// A device that fails while armed is told to hold, if it still hears; a refusal is no failure.
    fn failed(&mut self, e: DeviceError) -> ControllerError {
        if self.armed && !matches!(e, DeviceError::Refused { .. }) {
            let _ = self.inner.hold();
        }
        e.into()
    }

    /// Stops where it is and holds.
    ///
    /// # Errors
    /// What the robot answers.
    pub fn hold(&mut self) -> Result<(), ControllerError> {
        Ok(self.inner.hold()?)
    }

    /// Motors off.
    ///
    /// # Errors
    /// What the robot answers; no motion is allowed after that either.
    pub fn disarm(&mut self) -> Result<(), ControllerError> {
        self.armed = false;
        self.watchdog.stop();
        Ok(self.inner.disarm()?)
    }
}

/// Checks that `target` lies in the workspace and not too deep.
///
/// # Errors
/// [`GuardError::Workspace`], [`GuardError::Depth`].
pub(crate) fn check_target(limits: &RunLimits, target: Point3<Skin>) -> Result<(), GuardError> {
    let bounds = limits.workspace_min_mm.iter().zip(limits.workspace_max_mm);
    for ((axis, found_mm), (&min_mm, max_mm)) in ['x', 'y', 'z']
        .into_iter()
        .zip(target.to_array())
        .zip(bounds)
    {
        if !(min_mm..=max_mm).contains(&found_mm) {
            return Err(GuardError::Workspace {
                axis,
                min_mm,
                max_mm,
                found_mm,
            });
        }
    }
    if -target.z_mm > limits.max_depth_mm {
        return Err(GuardError::Depth {
            limit_mm: limits.max_depth_mm,
            found_mm: -target.z_mm,
        });
    }
    Ok(())
}
/// Rounds a pose to whole nanometres, far below any robot's resolution (omega.3: about 10 µm). Going to another
/// frame and back changes the last bits of a coordinate; rounded, a replayed pose is the recorded one to the last
/// bit, and so is everything computed from it.
fn to_nanometre(p: Point3<Skin>) -> Point3<Skin> {
    let round = |mm: f64| (mm * 1e6).round() / 1e6;
    Point3::new(round(p.x_mm), round(p.y_mm), round(p.z_mm))
}
