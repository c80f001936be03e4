//! The watchdog over measured depth, force, speed and feedback, and over the delay of the control loop.
//!
//! It is a pure function of samples and times, without device or clock, so that it can be tested alone. The owner of the robot
//! feeds it at every poll. A violation trips it at the first poll after the sample: within one control tick, with a reaction
//! within the next.

use std::collections::VecDeque;

use skinrig_model::{HostDuration, HostTime, Point3, PoseSample, Skin, WatchdogTrip};
use skinrig_protocol::plan::RunLimits;

use crate::settings::ControllerSettings;

/// Allowance above the speed limit: a tip lags behind its set point and catches up.
const CATCH_UP: f64 = 1.25;

/// Limits while the robot is armed, skin frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchLimits {
    /// Largest measured depth below the surface, mm, positive, tolerance included.
    pub deepest_mm: f64,
    /// Largest measured force, N.
    pub max_force_n: f64,
    /// Largest measured speed, mm/s.
    pub max_speed_mm_s: f64,
    /// Time over which speed is measured.
    pub speed_over: HostDuration,
    /// Largest difference of two samples without motion, mm.
    pub tolerance_mm: f64,
    /// From this height up nothing can be touched and the loop may be late, mm.
    pub clear_mm: f64,
    /// Longest age of the newest sample.
    pub stale_after: HostDuration,
    /// Longest time between two polls while the tip is below [`clear_mm`](Self::clear_mm).
    pub late_after: HostDuration,
}

impl WatchLimits {
    /// Limits of a run.
    #[must_use]
    pub fn of(limits: &RunLimits, settings: &ControllerSettings) -> Self {
        Self {
            deepest_mm: limits.max_depth_mm + limits.position_tolerance_mm,
            max_force_n: limits.max_force_n,
            max_speed_mm_s: limits.max_speed_mm_s,
            speed_over: settings.speed_over,
            tolerance_mm: limits.position_tolerance_mm,
            clear_mm: limits.clearance_mm - limits.position_tolerance_mm,
            stale_after: settings.stale_after,
            late_after: settings.late_after,
        }
    }
}

/// Checks every sample and every poll. After a trip only unreliable feedback trips it again, so that the robot can still retract.
#[derive(Debug, Clone)]
pub struct Watchdog {
    limits: WatchLimits,
    on: bool,
    tripped: bool,
    last: Option<PoseSample>,
    /// Samples of the speed window, and the one before it.
    recent: VecDeque<(HostTime, Point3<Skin>)>,
    /// Depth of the first sample since arming, mm, until the tip has been clear: a tip in contact sinks slightly when brakes
    /// open, and must rise before anything else.
    armed_at_mm: Option<f64>,
    /// The tip has been clear since arming.
    was_clear: bool,
    polled: Option<HostTime>,
}

impl Watchdog {
    /// A disabled watchdog, which only checks the form of samples.
    #[must_use]
    pub fn new(limits: WatchLimits) -> Self {
        Self {
            limits,
            on: false,
            tripped: false,
            last: None,
            recent: VecDeque::new(),
            armed_at_mm: None,
            was_clear: false,
            polled: None,
        }
    }

    /// Enables the watchdog when the robot is armed. Until the tip has been clear, it may be as deep as it was found, plus the
    /// tolerance.
    pub fn start(&mut self) {
        self.on = true;
        self.tripped = false;
        self.recent.clear();
        self.armed_at_mm = None;
        self.was_clear = false;
        self.polled = None;
    }

    /// Disables the watchdog when the robot is disarmed.
    pub const fn stop(&mut self) {
        self.on = false;
    }

    /// The newest reliable sample.
    #[must_use]
    pub const fn last(&self) -> Option<PoseSample> {
        self.last
    }

    /// Age of that sample at `now`.
    #[must_use]
    pub fn age(&self, now: HostTime) -> Option<HostDuration> {
        self.last.map(|s| now - s.t)
    }

