//! Faults of a press, typed where they arise, and their messages.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::motion::{NotArrived, point};
use super::surface::TouchFault;
use super::suspension::Suspension;
use crate::frame::{Point3, Skin};
use crate::id::CameraId;
use crate::press_fault::PressFaultKind;
use crate::run_end::RunEnd;
use crate::time::{HostDuration, HostTime};

/// Start of the text of an attempt that did not finish.
pub(crate) const CUT_OFF: &str = "cut off: ";
/// Message for a press that the operator's `pause_now` interrupted.
const PAUSED: &str = "paused by the operator";

/// Reason why an attempt at a press is invalid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PressFault {
    /// A camera lost bytes.
    DataLost {
        /// Camera that lost them.
        camera: CameraId,
        /// Number of bytes.
        bytes: u64,
    },
    /// A camera sent no bytes.
    NoData {
        /// The silent camera.
        camera: CameraId,
    },
    /// A camera's data of the press did not arrive before the verdict was due.
    DataLate {
        /// The late camera.
        camera: CameraId,
        /// The end of the press.
        end: HostTime,
        /// How long the verdict waited.
        waited: HostDuration,
        /// End of the camera's data so far; `None` without any.
        reached: Option<HostTime>,
    },
    /// A camera sent more events per second than the plan allows.
    EventStorm {
        /// The camera.
        camera: CameraId,
        /// Event rate of the press, ev/s.
        level_ev_s: f64,
        /// Limit, ev/s.
        #[serde(with = "crate::number")]
        found_ev_s: f64,
    },
    /// A motion of the press did not arrive in time.
    MotionLate(NotArrived),
    /// The tip returned to clearance height too late.
    ClearLate {
        /// Deadline of the press.
        allowed: HostDuration,
        /// Time taken.
        found: HostDuration,
    },
    /// The tip was not above its location before it was to go down or deeper.
    PushedAside {
        /// Largest allowed lateral deviation, mm.
        tolerance_mm: f64,
        /// Commanded position.
        target: Point3<Skin>,
        /// Measured position.
        found: Option<Point3<Skin>>,
    },
    /// The operator's `pause_now` interrupted the press.
    Paused,
    /// A suspension interrupted the press.
    Suspended(Suspension),
    /// The run ended during the press.
    RunEnded(RunEnd),
    /// The surface search failed.
    Touch(TouchFault),
    /// A phase time or the hold is wrong.
    Timing(TimingFault),
}

/// Moment of a press that [`PressTiming`](crate::PressTiming) needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PressMoment {
    /// The downward motion began.
    Approach,
    /// The tip reached the surface.
    Contact,
    /// The tip settled at its depth.
    AtDepth,
    /// The upward motion began.
    Retract,
    /// The tip left the surface.
    Release,
    /// The tip settled at clearance height.
    Clear,
}

impl fmt::Display for PressMoment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Approach => "start of the approach",
            Self::Contact => "contact",
            Self::AtDepth => "settling at depth",
            Self::Retract => "start of the retraction",
            Self::Release => "release",
            Self::Clear => "settling at clearance height",
        })
    }
}

/// The first two moments in the wrong order.
fn in_disorder(times: &[HostTime; 6]) -> String {
    use PressMoment::{Approach, AtDepth, Clear, Contact, Release, Retract};
    let moments = [Approach, Contact, AtDepth, Retract, Release, Clear];
    let mut pairs = times.windows(2).zip(moments.windows(2));
    match pairs.find(|(t, _)| t[1] < t[0]) {
        Some((t, moment)) => format!(
            "the {} {:.3} ms before the {}",
            moment[1],
            (t[0] - t[1]).0 as f64 * 1e-6,
            moment[0]
        ),
        None => "them in order".to_owned(),
    }
}

/// Fault in the phase times of a press or in its hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum TimingFault {
    /// A phase time was not measured.
    #[error("expected a measured {0}, found none")]
    Missing(PressMoment),
    /// The phase times are not in order.
    #[error("expected phase times in order, found {}", in_disorder(.0))]
    OutOfOrder([HostTime; 6]),
    /// No sample was measured during the hold.
    #[error("expected samples during the hold, found none")]
    NoHold,
    /// The tip left its location during the hold.
    #[error("hold: expected within {tolerance_mm} mm of {}, found {}", point(.target), point(.found))]
    Hold {
        /// Largest allowed deviation, mm.
        tolerance_mm: f64,
        /// Commanded position.
        target: Point3<Skin>,
        /// The sample with the largest deviation.
        found: Point3<Skin>,
    },
}

