//! Checks of every cycle while the motors are live, and the trips that brake the arm.

use std::fmt;
use std::time::Duration;

use skinrig_device::MotionLimits;
use skinrig_drd_abi::{ForceOffCause, StatusField, StatusVector};
use skinrig_model::HostTime;

use crate::config::Trips;
use crate::error::{is_loss, next_step};
use crate::remark::describe_cause;
use crate::sdk::CallError;
use crate::supervisor::SupervisorFault;
use crate::trajectory::{distance, norm};

/// Why the arm was braked.
#[derive(Debug, Clone, PartialEq)]
pub enum Trip {
    /// The vendor's regulation thread ended; it gives jitter as the reason.
    RegulationEnded,
    /// The regulation loop delivered no new reading.
    Silent {
        /// Time limit.
        limit: Duration,
    },
    /// The regulation loop is too slow, kHz.
    RegulationSlow {
        /// Limit.
        expected_khz: f64,
        /// Mean since the last check.
        found_khz: f64,
    },
    /// The program neither polled nor commanded the robot.
    Unwatched {
        /// Time limit.
        limit: Duration,
    },
    /// The controller switched the motors off.
    ForceOff(ForceOffCause),
    /// The motors are off, and the controller reports the same cause as before arming.
    ForceOffAgain(ForceOffCause),
    /// The robot did not confirm the brake.
    BrakeFailed(String),
    /// The force is above the hard limit, N.
    Force {
        /// Hard limit.
        limit_n: f64,
        /// Magnitude of the force without tare.
        found_n: f64,
    },
    /// The arm did not hang free when arming, N.
    Tare {
        /// Largest allowed force at rest.
        limit_n: f64,
        /// Mean force.
        found_n: f64,
    },
    /// The tip is too far from its set point, mm.
    Deviation {
        /// Limit.
        limit_mm: f64,
        /// Distance.
        found_mm: f64,
    },
    /// The tip jumped, mm.
    Jump {
        /// Limit for the time since the previous sample.
        limit_mm: f64,
        /// Distance.
        found_mm: f64,
    },
    /// A position or force is not finite.
    NotFinite,
    /// The tip left the run's box, mm.
    OutsideBox {
        /// Tolerated distance outside.
        limit_mm: f64,
        /// Distance outside.
        found_mm: f64,
    },
    /// The supervisor process ended.
    Supervisor(SupervisorFault),
    /// A library call failed.
    Call(CallError),
}

impl Trip {
    /// Whether the device is disconnected and must be reopened.
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
                "the live arm was not polled for {limit:?}: the controlling program hangs or its disk stalls; make sure that the \
                recording keeps up, then disarm and arm again"
            ),
            Self::ForceOff(cause) => write!(f, "motors went off: {}", describe_cause(*cause)),
            Self::ForceOffAgain(cause) => write!(
                f,
                "motors went off without a new cause; the cause reported before arming was {}",
                describe_cause(*cause)
            ),
            Self::BrakeFailed(why) => write!(f, "{why}"),
            Self::Force { limit_n, found_n } => write!(
                f,
                "force: expected at most {limit_n:.2} N, found {found_n:.2} N"
            ),
            Self::Tare { limit_n, found_n } => write!(
                f,
                "the arm does not hang free: expected at most {limit_n:.2} N at rest, found {found_n:.2} N; check that the tip touches \
                nothing, the effector mass and the base angle"
            ),
            Self::Deviation { limit_mm, found_mm } => write!(
                f,
                "the tip does not follow: expected within {limit_mm} mm of its set point, found {found_mm:.2} mm"
            ),
            Self::Jump { limit_mm, found_mm } => write!(
                f,
                "the tip jumped: expected at most {limit_mm:.2} mm since the previous sample, found {found_mm:.2} mm"
            ),
            Self::NotFinite => write!(
                f,
                "expected finite positions and forces, found NaN or infinity"
            ),
            Self::OutsideBox { limit_mm, found_mm } => write!(
                f,
                "the tip left the run's box: expected at most {limit_mm:.2} mm outside, found {found_mm:.2} mm"
            ),
            Self::Supervisor(why) => write!(f, "the supervisor process ended: {why}"),
            Self::Call(e) => write!(f, "{e}; {}", next_step(e.code)),
        }
    }
}

/// Monitors one armed phase.
#[derive(Debug, Clone)]
pub(crate) struct Monitor {
    trips: Trips,
    limits: MotionLimits,
    outside_mm: f64,
    last: (HostTime, [f64; 3]),
}

impl Monitor {
    /// Starts with the tip at `tip_mm`. A tip that starts outside the box may move inward but not further out.
    pub(crate) fn new(trips: Trips, limits: MotionLimits, now: HostTime, tip_mm: [f64; 3]) -> Self {
        Self {
            trips,
            limits,
            outside_mm: outside(&limits, tip_mm),
            last: (now, tip_mm),
        }
    }

    /// Changes the limits of the current phase.
    pub(crate) fn set_limits(&mut self, limits: MotionLimits) {
        self.limits = limits;
        self.outside_mm = outside(&limits, self.last.1);
    }

    /// Checks the measured tip against its set point and the limits, mm.
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

    /// Checks the motors' force without tare, N. Returns whether it exceeds the run's limit.
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

/// Distance of a point outside the box, mm; 0 inside.
fn outside(limits: &MotionLimits, p: [f64; 3]) -> f64 {
    norm(std::array::from_fn(|i| {
        (limits.min_mm[i] - p[i])
            .max(p[i] - limits.max_mm[i])
            .max(0.0)
    }))
}

/// Distinguishes new readings from repeated ones.
///
/// A reading equal to the previous one counts as new only if the regulation loop must have completed a turn in between: a tip at rest
/// keeps its position, and a loop that is read twice within one turn repeats itself.
#[derive(Debug, Clone)]
pub(crate) struct Freshness {
    period_s: f64,
    last: Option<(HostTime, [u64; 3])>,
}

impl Freshness {
    /// Starts with the smallest tolerated loop rate.
    pub(crate) fn new(khz: f64) -> Self {
        Self {
            period_s: 1e-3 / khz,
            last: None,
        }
    }

    /// Sets the measured loop rate.
    pub(crate) fn set_rate(&mut self, khz: f64) {
        if khz > 0.0 {
            self.period_s = 1e-3 / khz;
        }
    }

    /// Whether a reading at `now` is new.
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
    fn each_limit_has_its_own_trip() {
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
        // It started 1 mm outside: it may move inward, but not out again.
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
    fn a_repeated_reading_is_not_a_sample_but_a_tip_at_rest_is() {
        let mut fresh = Freshness::new(1.0);
        let p = [0.01, 0.0, 0.0];
        assert!(fresh.is_new(at(0), p, false));
        assert!(
            !fresh.is_new(at(500), p, false),
            "within one turn of the loop"
        );
        assert!(
            fresh.is_new(at(1000), p, false),
            "the loop has completed a turn"
        );
        assert!(
            !fresh.is_new(at(3000), p, true),
            "a reading repeated by the library"
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