    /// Checks the next sample. One that trips with [`WatchdogTrip::Feedback`] is discarded.
    ///
    /// # Errors
    /// The reason of the trip.
    pub fn check_sample(&mut self, s: &PoseSample) -> Result<(), WatchdogTrip> {
        self.check_form(s).inspect_err(|_| self.tripped = true)?;
        self.last = Some(*s);
        if !self.on {
            return Ok(());
        }
        let checked = self.check_measured(s);
        self.record_speed_sample(s);
        if self.tripped {
            return Ok(());
        }
        checked.inspect_err(|_| self.tripped = true)
    }

    /// Ends a poll at `now`, after all its samples.
    ///
    /// # Errors
    /// The reason of the trip.
    pub fn check_poll(&mut self, now: HostTime) -> Result<(), WatchdogTrip> {
        let before = self.polled.replace(now);
        let (Some(last), true) = (self.last, self.on) else {
            return Ok(());
        };
        if last.t > now {
            self.tripped = true;
            return Err(WatchdogTrip::Feedback {
                expected: format!("samples up to the present, {now}"),
                found: format!("one at {}", last.t),
            });
        }
        let (limit, age) = (self.limits.stale_after, now - last.t);
        if age > limit {
            self.tripped = true;
            return Err(WatchdogTrip::Stale { limit, found: age });
        }
        let (limit, gap) = (
            self.limits.late_after,
            before.map_or(HostDuration::ZERO, |b| now - b),
        );
        // A tip that is clear now may have been low in between: use the last measurement before.
        if gap > limit && last.measured.z_mm < self.limits.clear_mm && !self.tripped {
            self.tripped = true;
            return Err(WatchdogTrip::Late { limit, found: gap });
        }
        Ok(())
    }

    fn check_form(&self, s: &PoseSample) -> Result<(), WatchdogTrip> {
        if !s.measured.is_finite() || !s.commanded.is_finite() {
            return Err(WatchdogTrip::Feedback {
                expected: "finite coordinates".to_owned(),
                found: format!("{:?} at {}", s.measured.to_array(), s.t),
            });
        }
        match self.last.filter(|last| s.t <= last.t) {
            Some(last) => Err(WatchdogTrip::Feedback {
                expected: format!("a sample after {}", last.t),
                found: format!("one at {}", s.t),
            }),
            None => Ok(()),
        }
    }

    fn check_measured(&mut self, s: &PoseSample) -> Result<(), WatchdogTrip> {
        let limits = &self.limits;
        // A missing force is NaN, which exceeds nothing.
        if s.force_n > limits.max_force_n {
            return Err(WatchdogTrip::Force {
                limit_n: limits.max_force_n,
                found_n: s.force_n,
                t: s.t,
            });
        }
        let depth_mm = -s.measured.z_mm;
        self.was_clear |= s.measured.z_mm >= limits.clear_mm;
        let found_at_mm = *self.armed_at_mm.get_or_insert(depth_mm);
        let limit_mm = if self.was_clear {
            limits.deepest_mm
        } else {
            limits.deepest_mm.max(found_at_mm + limits.tolerance_mm)
        };
        if depth_mm > limit_mm {
            return Err(WatchdogTrip::Depth {
                limit_mm,
                found_mm: depth_mm,
                t: s.t,
            });
        }
        if let Some(&(t, at)) = self.recent.front() {
            // Consecutive samples give no reliable speed, because their times are inexact.
            let seconds = (s.t - t).max(limits.speed_over).as_secs_f64();
            let way_mm = at.distance_mm(s.measured);
            if way_mm > CATCH_UP * limits.max_speed_mm_s * seconds + limits.tolerance_mm {
                return Err(WatchdogTrip::Speed {
                    limit_mm_s: limits.max_speed_mm_s,
                    found_mm_s: way_mm / seconds,
                    t: s.t,
                });
            }
        }
        Ok(())
    }

    fn record_speed_sample(&mut self, s: &PoseSample) {
        self.recent.push_back((s.t, s.measured));
        let over = self.limits.speed_over;
        while self.recent.get(1).is_some_and(|(t, _)| s.t - *t >= over) {
            self.recent.pop_front();
        }
    }
}
