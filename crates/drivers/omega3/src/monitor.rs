//! What the driver watches every cycle while the motors are live, and why it brakes.

use std::fmt;
use std::time::Duration;

use skinrig_device::MotionLimits;
use skinrig_drd_abi::{ForceOffCause, StatusField, StatusVector};
use skinrig_model::HostTime;

use crate::config::Trips;
use crate::error::{is_loss, next_step};
use crate::open::cause_words;
use crate::sdk::CallError;
use crate::trajectory::{distance, norm};

/// Why the arm was braked.
#[derive(Debug, Clone, PartialEq)]
pub enum Trip {
    /// The vendor's regulation thread ended, by its own account because of jitter.
    RegulationEnded,
    /// The regulation loop delivers no new reading.
    Silent {
        /// Since when, at most.
        limit: Duration,
    },
    /// The regulation loop is too slow, kHz.
    RegulationSlow {
        /// Limit.
        expected_khz: f64,
        /// Mean since the last look.
        found_khz: f64,
    },
    /// Nobody polled or commanded the robot.
    Unwatched {
        /// For how long.
        limit: Duration,
    },
    /// The controller took the motors' power away.
    ForceOff(ForceOffCause),
    /// The motors' power is away, and the controller names the cause that it already named before arming.
    ForceOffAgain(ForceOffCause),
    /// The robot did not confirm its brake.
    NotBraked(String),
    /// The force is above the hard limit, N.
    Force {
        /// Hard limit.
        limit_n: f64,
        /// Length of the force vector without its tare.
        found_n: f64,
    },
    /// The arm does not hang free when armed, N.
    Tare {
        /// Largest force at rest.
        limit_n: f64,
        /// Mean force.
        found_n: f64,
    },
    /// The tip is far from its set point, mm.
    Deviation {
        /// Limit.
        limit_mm: f64,
        /// Distance.
        found_mm: f64,
    },
    /// The tip jumped, mm.
    Jump {
        /// Limit over the time since the sample before.
        limit_mm: f64,
        /// Distance.
        found_mm: f64,
    },
    /// A position or force that is no number.
    NotFinite,
    /// The tip left the box of the run, mm.
    OutsideBox {
        /// How far outside is tolerated.
        limit_mm: f64,
        /// How far outside it is.
        found_mm: f64,
    },
    /// The process that brakes the arm when this one dies ended.
    Supervisor(String),
    /// A call failed.
    Call(CallError),
}

impl Trip {
    /// True when the device is gone; only opening it again helps.
    #[must_use]
    pub(crate) const fn is_loss(&self) -> bool {
        match self {
            Self::Call(e) => is_loss(e.code),
            Self::ForceOff(cause) => matches!(cause, ForceOffCause::UsbDisconnect),
            _ => false,
        }
    }
}

impl fmt::Display for Trip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RegulationEnded => {
                write!(
                    f,
                    "the vendor's regulation thread ended (jitter or overload of this computer)"
                )
            }
            Self::Silent { limit } => {
                write!(
                    f,
                    "the regulation loop delivered no new position for {limit:?}"
                )
            }
            Self::RegulationSlow {
                expected_khz,
                found_khz,
            } => write!(
                f,
                "the regulation loop is slow: expected {expected_khz} kHz or more, found {found_khz:.3}"
            ),
            Self::Unwatched { limit } => write!(
                f,
                "nobody looked at the live arm for {limit:?}: the program that drives it hangs or its disk stalls; \
                 see that the recording keeps up, then disarm and arm again"
            ),
            Self::ForceOff(cause) => write!(f, "motors went off: {}", cause_words(*cause)),
            Self::ForceOffAgain(cause) => write!(
                f,
                "motors went off without a new cause; the one told before arming was {}",
                cause_words(*cause)
            ),
            Self::NotBraked(why) => write!(f, "{why}"),
            Self::Force { limit_n, found_n } => write!(
                f,
                "force: expected at most {limit_n:.2} N, found {found_n:.2} N"
            ),
            Self::Tare { limit_n, found_n } => write!(
                f,
                "the arm does not hang free: expected at most {limit_n:.2} N at rest, found {found_n:.2} N; \
                 check that the tip touches nothing, the effector's mass and the base's angle"
            ),
            Self::Deviation { limit_mm, found_mm } => write!(
                f,
                "the tip does not follow: expected within {limit_mm} mm of its set point, found {found_mm:.2} mm"
            ),
            Self::Jump { limit_mm, found_mm } => write!(
                f,
                "the tip jumped: expected at most {limit_mm:.2} mm since the last sample, found {found_mm:.2} mm"
            ),
            Self::NotFinite => write!(
                f,
                "expected finite positions and forces, found one that is not"
            ),
            Self::OutsideBox { limit_mm, found_mm } => write!(
                f,
                "the tip left the box of the run: expected at most {limit_mm:.2} mm outside, found {found_mm:.2} mm"
            ),
            Self::Supervisor(why) => write!(f, "the supervisor process ended: {why}"),
            Self::Call(e) => write!(f, "{e}; {}", next_step(e.code)),
        }
    }
}