impl PressFault {
    /// Kind of the fault, as stored in sessions.
    #[must_use]
    pub const fn kind(&self) -> PressFaultKind {
        use PressFaultKind as K;
        match self {
            Self::DataLost { .. } => K::DataLost,
            Self::NoData { .. } => K::NoData,
            Self::DataLate { .. } => K::DataLate,
            Self::EventStorm { .. } => K::Storm,
            Self::MotionLate(_) | Self::ClearLate { .. } | Self::Touch(TouchFault::Late(_)) => {
                K::Late
            }
            Self::PushedAside { .. } => K::Aside,
            Self::Paused | Self::Suspended(_) => K::Paused,
            Self::RunEnded(_) => K::RunEnded,
            Self::Touch(TouchFault::NoForce { .. } | TouchFault::ShortTare(_)) => K::NoForce,
            Self::Touch(_) => K::Surface,
            Self::Timing(TimingFault::Hold { .. }) => K::Hold,
            Self::Timing(_) => K::Unmeasured,
        }
    }

    /// Camera of the fault; `None` for a fault of the robot, the skin or the run.
    #[must_use]
    pub const fn camera(&self) -> Option<CameraId> {
        match self {
            Self::DataLost { camera, .. }
            | Self::NoData { camera }
            | Self::DataLate { camera, .. }
            | Self::EventStorm { camera, .. } => Some(*camera),
            Self::MotionLate(_)
            | Self::ClearLate { .. }
            | Self::PushedAside { .. }
            | Self::Paused
            | Self::Suspended(_)
            | Self::RunEnded(_)
            | Self::Touch(_)
            | Self::Timing(_) => None,
        }
    }

    /// True if another attempt may succeed. Properties of the skin or the robot at this location persist, and a run that has
    /// ended makes no more attempts.
    #[must_use]
    pub const fn passes(&self) -> bool {
        !self.kind().is_of_the_place() && !matches!(self, Self::RunEnded(_))
    }

    /// True for a press that was interrupted on purpose: the rig is not at fault.
    #[must_use]
    pub const fn is_pause(&self) -> bool {
        matches!(self, Self::Paused | Self::Suspended(_))
    }
}

impl fmt::Display for PressFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DataLost { camera, bytes } => write!(f, "{camera} lost {bytes} bytes"),
            Self::NoData { camera } => write!(f, "{camera} sent no bytes"),
            Self::DataLate {
                camera,
                end,
                waited,
                reached,
            } => {
                write!(
                    f,
                    "data late: {camera}: expected data up to {end}, the end of the press, within {waited}, found "
                )?;
                match reached {
                    Some(t) => write!(f, "them up to {t}"),
                    None => f.write_str("none"),
                }
            }
            Self::EventStorm {
                camera,
                level_ev_s,
                found_ev_s,
            } => write!(
                f,
                "{camera}: expected at most {level_ev_s} ev/s during the press (`suspend.event_rate`), found {found_ev_s:.0} ev/s"
            ),
            Self::MotionLate(late) => late.fmt(f),
            Self::ClearLate { allowed, found } => write!(
                f,
                "expected to be back at clearance height within {allowed}, found {found}"
            ),
            Self::PushedAside {
                tolerance_mm,
                target,
                found,
            } => write!(
                f,
                "pushed aside: expected the tip within {tolerance_mm} mm above {}, found {}",
                point(target),
                found.as_ref().map_or_else(|| "no pose".to_owned(), point)
            ),
            Self::Paused => f.write_str(PAUSED),
            Self::Suspended(suspension) => suspension.fmt(f),
            Self::RunEnded(end) => {
                write!(f, "{CUT_OFF}{}", end.reason().unwrap_or_default())
            }
            Self::Touch(touch) => touch.fmt(f),
            Self::Timing(moments) => moments.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_moments_in_the_wrong_order_are_named() {
        let times = [0, 2_000_000, 5_000_000, 4_750_000, 6_000_000, 7_000_000].map(HostTime);
        assert_eq!(
            TimingFault::OutOfOrder(times).to_string(),
            "expected phase times in order, found the start of the retraction 0.250 ms before the settling at depth"
        );
    }
}
