//! Executes the steps of a plan, one after the other.

use skinrig_model::{HostDuration, HostTime, Point3, Skin};
use skinrig_protocol::plan::Step;

use crate::core::Core;
use crate::error::{ControllerError, Halt};
use crate::moments::Settling;
use crate::states::{Action, Event, State};

impl Core<'_> {
    /// Everything between armed and the end.
    pub(crate) fn steps(&mut self) -> Result<(), Halt> {
        self.begin = self.now();
        self.safe_point()?;
        self.rise_first()?;
        self.check_surface("before the first press")?;
        self.begin = self.now();
        let plan = self.plan;
        for (n, step) in plan.steps.iter().enumerate() {
            let paused = self.safe_point()?;
            self.begin += paused;
            match step {
                Step::Begin { .. } => self.begin = self.now(),
                Step::Pause { duration } => {
                    let due = self.now() + *duration;
                    self.wait_at_clearance(due)?;
                }
                Step::Travel {
                    to,
                    speed_mm_s,
                    deadline,
                } => self.go(&format!("travel (step {n})"), *to, *speed_mm_s, *deadline)?,
                Step::Press(press) => {
                    self.press(press)?;
                    self.check_surface_after(n)?;
                }
            }
        }
        // A stop or pause that came during the last step finds nothing left to hold back.
        match self.machine.fire(Event::PlanDone) {
            Action::Refuse => Err(internal("plan done", self.machine.state())),
            _ => Ok(()),
        }
    }

    /// From an unknown start: straight up before anything sideways.
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

    /// Moves and waits until settled. For motions at clearance height and straight up only. `pause_now` holds the robot
    /// where it is; it moves on when the operator says so.
    pub(crate) fn go(
        &mut self,
        what: &str,
        target: Point3<Skin>,
        speed_mm_s: f64,
        allowed: HostDuration,
    ) -> Result<(), Halt> {
        loop {
            self.breakable = self.indenter.is_clear();
            let went = self.go_once(what, target, speed_mm_s, allowed);
            self.breakable = false;
            if went != Err(Halt::PausedNow) {
                return went;
            }
            self.settling = None;
            self.indenter.hold()?;
            let paused = self.safe_point()?;
            self.begin += paused;
        }
    }

    fn go_once(
        &mut self,
        what: &str,
        target: Point3<Skin>,
        speed_mm_s: f64,
        allowed: HostDuration,
    ) -> Result<(), Halt> {
        let t = self.command(target, speed_mm_s)?;
        let mut settling = Some(Settling::new(target, &self.plan.limits, t));
        std::mem::swap(&mut self.settling, &mut settling);
        loop {
            self.tick(None)?;
            if self
                .settling
                .as_ref()
                .is_some_and(|s| s.settled().is_some())
            {
                self.settling = None;
                return Ok(());
            }
            if self.now() >= t + allowed {
                return Err(self.not_arrived(what, target, allowed).into());
            }
        }
    }

    pub(crate) fn not_arrived(
        &self,
        what: &str,
        target: Point3<Skin>,
        allowed: HostDuration,
    ) -> ControllerError {
        ControllerError::NotArrived {
            what: what.to_owned(),
            tolerance_mm: self.plan.limits.position_tolerance_mm,
            target,
            allowed,
            found: self.indenter.position().map(|p| p.measured),
        }
    }

    /// Waits until `due`; a pause in between moves `due`, and the present repetition, on.
    pub(crate) fn wait_at_clearance(&mut self, mut due: HostTime) -> Result<(), Halt> {
        while self.now() < due {
            self.tick(Some(due))?;
            let paused = self.safe_point()?;
            due += paused;
            self.begin += paused;
        }
        Ok(())
    }

    /// No press is under way: the place to wait or to end when the operator asked for it. Gives the time
    /// spent waiting.
    pub(crate) fn safe_point(&mut self) -> Result<HostDuration, Halt> {
        let from = self.now();
        loop {
            match self.machine.state() {
                State::Paused => self.tick(None)?,
                State::Retracting => return Err(Halt::Stopped),
                _ => match self.machine.fire(Event::SafePoint) {
                    Action::GoOn => return Ok(self.now() - from),
                    Action::Wait => {}
                    Action::Retract => return Err(Halt::Stopped),
                    _ => return Err(internal("safe point", self.machine.state())),
                },
            }
        }
    }
}

/// The table has no such transition.
pub(crate) fn internal(what: &str, state: State) -> Halt {
    ControllerError::Internal(format!("{what}: not possible while {state:?}")).into()
}
