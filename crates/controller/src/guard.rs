//! The guard: the only access to the robot. It checks every motion against the last measured pose.

use skinrig_device::{
    Clock, DeviceError, Indenter, IndenterCapabilities, MotionLimits, RobotSample,
};
use skinrig_model::{
    DeviceIdentity, GuardError, HostDuration, HostTime, Point2, Point3, PoseSample, RigidTransform,
    Robot, RunFault, Setting, Skin, WatchdogTrip,
};
use skinrig_protocol::area::Surroundings;
use skinrig_protocol::plan::{RunLimits, TripReaction};

use crate::settings::ControllerSettings;
use crate::watchdog::{WatchLimits, Watchdog};

/// Limit on the depth below the surface of a frame, where motions use the coordinates of a different frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    /// The frame whose z = 0 is the surface.
    pub skin_from_robot: RigidTransform<Skin, Robot>,
    /// mm, positive.
    pub max_depth_mm: f64,
}

/// Owns the indenter. Accepts targets in the skin frame, rejects motions that violate the limits of the run, returns poses in the
/// skin frame, and passes them to its watchdog. After a trip the robot holds or brakes before `poll` returns the error.
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
    trip: Option<WatchdogTrip>,
    target: Option<Point3<Skin>>,
    /// Where the tip went below clearance height. It may only move vertically until it is clear again.
    foot: Option<Point2>,
    samples: Vec<RobotSample>,
}

impl<'a> GuardedIndenter<'a> {
    /// Takes over `inner`. Rejects motions if the newest sample is older than the settings allow.
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

    /// Adds surroundings: below clearance height only inside the outline, and never close to a keep-out.
    #[must_use]
    pub fn with_surroundings(mut self, surroundings: Option<Surroundings>) -> Self {
        self.surroundings = surroundings;
        self
    }

    /// Adds a floor; upward motion is always allowed.
    #[must_use]
    pub(crate) const fn with_floor(mut self, floor: Option<Floor>) -> Self {
        self.floor = floor;
        self
    }

    /// Identity of the robot.
    pub fn identity(&self) -> DeviceIdentity {
        self.inner.identity()
    }

    /// Pose of the frame in which targets and poses are given.
    pub(crate) const fn robot_from_skin(&self) -> &RigidTransform<Robot, Skin> {
        &self.robot_from_skin
    }

    /// Capabilities of the robot.
    pub fn capabilities(&self) -> IndenterCapabilities {
        self.inner.capabilities()
    }

    /// Configures the robot's own limits.
    ///
    /// # Errors
    /// The error of the robot.
    pub fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, RunFault> {
        Ok(self.inner.configure(limits)?)
    }

    /// Powers the motors.
    ///
    /// # Errors
    /// The error of the robot.
    pub fn arm(&mut self) -> Result<(), RunFault> {
        self.inner.arm()?;
        self.armed = true;
        self.trip = None;
        self.watchdog.start();
        Ok(())
    }

    /// Takes the notes of the robot.
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

    /// First trip of the watchdog since the robot was armed.
    #[must_use]
    pub const fn trip(&self) -> Option<&WatchdogTrip> {
        self.trip.as_ref()
    }

    /// True if the last sample was at clearance height or above, within the tolerance.
    #[must_use]
    pub(crate) fn is_clear(&self) -> bool {
        self.position()
            .is_some_and(|p| p.measured.z_mm >= self.clear_height_mm())
    }

    fn clear_height_mm(&self) -> f64 {
        self.limits.clearance_mm - self.limits.position_tolerance_mm
    }

    /// Target of the last command.
    #[must_use]
    pub const fn target(&self) -> Option<Point3<Skin>> {
        self.target
    }

    /// The point at clearance height straight above the current target, which does not depend on the polling time. If the tip is
    /// laterally away from the target, the point above the measured tip.
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

    /// `at`, or the nearest point of the workspace if that is within the lateral tolerance: a tip that braked at the edge
    /// may be slightly outside, and must be able to rise.
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

    /// Checks that the pose stream is current.
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

