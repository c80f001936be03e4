//! The surface check: touches the protocol's points and compares the surface with the frame.

use skinrig_model::{
    Causes, HostDuration, NoCause, Point2, PreflightCheck, PressRole, Record, RepetitionId,
    RunFault, SurfaceFault, SurfaceFinding, TouchFault,
};
use skinrig_protocol::SurfaceCheck;
use skinrig_protocol::plan::Step;

use super::Executor;
use super::search::Probe;
use crate::error::Halt;

impl Executor<'_> {
    /// Touches the surface at every point of the protocol's check, if it has one: before the first press, or `after` a
    /// repetition. The tip ends at clearance height.
    pub(super) fn check_surface(&mut self, after: Option<RepetitionId>) -> Result<(), Halt> {
        let Some(check) = &self.plan.surface_check else {
            return Ok(());
        };
        let (mut rows, mut failed) = (Vec::new(), Vec::new());
        for at in &check.points {
            let found = self.touch_point(check, *at)?;
            let sound = matches!(found, Ok(mm) if mm.abs() <= check.tolerance_mm);
            let point = SurfaceFault {
                at: *at,
                after,
                tolerance_mm: check.tolerance_mm,
                found: found.map_or_else(SurfaceFinding::NotFound, SurfaceFinding::HeightMm),
            };
            rows.push(PreflightCheck::new(
                point.check(),
                point.expected(),
                point.found.to_string(),
                sound,
                SurfaceFault::NEXT_STEP,
            ));
            if !sound {
                failed.push(point);
            }
        }
        self.trackers.end_touch();
        self.journal.emit(Record::Preflight(rows))?;
        match Causes::try_from(failed) {
            Ok(failed) => Err(RunFault::Surface { failed }.into()),
            Err(NoCause) => Ok(()),
        }
    }

    /// After a repetition, if the protocol requires it: checks the surface, then returns to the previous location.
    pub(super) fn check_surface_after(&mut self, step: usize) -> Result<(), Halt> {
        let due = self
            .plan
            .surface_check
            .as_ref()
            .is_some_and(|c| c.each_repetition);
        let (true, Some(repetition)) = (due, self.repetition_ends(step)) else {
            return Ok(());
        };
        let Some(from) = self.indenter.position() else {
            return Ok(()); // the next poll of the robot reports the failure
        };
        self.check_surface(Some(repetition))?;
        self.travel_above("return from the surface check", from.measured.plane())
    }

    /// The repetition that ends with this step.
    fn repetition_ends(&self, step: usize) -> Option<RepetitionId> {
        let planned = |s: &Step| match s {
            Step::Press(p) => self.plan.presses.get(p.press.index() as usize),
            _ => None,
        };
        let this = planned(self.plan.steps.get(step)?).filter(|p| p.role != PressRole::Sync)?;
        let next = self.plan.steps.get(step + 1..)?.iter().find_map(planned);
        next.is_none_or(|n| n.repetition != this.repetition)
            .then_some(this.repetition)
    }

    fn travel_above(&mut self, what: &str, at: Point2) -> Result<(), Halt> {
        let target = at.at_height(self.plan.limits.clearance_mm);
        let from = self.indenter.position();
        let distance_mm = from.map_or(0.0, |p| p.measured.distance_mm(target));
        let (speed_mm_s, allowed) = self.own_motion(distance_mm);
        self.go(what, target, speed_mm_s, allowed)
    }

    /// Height of the surface, mm, or the reason why it was not found. A search that a pause interrupts is repeated.
    fn touch_point(
        &mut self,
        check: &SurfaceCheck,
        at: Point2,
    ) -> Result<Result<f64, TouchFault>, Halt> {
        loop {
            let paused = self.safe_point()?;
            self.series.delay(paused);
            self.travel_above("travel to a check point", at)?;
            self.machine.set_interruptible(true);
            let searched = self.search_point(check, at);
            self.machine.set_interruptible(false);
            self.trackers.stop_settling();
            match searched {
                Err(Halt::PausedNow) => self.travel_above("rise from a check point", at)?,
                Err(halt) => return Err(halt),
                Ok(found) => {
                    self.travel_above("rise from a check point", at)?;
                    return Ok(found);
                }
            }
        }
    }

    fn search_point(
        &mut self,
        check: &SurfaceCheck,
        at: Point2,
    ) -> Result<Result<f64, TouchFault>, Halt> {
        let search = check.search;
        let (approach_speed_mm_s, way) = self.own_motion(self.plan.limits.clearance_mm);
        let slow = HostDuration::from_secs_f64(4.0 * search.band_mm / search.speed_mm_s);
        let within = search.tare + way + slow + self.settings.rise_allowance;
        let probe = Probe {
            at,
            depth_mm: 0.0,
            approach_speed_mm_s,
            within,
        };
        if let Err(fault) = self.tare(probe, search)? {
            return Ok(Err(fault));
        }
        let band = at.at_height(search.band_mm);
        let down = match self.command_when_steady(band, approach_speed_mm_s)? {
            Ok(t) => t,
            Err(off_target) => {
                return Err(off_target.not_arrived("the touch of a check point").into());
            }
        };
        let found = self.find_surface(probe, search, down, down + within)?;
        Ok(found.map(|sample| sample.measured.z_mm))
    }
}