/// Watches one armed phase.
#[derive(Debug, Clone)]
pub(crate) struct Monitor {
    trips: Trips,
    limits: MotionLimits,
    outside_mm: f64,
    last: (HostTime, [f64; 3]),
}

impl Monitor {
    /// Begins with the tip at `tip_mm`; one that starts outside the box may come in, but go no further out.
    pub(crate) fn new(trips: Trips, limits: MotionLimits, now: HostTime, tip_mm: [f64; 3]) -> Self {
        Self {
            trips,
            limits,
            outside_mm: outside(&limits, tip_mm),
            last: (now, tip_mm),
        }
    }

    /// New limits for the same phase.
    pub(crate) fn set_limits(&mut self, limits: MotionLimits) {
        self.limits = limits;
        self.outside_mm = outside(&limits, self.last.1);
    }

    /// Checks a measured tip and its set point, mm.
    pub(crate) fn position(
        &mut self,
        now: HostTime,
        tip_mm: [f64; 3],
        set_point_mm: [f64; 3],
    ) -> Result<(), Trip> {
        if !tip_mm.iter().all(|c| c.is_finite()) {
            return Err(Trip::NotFinite);
        }
        let (before, was) = std::mem::replace(&mut self.last, (now, tip_mm));
        let seconds = (now - before).as_secs_f64();
        let limit_mm = self.trips.max_jump_mm + self.trips.max_tip_speed_mm_s * seconds;
        let found_mm = distance(tip_mm, was);
        if found_mm > limit_mm {
            return Err(Trip::Jump { limit_mm, found_mm });
        }
        let limit_mm = self.trips.max_deviation_mm;
        let found_mm = distance(tip_mm, set_point_mm);
        if found_mm > limit_mm {
            return Err(Trip::Deviation { limit_mm, found_mm });
        }
        let found_mm = outside(&self.limits, tip_mm);
        self.outside_mm = self.outside_mm.min(found_mm);
        let limit_mm = self.outside_mm + self.trips.box_margin_mm;
        if found_mm > limit_mm {
            return Err(Trip::OutsideBox { limit_mm, found_mm });
        }
        Ok(())
    }

    /// Checks the motors' force without its tare, N. Gives whether it is above the limit of the run.
    pub(crate) fn force(&self, force_n: [f64; 3]) -> Result<bool, Trip> {
        let found_n = norm(force_n);
        if !found_n.is_finite() {
            return Err(Trip::NotFinite);
        }
        let soft_n = self.limits.max_force_n;
        let limit_n = soft_n * self.trips.hard_force_factor;
        if found_n > limit_n {
            return Err(Trip::Force { limit_n, found_n });
        }
        Ok(found_n > soft_n)
    }

    /// Checks that the motors are live.
    pub(crate) fn status(&self, status: &StatusVector) -> Result<(), Trip> {
        if status.is(StatusField::Force) {
            return Ok(());
        }
        let cause = status.force_off_cause().unwrap_or(ForceOffCause::None);
        Err(Trip::ForceOff(cause))
    }

    /// Checks the rate of the regulation loop.
    pub(crate) fn control(&self, found_khz: f64) -> Result<(), Trip> {
        let expected_khz = self.trips.min_control_khz;
        if found_khz >= expected_khz {
            return Ok(());
        }
        Err(Trip::RegulationSlow {
            expected_khz,
            found_khz,
        })
    }
}

/// How far a point lies outside the box, mm; 0 inside.
fn outside(limits: &MotionLimits, p: [f64; 3]) -> f64 {
    norm(std::array::from_fn(|i| {
        (limits.min_mm[i] - p[i])
            .max(p[i] - limits.max_mm[i])
            .max(0.0)
    }))
}

