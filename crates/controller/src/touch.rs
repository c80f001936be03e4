//! Surface search by touch: averages the force in free air, then moves down slowly until the force rises.

use skinrig_model::{HostDuration, HostTime, Point2, PoseSample};
use skinrig_protocol::TouchSearch;
use skinrig_protocol::plan::PressStep;

use crate::error::Halt;
use crate::executor::Executor;
use crate::press_fault::TouchFault;
use crate::press_tracker::Settling;

/// Tracks the force through the pose stream, from the tare to the touch.
///
/// Decisions depend only on command times and samples, so that a replay reproduces them.
#[derive(Debug, Clone)]
pub(crate) struct TouchDetector {
    search: TouchSearch,
    tare_from: HostTime,
    sum_n: f64,
    samples: u32,
    tare_n: Option<f64>,
    blind: bool,
    search_from: Option<HostTime>,
    run: u32,
    first: Option<PoseSample>,
    touched: Option<PoseSample>,
}

impl TouchDetector {
    /// Averages the samples after `tare_from` over the search's tare time.
    pub(crate) const fn new(search: TouchSearch, tare_from: HostTime) -> Self {
        Self {
            search,
            tare_from,
            sum_n: 0.0,
            samples: 0,
            tare_n: None,
            blind: false,
            search_from: None,
            run: 0,
            first: None,
            touched: None,
        }
    }

    /// Sets the time of the command for slow motion: only later forces indicate a touch, since fast motion itself needs
    /// force.
    pub(crate) const fn search_from(&mut self, t: HostTime) {
        self.search_from = Some(t);
    }

    /// Processes the next sample.
    pub(crate) fn feed(&mut self, s: &PoseSample) {
        if s.t <= self.tare_from {
            return;
        }
        if !s.force_n.is_finite() {
            self.blind = true;
            return;
        }
        let Some(tare_n) = self.tare_n else {
            self.sum_n += s.force_n;
            self.samples += 1;
            if s.t >= self.tare_from + self.search.tare {
                self.tare_n = Some(self.sum_n / f64::from(self.samples));
            }
            return;
        };
        if self.touched.is_some() || self.search_from.is_none_or(|t| s.t <= t) {
            return;
        }
        if (s.force_n - tare_n).abs() <= self.search.threshold_n {
            self.run = 0;
            self.first = None;
            return;
        }
        self.run += 1;
        let first = *self.first.get_or_insert(*s);
        if self.run >= self.search.samples {
            self.touched = Some(first);
        }
    }

    /// Force in free air, N, once known.
    pub(crate) const fn tare_n(&self) -> Option<f64> {
        self.tare_n
    }

    /// True if a sample had no force.
    pub(crate) const fn is_blind(&self) -> bool {
        self.blind
    }

    /// The first sample of the touch.
    pub(crate) const fn touched(&self) -> Option<PoseSample> {
        self.touched
    }
}

/// One surface search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Probe {
    /// Location on the skin.
    pub(crate) at: Point2,
    /// Depth below the surface that the press reaches afterwards, mm.
    pub(crate) depth_mm: f64,
    /// Speed down to the band, mm/s.
    pub(crate) approach_speed_mm_s: f64,
    /// Time allowed, for messages.
    pub(crate) within: HostDuration,
}

impl Probe {
    pub(crate) const fn of(step: &PressStep) -> Self {
        Self {
            at: step.at,
            depth_mm: step.depth_mm,
            approach_speed_mm_s: step.approach_speed_mm_s,
            within: step.deadline,
        }
    }
}

/// Sample at the surface, or the reason why the press cannot continue.
pub(crate) type TouchResult = Result<PoseSample, TouchFault>;

