//! Executes the steps of a plan in order.

use skinrig_model::{
    GuardError, HostDuration, HostTime, NotArrived, Point3, PoseSample, PressFault, RunFault, Skin,
};
use skinrig_protocol::plan::Step;

use super::Executor;
use crate::error::Halt;
use crate::press_tracker::Settling;
use crate::states::{Action, Event, State};

impl Executor<'_> {
    /// Everything between arming and the end.
    pub(super) fn steps(&mut self) -> Result<(), Halt> {
        self.note_without_sense()?;
        self.series.begin(self.now());
        self.safe_point()?;
        self.rise_first()?;
        self.check_surface(None)?;
        self.series.begin(self.now());
        let plan = self.plan;
        for (n, step) in plan.steps.iter().enumerate() {
            let paused = self.safe_point()?;
            self.series.delay(paused);
            match step {
                Step::Begin { .. } => self.series.begin(self.now()),
                Step::Pause { duration } => {
                    let due = self.now() + *duration;
                    self.wait_at_clearance(due)?;
                }
                Step::Travel {
                    to,
                    speed_mm_s,
                    deadline,
                } => self.go(&format!("travel (step {n})"), *to, *speed_mm_s, *deadline)?,
                Step::Look { number, .. } => self.begin_look(*number)?,
                Step::Learn => self.begin_learning()?,
                Step::Press(press) => {
                    self.press(press)?;
                    self.check_surface_after(n)?;
                }
            }
        }
        // A stop or pause during the last step has nothing left to delay.
        match self.machine.fire(Event::PlanDone) {
            Action::Reject => Err(internal("plan done", self.machine.state())),
            _ => Ok(()),
        }
    }

    /// Rises straight before any lateral motion, since the start position is unknown.
    fn rise_first(&mut self) -> Result<(), Halt> {
        if self.indenter.is_clear() {
            return Ok(());
        }
        let (Some(target), Some(from)) = (self.indenter.point_above(), self.indenter.position())
        else {
            return Err(internal("rise", self.machine.state()));
        };
        let (speed, allowed) = self.own_motion(target.distance_mm(from.measured));
        self.go("rise from the start position", target, speed, allowed)
    }

    /// Moves and waits until settled. Only for motions at clearance height and straight up. `pause_now` holds the robot
    /// where it is; it continues when the operator resumes.
    pub(super) fn go(
        &mut self,
        what: &str,
        target: Point3<Skin>,
        speed_mm_s: f64,
        allowed: HostDuration,
    ) -> Result<(), Halt> {
        loop {
            self.machine.set_interruptible(self.indenter.is_clear());
            let went = self.go_once(what, target, speed_mm_s, allowed);
            self.machine.set_interruptible(false);
            if went != Err(Halt::PausedNow) {
                return went;
            }
            self.trackers.stop_settling();
            self.indenter.hold()?;
            let paused = self.safe_point()?;
            self.series.delay(paused);
        }
    }

    fn go_once(
        &mut self,
        what: &str,
        target: Point3<Skin>,
        speed_mm_s: f64,
        allowed: HostDuration,
    ) -> Result<(), Halt> {
        let t = match self.command_when_steady(target, speed_mm_s)? {
            Ok(t) => t,
            Err(off_target) => return Err(off_target.not_arrived(what).into()),
        };
        let settling = Settling::before_a_motion(target, &self.plan.limits, t);
        self.trackers.settle(settling);
        loop {
            self.tick(None)?;
            if self.trackers.has_settled() {
                self.trackers.stop_settling();
                return Ok(());
            }
            if self.now() >= t + allowed {
                return Err(self.not_arrived(what, target, allowed).into());
            }
        }
    }

    /// Commands a motion once the newest sample allows it. A tip at rest may be measured slightly off. If the guard rejects a motion
    /// because of the measured position, it is tried again at the next polls, under the same rules. `Err`: the tip does not return
    /// to its position.
    pub(super) fn command_when_steady(
        &mut self,
        target: Point3<Skin>,
        speed_mm_s: f64,
    ) -> Result<Result<HostTime, OffTarget>, Halt> {
        let within = self.settings.steady_within;
        let until = self.now() + within;
        loop {
            match self.command(target, speed_mm_s) {
                Err(RunFault::Guard(GuardError::Lateral { .. })) if self.now() < until => {
                    self.tick(Some(until))?;
                }
                // Compare with the commanded position; without one the rejection is final.
                Err(RunFault::Guard(refused @ GuardError::Lateral { .. })) => {
                    let Some(held) = self.indenter.target() else {
                        return Err(refused.into());
                    };
                    return Ok(Err(OffTarget {
                        target: held,
                        within,
                        tolerance_mm: self.plan.limits.position_tolerance_mm,
                        max_force_n: self.plan.limits.max_force_n,
                        found: self.indenter.position().map(Box::new),
                    }));
                }
                other => return Ok(Ok(other?)),
            }
        }
    }

    pub(super) fn not_arrived(
        &self,
        what: &str,
        target: Point3<Skin>,
        allowed: HostDuration,
    ) -> NotArrived {
        NotArrived {
            what: what.to_owned(),
            tolerance_mm: self.plan.limits.position_tolerance_mm,
            target,
            allowed,
            max_force_n: self.plan.limits.max_force_n,
            found: self.indenter.position().map(Box::new),
        }
    }

    /// Waits until `due`; a pause delays `due` and the current repetition.
    pub(super) fn wait_at_clearance(&mut self, mut due: HostTime) -> Result<(), Halt> {
        while self.now() < due {
            self.tick(Some(due))?;
            let paused = self.safe_point()?;
            due += paused;
            self.series.delay(paused);
        }
        Ok(())
    }

    /// Between presses: waits or ends if the operator requested it. Returns the time spent
    /// waiting.
    pub(super) fn safe_point(&mut self) -> Result<HostDuration, Halt> {
        let from = self.now();
        loop {
            match self.machine.state() {
                State::Paused => self.tick(None)?,
                State::Retracting => return Err(Halt::Stopped),
                _ => match self.machine.fire(Event::SafePoint) {
                    Action::Continue => return Ok(self.now() - from),
                    Action::Wait => {}
                    Action::Retract => return Err(Halt::Stopped),
                    _ => return Err(internal("safe point", self.machine.state())),
                },
            }
        }
    }
}

/// The tip is away from its commanded position before a motion.
pub(super) struct OffTarget {
    target: Point3<Skin>,
    within: HostDuration,
    tolerance_mm: f64,
    max_force_n: f64,
    found: Option<Box<PoseSample>>,
}

impl OffTarget {
    /// As an error of the run: the tip left its position before `what`.
    pub(super) fn not_arrived(self, what: &str) -> NotArrived {
        NotArrived {
            what: format!("before {what}"),
            tolerance_mm: self.tolerance_mm,
            target: self.target,
            allowed: self.within,
            max_force_n: self.max_force_n,
            found: self.found,
        }
    }

    /// As a fault of a press.
    pub(super) fn fault(self) -> PressFault {
        PressFault::PushedAside {
            tolerance_mm: self.tolerance_mm,
            target: self.target,
            found: self.found.map(|s| s.measured),
        }
    }
}

/// The transition table has no such transition.
pub(super) fn internal(what: &str, state: State) -> Halt {
    RunFault::Internal(format!("{what}: not possible while {state:?}")).into()
}