    /// Starts a straight move to `target` if all rules allow it.
    ///
    /// # Errors
    /// [`GuardError`] if a rule forbids it (the robot receives nothing); otherwise the error of the robot.
    pub fn command(
        &mut self,
        target: Point3<Skin>,
        speed_mm_s: f64,
        now: HostTime,
    ) -> Result<(), RunFault> {
        self.check(target, speed_mm_s, now)?;
        self.inner
            .command(self.robot_from_skin.apply(target), speed_mm_s)
            .map_err(|e| self.hold_after(e))?;
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
        // Nearly vertical: small sideways steps must not add up to lateral motion.
        let rises = target.z_mm - last.measured.z_mm >= lateral_mm
            && lateral_mm <= limits.position_tolerance_mm;
        if let Some(trip) = self.trip.as_ref().filter(|_| !rises) {
            return Err(GuardError::Tripped(trip.clone()));
        }
        let height_mm = target.z_mm.min(last.measured.z_mm);
        // Measured from where the tip went down, so that many small steps count as one large step.
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
            return Ok(()); // moves away from all obstacles
        }
        self.check_surroundings(last.measured, target)
    }

    /// Half-spaces are convex: if both ends are above the floor, so is the whole path.
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

    /// Appends all new samples in the skin frame, and runs the watchdog on them and on the time of `clock`.
    ///
    /// # Errors
    /// [`RunFault::Watchdog`] if a limit is exceeded: the robot then holds or brakes, and until it is armed again
    /// only upward motion is allowed. A malformed sample and those after it are not appended. Errors of the robot are
    /// returned after appending its samples.
    pub fn poll(&mut self, clock: &dyn Clock, poses: &mut Vec<PoseSample>) -> Result<(), RunFault> {
        self.samples.clear();
        let answer = self.inner.poll(&mut self.samples);
        let mut sample_check = Ok(());
        for s in &self.samples {
            let pose = PoseSample {
                t: s.t,
                commanded: to_nanometre(self.skin_from_robot.apply(s.commanded)),
                measured: to_nanometre(self.skin_from_robot.apply(s.measured)),
                force_n: s.force_n,
            };
            let check = self.watchdog.check_sample(&pose);
            let form_is_wrong = matches!(check, Err(WatchdogTrip::Feedback { .. }));
            if sample_check.is_ok() || form_is_wrong {
                sample_check = check;
            }
            if form_is_wrong {
                break;
            }
            poses.push(pose);
        }
        let looked = self.watchdog.check_poll(clock.now());
        // React to both: the second one may require the robot to brake.
        for trip in [&sample_check, &looked]
            .into_iter()
            .filter_map(|r| r.as_ref().err())
        {
            self.react(trip);
        }
        sample_check.and(looked)?;
        answer.map_err(|e| self.hold_after(e))
    }

    /// Holds or brakes. The end of the run reports a failure of the robot again.
    fn react(&mut self, trip: &WatchdogTrip) {
        if !self.armed {
            return;
        }
        self.trip.get_or_insert_with(|| trip.clone());
        let brake = trip.is_blind() || self.limits.on_trip == TripReaction::Brake;
        if brake || self.hold().is_err() {
            let _ = self.disarm();
        }
    }

    /// Commands a failed device to hold, if it still responds. A rejected request is not a failure.
    fn hold_after(&mut self, e: DeviceError) -> RunFault {
        if self.armed && !matches!(e, DeviceError::Refused { .. }) {
            let _ = self.inner.hold();
        }
        e.into()
    }

    /// Stops and holds the current position.
    ///
    /// # Errors
    /// The error of the robot.
    pub fn hold(&mut self) -> Result<(), RunFault> {
        Ok(self.inner.hold()?)
    }

    /// Switches the motors off.
    ///
    /// # Errors
    /// The error of the robot; no motion is allowed afterwards either way.
    pub fn disarm(&mut self) -> Result<(), RunFault> {
        self.armed = false;
        self.watchdog.stop();
        Ok(self.inner.disarm()?)
    }
}

/// Checks that `target` is inside the workspace and not too deep.
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
/// Rounds a pose to whole nanometres, far below any robot's resolution (omega.3: about 10 µm). Transforming to another
/// frame and back changes the last bits of a coordinate. With rounding, a replayed pose equals the recorded one exactly,
/// and so does everything computed from it.
fn to_nanometre(p: Point3<Skin>) -> Point3<Skin> {
    let round = |mm: f64| (mm * 1e6).round() / 1e6;
    Point3::new(round(p.x_mm), round(p.y_mm), round(p.z_mm))
}
