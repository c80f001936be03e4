//! The check of the surface: touched at the protocol's points, it must lie where the frame says.

use skinrig_model::{HostDuration, Point2, PreflightCheck, PressRole, Record, RepetitionId};
use skinrig_protocol::SurfaceCheck;
use skinrig_protocol::plan::Step;

use crate::core::Core;
use crate::error::{ControllerError, Halt};
use crate::press_fault::TouchFault;
use crate::touch::Probe;

/// What to do about a surface that is not where the frame says.
const NEXT: &str = "look at the mount and the skin; then touch it off again (`skinrig jog --rig FILE`: `touch`, `point NAME`) and put \
                    the points into the rig file";

impl Core<'_> {
    /// Touches the surface at every point of the protocol's check, when it has one. The tip ends at clearance height.
    pub(crate) fn check_surface(&mut self, when: &str) -> Result<(), Halt> {
        let Some(check) = &self.plan.surface_check else {
            return Ok(());
        };
        let (mut rows, mut failed) = (Vec::new(), Vec::new());
        let expected = format!("0 +- {} mm", check.tolerance_mm);
        for at in &check.points {
            let found = self.touch_point(check, *at)?;
            let sound = matches!(found, Ok(mm) if mm.abs() <= check.tolerance_mm);
            let words = found.map_or_else(|why| why.to_string(), |mm| format!("{mm:.3} mm"));
            let name = format!("surface at ({}, {}) mm, {when}", at.x_mm, at.y_mm);
            if !sound {
                failed.push(format!("{name}: expected {expected}, found {words}"));
            }
            rows.push(PreflightCheck::new(
                name,
                expected.as_str(),
                words,
                sound,
                NEXT,
            ));
        }
        self.touch = None;
        self.journal.emit(Record::Preflight(rows))?;
        if failed.is_empty() {
            return Ok(());
        }
        Err(ControllerError::Surface { failed, next: NEXT }.into())
    }

    /// At the end of a repetition, when the protocol asks for it: the check, and back to where the tip was.
    pub(crate) fn check_surface_after(&mut self, step: usize) -> Result<(), Halt> {
        let wanted = self
            .plan
            .surface_check
            .as_ref()
            .is_some_and(|c| c.each_repetition);
        let (true, Some(repetition)) = (wanted, self.repetition_ends(step)) else {
            return Ok(());
        };
        let Some(from) = self.indenter.position() else {
            return Ok(()); // the next look at the robot tells what is wrong with it
        };
        self.check_surface(&format!("after {repetition}"))?;
        self.above("back from the check of the surface", from.measured.plane())
    }

    /// The repetition whose last press is this step.
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

    fn above(&mut self, what: &str, at: Point2) -> Result<(), Halt> {
        let target = at.at_height(self.plan.limits.clearance_mm);
        let from = self.indenter.position();
        let distance_mm = from.map_or(0.0, |p| p.measured.distance_mm(target));
        let (speed_mm_s, allowed) = self.own_motion(distance_mm);
        self.go(what, target, speed_mm_s, allowed)
    }

    /// The height of the surface, mm, or why it was not found. A pause breaks the search off; it is made again.
    fn touch_point(
        &mut self,
        check: &SurfaceCheck,
        at: Point2,
    ) -> Result<Result<f64, TouchFault>, Halt> {
        loop {
            let paused = self.safe_point()?;
            self.begin += paused;
            self.above("travel to a check point", at)?;
            self.breakable = true;
            let searched = self.search_point(check, at);
            self.breakable = false;
            self.settling = None;
            match searched {
                Err(Halt::PausedNow) => self.above("rise from a check point", at)?,
                Err(halt) => return Err(halt),
                Ok(found) => {
                    self.above("rise from a check point", at)?;
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
            Err(aside) => return Err(aside.not_arrived("the touch of a check point").into()),
        };
        let found = self.find_surface(probe, search, down, down + within)?;
        Ok(found.map(|sample| sample.measured.z_mm))
    }
}