impl Executor<'_> {
    /// Averages the force at clearance height, without leaving it.
    pub(crate) fn tare(
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
        self.touch = Some(TouchDetector::new(search, from));
        let deadline = from + search.tare + self.settings.first_pose_within;
        let done = self.until_touch(deadline, |t| t.is_blind() || t.tare_n().is_some())?;
        Ok(match self.touch() {
            Some(t) if done && !t.is_blind() => Ok(()),
            Some(t) if t.is_blind() => Err(TouchFault::NoForce { during: "tare" }),
            _ => Err(TouchFault::ShortTare(search.tare)),
        })
    }

    /// Moves from clearance height to the upper end of the band, then slowly down until contact. The motion
    /// to the band was commanded at `down`.
    pub(crate) fn find_surface(
        &mut self,
        step: Probe,
        search: TouchSearch,
        down: HostTime,
        deadline: HostTime,
    ) -> Result<TouchResult, Halt> {
        let above = step.at.at_height(search.band_mm);
        let mut settling = Some(Settling::before_a_motion(above, &self.plan.limits, down));
        std::mem::swap(&mut self.settling, &mut settling);
        while self
            .settling
            .as_ref()
            .is_some_and(|s| s.settled().is_none())
        {
            if self.now() >= deadline {
                self.settling = None;
                let late = self.not_arrived("approach", above, step.within);
                return Ok(Err(TouchFault::Late(late)));
            }
            self.tick(Some(deadline))?;
        }
        self.settling = None;
        let t = self.command(step.at.at_height(-search.band_mm), search.speed_mm_s)?;
        if let Some(touch) = &mut self.touch {
            touch.search_from(t);
        }
        let way_s = 2.0 * search.band_mm / search.speed_mm_s;
        let until = t + HostDuration::from_secs_f64(2.0 * way_s) + self.settings.rise_allowance;
        let floor_mm = -search.band_mm + self.plan.limits.position_tolerance_mm;
        let low = |executor: &Self| {
            let at = executor.indenter.position();
            at.is_some_and(|p| p.measured.z_mm <= floor_mm)
        };
        loop {
            if let Some(found) = self.touch().and_then(TouchDetector::touched) {
                return Ok(self.check_surface_height(found, step, search));
            }
            if self.touch().is_some_and(TouchDetector::is_blind) {
                return Ok(Err(TouchFault::NoForce { during: "search" }));
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

    fn touch(&self) -> Option<&TouchDetector> {
        self.touch.as_ref()
    }

    /// Ticks until the condition on the detector holds; false if `deadline` passed first.
    fn until_touch(
        &mut self,
        deadline: HostTime,
        done: impl Fn(&TouchDetector) -> bool,
    ) -> Result<bool, Halt> {
        while !self.touch().is_some_and(&done) {
            if self.now() >= deadline {
                return Ok(false);
            }
            self.tick(Some(deadline))?;
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::Point3;

    const SEARCH: TouchSearch = TouchSearch {
        threshold_n: 0.2,
        samples: 3,
        speed_mm_s: 2.0,
        band_mm: 1.0,
        tare: HostDuration::from_millis(4),
    };

    /// Feeds forces, one per millisecond from 1 ms on, with heights falling by 0.1 mm each; returns the height of the touch.
    fn touched(search_from_ms: i64, forces: &[f64]) -> Option<f64> {
        let mut detector = TouchDetector::new(SEARCH, HostTime(0));
        detector.search_from(HostTime(search_from_ms * 1_000_000));
        for (i, force_n) in forces.iter().enumerate() {
            let at = Point3::new(0.0, 0.0, 1.0 - 0.1 * i as f64);
            detector.feed(&PoseSample {
                t: HostTime((i as i64 + 1) * 1_000_000),
                commanded: at,
                measured: at,
                force_n: *force_n,
            });
        }
        detector
            .touched()
            .map(|s| (s.measured.z_mm * 10.0).round() / 10.0)
    }

    #[test]
    fn a_touch_is_a_run_of_samples_above_the_tare() {
        let t = 1.5; // force of holding
        let tare = [1.4, 1.6, 1.5, 1.5];
        let with = |rest: &[f64]| [&tare[..], rest].concat();
        assert_eq!(touched(4, &with(&[t, 1.69, t, 1.6])), None);
        assert_eq!(touched(4, &with(&[t, 1.8, 1.8, 1.8])), Some(0.5));
        // A gap restarts the count; a force in the other direction counts too.
        assert_eq!(touched(4, &with(&[1.8, 1.8, t, 1.8, 1.8])), None);
        assert_eq!(touched(4, &with(&[t, 1.2, 1.2, 1.2])), Some(0.5));
        // The force of fast motion is no touch.
        assert_eq!(touched(7, &with(&[2.5, 2.5, 2.5, t, t])), None);
        assert_eq!(
            touched(7, &with(&[2.5, 2.5, 2.5, 1.8, 1.8, 1.8])),
            Some(0.3)
        );
    }

    #[test]
    fn a_missing_force_is_reported() {
        let mut detector = TouchDetector::new(SEARCH, HostTime(0));
        let at = Point3::new(0.0, 0.0, 0.0);
        detector.feed(&PoseSample {
            t: HostTime(1),
            commanded: at,
            measured: at,
            force_n: f64::NAN,
        });
        assert!(detector.is_blind());
    }
}
