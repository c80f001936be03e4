//! Surface search by touch: averages the force in free air, then moves down slowly until the force rises.

use skinrig_model::{HostDuration, HostTime, Point2, PoseSample, TouchFault, TouchPhase};
use skinrig_protocol::TouchSearch;
use skinrig_protocol::plan::PressStep;

use super::Executor;
use crate::error::Halt;
use crate::press_tracker::Settling;
use crate::touch::TouchDetector;

/// One surface search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Probe {
    /// Location on the skin.
    pub(super) at: Point2,
    /// Depth below the surface that the press reaches afterwards, mm.
    pub(super) depth_mm: f64,
    /// Speed down to the band, mm/s.
    pub(super) approach_speed_mm_s: f64,
    /// Time allowed, for messages.
    pub(super) within: HostDuration,
}

impl Probe {
    pub(super) const fn of(step: &PressStep) -> Self {
        Self {
            at: step.at,
            depth_mm: step.depth_mm,
            approach_speed_mm_s: step.approach_speed_mm_s,
            within: step.deadline,
        }
    }
}

/// Sample at the surface, or the reason why the press cannot continue.
pub(super) type TouchResult = Result<PoseSample, TouchFault>;

impl Executor<'_> {
    /// Averages the force at clearance height, without leaving it.
    pub(super) fn tare(
        &mut self,
        step: Probe,
        search: TouchSearch,
    ) -> Result<Result<(), TouchFault>, Halt> {
        let place = step.at.at_height(self.plan.limits.clearance_mm);
        // The command marks the tare in the journal, and holds the tip in place.
        let from = match self.command_when_steady(place, step.approach_speed_mm_s)? {
            Ok(t) => t,
            Err(off_target) => return Err(off_target.not_arrived("the tare").into()),
        };
        self.trackers.begin_touch(TouchDetector::new(search, from));
        let deadline = from + search.tare + self.settings.first_pose_within;
        let done = self.until_touch(deadline, |t| t.is_blind() || t.tare_n().is_some())?;
        Ok(match self.trackers.touch() {
            Some(t) if done && !t.is_blind() => Ok(()),
            Some(t) if t.is_blind() => Err(TouchFault::NoForce {
                during: TouchPhase::Tare,
            }),
            _ => Err(TouchFault::ShortTare(search.tare)),
        })
    }

    /// Moves from clearance height to the upper end of the band, then slowly down until contact. The motion
    /// to the band was commanded at `down`.
    pub(super) fn find_surface(
        &mut self,
        step: Probe,
        search: TouchSearch,
        down: HostTime,
        deadline: HostTime,
    ) -> Result<TouchResult, Halt> {
        let above = step.at.at_height(search.band_mm);
        let settling = Settling::before_a_motion(above, &self.plan.limits, down);
        self.trackers.settle(settling);
        while self.trackers.is_settling() {
            if self.now() >= deadline {
                self.trackers.stop_settling();
                let late = self.not_arrived("approach", above, step.within);
                return Ok(Err(TouchFault::Late(late)));
            }
            self.tick(Some(deadline))?;
        }
        self.trackers.stop_settling();
        let t = self.command(step.at.at_height(-search.band_mm), search.speed_mm_s)?;
        self.trackers.search_from(t);
        let way_s = 2.0 * search.band_mm / search.speed_mm_s;
        let until = t + HostDuration::from_secs_f64(2.0 * way_s) + self.settings.rise_allowance;
        let floor_mm = -search.band_mm + self.plan.limits.position_tolerance_mm;
        let low = |executor: &Self| {
            let at = executor.indenter.position();
            at.is_some_and(|p| p.measured.z_mm <= floor_mm)
        };
        loop {
            if let Some(found) = self.trackers.touch().and_then(TouchDetector::touched) {
                return Ok(self.check_surface_height(found, step, search));
            }
            if self.trackers.touch().is_some_and(TouchDetector::is_blind) {
                return Ok(Err(TouchFault::NoForce {
                    during: TouchPhase::Search,
                }));
            }
            if low(self) || self.now() >= until.min(deadline) {
                return Ok(Err(TouchFault::NotFound {
                    band_mm: search.band_mm,
                    lowest: self.indenter.position().map(|p| p.measured),
                }));
            }
            self.tick(Some(until.min(deadline)))?;
        }
    }

    /// Accepts a touch inside the band if the press then stays above the floor.
    fn check_surface_height(
        &self,
        found: PoseSample,
        step: Probe,
        search: TouchSearch,
    ) -> TouchResult {
        let limits = &self.plan.limits;
        let height_mm = found.measured.z_mm;
        let highest_mm = search.band_mm - limits.position_tolerance_mm;
        if height_mm >= highest_mm {
            return Err(TouchFault::ImmediateContact {
                band_mm: search.band_mm,
                height_mm,
            });
        }
        let deepest_mm = step.depth_mm - height_mm;
        if deepest_mm > limits.max_depth_mm {
            return Err(TouchFault::TooLow {
                depth_mm: step.depth_mm,
                max_depth_mm: limits.max_depth_mm,
                height_mm,
            });
        }
        Ok(found)
    }

    /// Ticks until the condition on the detector holds; false if `deadline` passed first.
    fn until_touch(
        &mut self,
        deadline: HostTime,
        done: impl Fn(&TouchDetector) -> bool,
    ) -> Result<bool, Halt> {
        while !self.trackers.touch().is_some_and(&done) {
            if self.now() >= deadline {
                return Ok(false);
            }
            self.tick(Some(deadline))?;
        }
        Ok(true)
    }
}
