//! The watchdog over what the robot measures: depth, force, speed, the feedback itself, its age, and the loop's own pace.
//!
//! A pure function of samples and instants: it holds no device and no clock, so that it is tested alone. Whoever owns the
//! robot feeds it at every look, so that a violation trips at the first look after the sample that shows it: within one
//! control tick, and what is done about it within the next.

use std::collections::VecDeque;

use skinrig_model::{HostDuration, HostTime, Point3, PoseSample, Skin};
use skinrig_protocol::plan::RunLimits;

use crate::settings::ControllerSettings;

/// How much faster than its limit a tip may seem: it lags behind its set point and catches up.
const CATCH_UP: f64 = 1.25;

/// What must hold while the robot is armed, skin frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchLimits {
    /// Deepest measured tip, mm below the surface, positive, tolerance included.
    pub deepest_mm: f64,
    /// Largest measured force, N.
    pub max_force_n: f64,
    /// Fastest measured motion, mm/s.
    pub max_speed_mm_s: f64,
    /// The time over which a speed is taken.
    pub speed_over: HostDuration,
    /// What two samples may differ by without any motion, mm.
    pub tolerance_mm: f64,
    /// At this height and above nothing is touched, and the loop may be late, mm.
    pub clear_mm: f64,
    /// Longest age of the newest sample.
    pub stale_after: HostDuration,
    /// Longest time between two looks while the tip is below [`clear_mm`](Self::clear_mm).
    pub late_after: HostDuration,
}

impl WatchLimits {
    /// Those of a run.
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

/// Why the watchdog tripped.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Trip {
    /// A measured force above the limit.
    #[error("force: expected at most {limit_n} N, found {found_n:.3} N at {t}")]
    Force {
        /// N.
        limit_n: f64,
        /// N.
        found_n: f64,
        /// When.
        t: HostTime,
    },
    /// A measured tip deeper than allowed.
    #[error("depth: expected at most {limit_mm} mm, found {found_mm:.3} mm at {t}")]
    Depth {
        /// mm, positive, tolerance included.
        limit_mm: f64,
        /// mm, positive.
        found_mm: f64,
        /// When.
        t: HostTime,
    },
    /// The measured tip moved faster than allowed, or its measurement jumped.
    #[error("speed: expected at most {limit_mm_s} mm/s, found {found_mm_s:.1} mm/s at {t}")]
    Speed {
        /// mm/s.
        limit_mm_s: f64,
        /// mm/s.
        found_mm_s: f64,
        /// When.
        t: HostTime,
    },
    /// A sample out of order, or without numbers.
    #[error("pose stream: expected {expected}, found {found}")]
    Feedback {
        /// What a stream delivers.
        expected: String,
        /// What came.
        found: String,
    },
    /// The pose stream stands still.
    #[error("pose stream: expected a pose sample no older than {limit}, found {found}")]
    Stale {
        /// Longest allowed age.
        limit: HostDuration,
        /// Age of the newest sample.
        found: HostDuration,
    },
    /// Nobody looked for too long while the tip was low.
    #[error("loop: expected a look at the robot every {limit} at most, found {found} between two")]
    Late {
        /// Longest allowed time.
        limit: HostDuration,
        /// Time between two looks.
        found: HostDuration,
    },
}

impl Trip {
    /// True when the measured position is no longer to be believed: no motion can be led by it.
    #[must_use]
    pub(crate) const fn is_blind(&self) -> bool {
        matches!(self, Self::Feedback { .. } | Self::Stale { .. })
    }
}

/// Looks at every sample and at every look. After a trip only blindness trips again, so that the way out is open.
#[derive(Debug, Clone)]
pub struct Watchdog {
    limits: WatchLimits,
    on: bool,
    tripped: bool,
    last: Option<PoseSample>,
    /// Samples of the time over which a speed is taken, and the one before them.
    recent: VecDeque<(HostTime, Point3<Skin>)>,
    /// Depth of the first sample since the robot was armed, mm, until the tip has been clear: a tip in contact sinks a little
    /// when brakes open, and has to rise before anything else.
    armed_at_mm: Option<f64>,
    /// The tip has been clear since it was armed.
    was_clear: bool,
    looked: Option<HostTime>,
}