/// Tells new readings from repeated ones.
///
/// A reading that equals the one before counts as new only when the regulation loop must have turned since: a tip at
/// rest stays where it is, but a loop that is asked twice within one turn repeats itself.
#[derive(Debug, Clone)]
pub(crate) struct Freshness {
    period_s: f64,
    last: Option<(HostTime, [u64; 3])>,
}

impl Freshness {
    /// With the slowest loop that is tolerated.
    pub(crate) fn new(khz: f64) -> Self {
        Self {
            period_s: 1e-3 / khz,
            last: None,
        }
    }

    /// The loop's measured rate.
    pub(crate) fn set_rate(&mut self, khz: f64) {
        if khz > 0.0 {
            self.period_s = 1e-3 / khz;
        }
    }

    /// Whether a reading taken at `now` is new.
    pub(crate) fn is_new(&mut self, now: HostTime, position_m: [f64; 3], cached: bool) -> bool {
        let bits = position_m.map(f64::to_bits);
        let new = match self.last {
            None => true,
            Some((t, _)) if now <= t => false,
            Some(_) if cached => false,
            Some((t, before)) => bits != before || (now - t).as_secs_f64() >= self.period_s,
        };
        if new {
            self.last = Some((now, bits));
        }
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: MotionLimits = MotionLimits {
        min_mm: [-10.0; 3],
        max_mm: [10.0; 3],
        max_speed_mm_s: 20.0,
        max_acceleration_mm_s2: 200.0,
        max_force_n: 4.0,
    };

    fn at(us: i64) -> HostTime {
        HostTime(us * 1000)
    }

    #[test]
    fn each_limit_trips_by_its_own_name() {
        let trips = Trips::default();
        let home = [0.0; 3];
        let new = || Monitor::new(trips, LIMITS, at(0), home);
        assert_eq!(new().position(at(500), [0.1, 0.0, 0.0], home), Ok(()));
        let nan = [f64::NAN, 0.0, 0.0];
        assert_eq!(new().position(at(500), nan, home), Err(Trip::NotFinite));
        let far = [3.0, 0.0, 0.0];
        let jump = new().position(at(500), far, far);
        assert!(matches!(jump, Err(Trip::Jump { .. })), "{jump:?}");
        let lag = new().position(at(500), home, [0.0, 0.0, -5.1]);
        assert!(matches!(lag, Err(Trip::Deviation { .. })), "{lag:?}");
        let mut m = Monitor::new(trips, LIMITS, at(0), [11.0, 0.0, 0.0]);
        // It began 1 mm outside: it may come in, and not go out again.
        assert_eq!(
            m.position(at(1000), [12.9, 0.0, 0.0], far),
            Err(Trip::Deviation {
                limit_mm: 5.0,
                found_mm: 9.9
            })
        );
        let near = [9.0, 0.0, 0.0];
        assert_eq!(m.position(at(5000), near, near), Ok(()));
        let out = [12.1, 0.0, 0.0];
        let left = m.position(at(9000), out, out);
        assert!(matches!(left, Err(Trip::OutsideBox { .. })), "{left:?}");
        assert_eq!(new().force([0.0, 0.0, -3.9]), Ok(false));
        assert_eq!(new().force([0.0, 0.0, -4.1]), Ok(true));
        assert!(new().force([4.5, 0.0, -4.5]).is_err());
        assert_eq!(new().force([f64::NAN; 3]), Err(Trip::NotFinite));
        assert!(new().control(0.9).is_err() && new().control(f64::NAN).is_err());
    }

    #[test]
    fn a_repeated_reading_is_no_sample_and_a_tip_at_rest_is_one() {
        let mut fresh = Freshness::new(1.0);
        let p = [0.01, 0.0, 0.0];
        assert!(fresh.is_new(at(0), p, false));
        assert!(
            !fresh.is_new(at(500), p, false),
            "within one turn of the loop"
        );
        assert!(fresh.is_new(at(1000), p, false), "the loop has turned");
        assert!(
            !fresh.is_new(at(3000), p, true),
            "the library repeats itself"
        );
        assert!(fresh.is_new(at(3100), [0.02, 0.0, 0.0], false));
        assert!(
            !fresh.is_new(at(3100), [0.03, 0.0, 0.0], false),
            "no time passed"
        );
        fresh.set_rate(4.0);
        assert!(fresh.is_new(at(3350), [0.02, 0.0, 0.0], false));
    }
}
