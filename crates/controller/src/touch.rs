//! Finding the surface: the force in free air is averaged, then the tip goes down slowly until the force rises.

use skinrig_model::{HostDuration, HostTime, Point2, PoseSample};
use skinrig_protocol::TouchSearch;
use skinrig_protocol::plan::PressStep;

use crate::core::Core;
use crate::error::Halt;
use crate::moments::Settling;
use crate::press_fault::TouchFault;

/// Follows the force through the pose stream, from the tare to the touch.
///
/// Everything is told apart by instants of commands and by samples alone, so that a replay decides the same.
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
    /// Averages the samples that come after `tare_from`, for the search's tare time.
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

    /// The slow way down was commanded at `t`: only the force after that tells a touch. A fast motion needs force
    /// of its own.
    pub(crate) const fn search_from(&mut self, t: HostTime) {
        self.search_from = Some(t);
    }

    /// Takes the next sample.
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

    /// The force in free air, N, once it is known.
    pub(crate) const fn tare_n(&self) -> Option<f64> {
        self.tare_n
    }

    /// True when a sample came without a force.
    pub(crate) const fn is_blind(&self) -> bool {
        self.blind
    }

    /// The first of the samples that told the touch.
    pub(crate) const fn touched(&self) -> Option<PoseSample> {
        self.touched
    }
}

/// One search for the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Probe {
    /// Where.
    pub(crate) at: Point2,
    /// How deep below the surface the tip goes afterwards, mm.
    pub(crate) depth_mm: f64,
    /// Speed down to the band, mm/s.
    pub(crate) approach_speed_mm_s: f64,
    /// The time given, for messages.
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

/// Where the surface is, or why the press cannot go on.
pub(crate) type Found = Result<PoseSample, TouchFault>;

impl Core<'_> {
    /// Averages the force at clearance height, which the tip does not leave.
    pub(crate) fn tare(
        &mut self,
        step: Probe,
        search: TouchSearch,
    ) -> Result<Result<(), TouchFault>, Halt> {
        let place = step.at.at_height(self.plan.limits.clearance_mm);
        // The command gives the tare its instant in the journal, and the tip its place.
        let from = match self.command_when_steady(place, step.approach_speed_mm_s)? {
            Ok(t) => t,
            Err(aside) => return Err(aside.not_arrived("the tare").into()),
        };
        self.touch = Some(TouchDetector::new(search, from));
        let deadline = from + search.tare + self.settings.first_pose_within;
        let done = self.until_touch(deadline, |t| t.is_blind() || t.tare_n().is_some())?;
        Ok(match self.touch() {
            Some(t) if done && !t.is_blind() => Ok(()),
            Some(t) if t.is_blind() => Err(TouchFault::NoForce { during: "tare" }),
            _ => Err(TouchFault::FewForces(search.tare)),
        })
    }

    /// From clearance height to the upper end of the band, then slowly down until the surface is touched. The way
    /// to the band was commanded at `down`.
    pub(crate) fn find_surface(
        &mut self,
        step: Probe,
        search: TouchSearch,
        down: HostTime,
        deadline: HostTime,
    ) -> Result<Found, Halt> {
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
        let low = |core: &Self| {
            let at = core.indenter.position();
            at.is_some_and(|p| p.measured.z_mm <= floor_mm)
        };
        loop {
            if let Some(found) = self.touch().and_then(TouchDetector::touched) {
                return Ok(self.believe(found, step, search));
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

    /// A touch inside the band from which the floor is not in the way.
    fn believe(&self, found: PoseSample, step: Probe, search: TouchSearch) -> Found {
        let limits = &self.plan.limits;
        let height_mm = found.measured.z_mm;
        let highest_mm = search.band_mm - limits.position_tolerance_mm;
        if height_mm >= highest_mm {
            return Err(TouchFault::AtOnce {
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

    /// Ticks until the detector says so; false when `deadline` came first.
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

    /// Feeds forces, one per millisecond from 1 ms on, falling by 0.1 mm each, and gives the height of the touch.
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
        let t = 1.5; // what the hold needs anyway
        let tare = [1.4, 1.6, 1.5, 1.5];
        let with = |rest: &[f64]| [&tare[..], rest].concat();
        assert_eq!(touched(4, &with(&[t, 1.69, t, 1.6])), None);
        assert_eq!(touched(4, &with(&[t, 1.8, 1.8, 1.8])), Some(0.5));
        // A gap starts the count again; a force the other way counts too.
        assert_eq!(touched(4, &with(&[1.8, 1.8, t, 1.8, 1.8])), None);
        assert_eq!(touched(4, &with(&[t, 1.2, 1.2, 1.2])), Some(0.5));
        // What the fast way down needs is no touch.
        assert_eq!(touched(7, &with(&[2.5, 2.5, 2.5, t, t])), None);
        assert_eq!(
            touched(7, &with(&[2.5, 2.5, 2.5, 1.8, 1.8, 1.8])),
            Some(0.3)
        );
    }

    #[test]
    fn no_force_is_told() {
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