impl Watchdog {
    /// One that is off: it checks the feedback's form alone.
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
            looked: None,
        }
    }

    /// The robot is armed. Where it lies then is no fault: until the tip has been clear it may lie as deep as it was found, plus
    /// the tolerance.
    pub fn start(&mut self) {
        self.on = true;
        self.tripped = false;
        self.recent.clear();
        self.armed_at_mm = None;
        self.was_clear = false;
        self.looked = None;
    }

    /// The robot is disarmed.
    pub const fn stop(&mut self) {
        self.on = false;
    }

    /// The newest sample that could be believed.
    #[must_use]
    pub const fn last(&self) -> Option<PoseSample> {
        self.last
    }

    /// Age of that sample at `now`.
    #[must_use]
    pub fn age(&self, now: HostTime) -> Option<HostDuration> {
        self.last.map(|s| now - s.t)
    }

    /// Takes the next sample. One that trips with [`Trip::Feedback`] is forgotten.
    ///
    /// # Errors
    /// Why it trips.
    pub fn see(&mut self, s: &PoseSample) -> Result<(), Trip> {
        self.check_form(s).inspect_err(|_| self.tripped = true)?;
        self.last = Some(*s);
        if !self.on {
            return Ok(());
        }
        let checked = self.check_measured(s);
        self.remember(s);
        if self.tripped {
            return Ok(());
        }
        checked.inspect_err(|_| self.tripped = true)
    }

    /// Takes the end of a look at `now`, after all samples that it brought. `Some` is why it trips.
    ///
    /// # Errors
    /// Why it trips.
    pub fn look(&mut self, now: HostTime) -> Result<(), Trip> {
        let before = self.looked.replace(now);
        let (Some(last), true) = (self.last, self.on) else {
            return Ok(());
        };
        if last.t > now {
            self.tripped = true;
            return Err(Trip::Feedback {
                expected: format!("samples up to the present, {now}"),
                found: format!("one at {}", last.t),
            });
        }
        let (limit, age) = (self.limits.stale_after, now - last.t);
        if age > limit {
            self.tripped = true;
            return Err(Trip::Stale { limit, found: age });
        }
        let (limit, gap) = (
            self.limits.late_after,
            before.map_or(HostDuration::ZERO, |b| now - b),
        );
        // A tip that is clear now may have been low in between: what was measured last decides.
        if gap > limit && last.measured.z_mm < self.limits.clear_mm && !self.tripped {
            self.tripped = true;
            return Err(Trip::Late { limit, found: gap });
        }
        Ok(())
    }

    fn check_form(&self, s: &PoseSample) -> Result<(), Trip> {
        if !s.measured.is_finite() || !s.commanded.is_finite() {
            return Err(Trip::Feedback {
                expected: "finite coordinates".to_owned(),
                found: format!("{:?} at {}", s.measured.to_array(), s.t),
            });
        }
        match self.last.filter(|last| s.t <= last.t) {
            Some(last) => Err(Trip::Feedback {
                expected: format!("a sample after {}", last.t),
                found: format!("one at {}", s.t),
            }),
            None => Ok(()),
        }
    }

    fn check_measured(&mut self, s: &PoseSample) -> Result<(), Trip> {
        let limits = &self.limits;
        // An unknown force is NaN, which is above nothing.
        if s.force_n > limits.max_force_n {
            return Err(Trip::Force {
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
            return Err(Trip::Depth {
                limit_mm,
                found_mm: depth_mm,
                t: s.t,
            });
        }
        if let Some(&(t, at)) = self.recent.front() {
            // Two samples close to one another say little about speed: each is a little off in time.
            let seconds = (s.t - t).max(limits.speed_over).as_secs_f64();
            let way_mm = at.distance_mm(s.measured);
            if way_mm > CATCH_UP * limits.max_speed_mm_s * seconds + limits.tolerance_mm {
                return Err(Trip::Speed {
                    limit_mm_s: limits.max_speed_mm_s,
                    found_mm_s: way_mm / seconds,
                    t: s.t,
                });
            }
        }
        Ok(())
    }

    fn remember(&mut self, s: &PoseSample) {
        self.recent.push_back((s.t, s.measured));
        let over = self.limits.speed_over;
        while self.recent.get(1).is_some_and(|(t, _)| s.t - *t >= over) {
            self.recent.pop_front();
        }
    }
}
