//! Faults of a press: what is wrong with an attempt, typed where it arises; the words for people are made here.

use std::fmt;

use skinrig_model::{CameraId, HostDuration, HostTime, Point3, PressFaultKind, PressVerdict, Skin};

use crate::not_arrived::{NotArrived, point};

/// Reason of a press that the operator's `pause_now` broke off.
const PAUSED: &str = "paused by the operator";

/// Why an attempt at a press is invalid.
#[derive(Debug, Clone, PartialEq)]
pub enum PressFault {
    /// A camera lost bytes.
    DataLost {
        /// Which camera.
        camera: CameraId,
        /// How many.
        bytes: u64,
    },
    /// A camera sent no bytes.
    NoData {
        /// Which camera.
        camera: CameraId,
    },
    /// A camera's data of the press had not come when the verdict could wait no longer.
    DataLate {
        /// Which camera.
        camera: CameraId,
        /// The end of the press.
        end: HostTime,
        /// How long the verdict waited.
        waited: HostDuration,
        /// Up to when the camera's data have come; `None`: none have.
        reached: Option<HostTime>,
    },
    /// A camera sent more events per second than the plan bears.
    Storm {
        /// Which camera.
        camera: CameraId,
        /// Events per second.
        level_ev_s: f64,
        /// Events per second.
        found_ev_s: f64,
    },
    /// A motion of the press did not end in time.
    Late(NotArrived),
    /// The tip was back at clearance height too late.
    ClearLate {
        /// The press's deadline.
        allowed: HostDuration,
        /// How long it took.
        found: HostDuration,
    },
    /// The tip was not above its place when it was to go down or deeper.
    Aside {
        /// How far aside it may be, mm.
        tolerance_mm: f64,
        /// Where to.
        target: Point3<Skin>,
        /// Where the tip was.
        found: Option<Point3<Skin>>,
    },
    /// The operator's `pause_now` broke the press off.
    Paused,
    /// A suspension broke the press off; its reason, which begins with `suspended`.
    Suspended(String),
    /// The run ended during the press, for this reason.
    RunEnded(String),
    /// The search for the surface failed.
    Touch(TouchFault),
    /// The moments of the press, or its hold.
    Moments(MomentFault),
}

/// Why the surface was not found by touch.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TouchFault {
    /// The robot reported no force.
    #[error("{during}: expected forces, found none")]
    NoForce {
        /// `tare` or `search`.
        during: &'static str,
    },
    /// The tare did not come to its end.
    #[error("tare: expected forces for {0}, found fewer")]
    FewForces(HostDuration),
    /// The way down to the band did not end in time.
    #[error(transparent)]
    Late(NotArrived),
    /// The force did not rise within the band.
    #[error("expected the surface within {band_mm} mm of the frame's, found none down to {}", .lowest.as_ref().map_or_else(|| "an unknown place".to_owned(), point))]
    NotFound {
        /// mm.
        band_mm: f64,
        /// Where the tip was.
        lowest: Option<Point3<Skin>>,
    },
    /// The force rose where the search began.
    #[error(
        "expected the surface within {band_mm} mm of the frame's, found a touch at once, at {height_mm:.3} mm"
    )]
    AtOnce {
        /// mm.
        band_mm: f64,
        /// mm.
        height_mm: f64,
    },
    /// From the touched surface the press would go below the floor.
    #[error(
        "expected {depth_mm} mm below the touched surface above the floor at -{max_depth_mm} mm, found the surface at {height_mm:.3} mm"
    )]
    TooLow {
        /// mm.
        depth_mm: f64,
        /// mm.
        max_depth_mm: f64,
        /// mm.
        height_mm: f64,
    },
}

/// What is wrong with the moments of a press or with its hold.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MomentFault {
    /// A moment was not measured.
    #[error("expected a measured {0}, found none")]
    Missing(&'static str),
    /// The moments are not in order.
    #[error("expected the moments in order, found {0:?}")]
    OutOfOrder([HostTime; 6]),
    /// Nothing was measured during the hold.
    #[error("expected samples during the hold, found none")]
    NoHold,
    /// The tip left its place during the hold.
    #[error("hold: expected within {tolerance_mm} mm of {}, found {}", point(.target), point(.found))]
    Hold {
        /// mm.
        tolerance_mm: f64,
        /// Where it should have been.
        target: Point3<Skin>,
        /// The sample farthest from there.
        found: Point3<Skin>,
    },
}

impl PressFault {
    /// Its kind, as sessions keep it.
    #[must_use]
    pub const fn kind(&self) -> PressFaultKind {
        use PressFaultKind as K;
        match self {
            Self::DataLost { .. } => K::DataLost,
            Self::NoData { .. } => K::NoData,
            Self::DataLate { .. } => K::DataLate,
            Self::Storm { .. } => K::Storm,
            Self::Late(_) | Self::ClearLate { .. } | Self::Touch(TouchFault::Late(_)) => K::Late,
            Self::Aside { .. } => K::Aside,
            Self::Paused | Self::Suspended(_) => K::Paused,
            Self::RunEnded(_) => K::RunEnded,
            Self::Touch(TouchFault::NoForce { .. } | TouchFault::FewForces(_)) => K::NoForce,
            Self::Touch(_) => K::Surface,
            Self::Moments(MomentFault::Hold { .. }) => K::Hold,
            Self::Moments(_) => K::Unmeasured,
        }
    }

    /// True when another attempt at once may do better. What the skin or the robot is like at this place stays, and a run that
    /// ended makes no attempt.
    #[must_use]
    pub const fn passes(&self) -> bool {
        !self.kind().is_of_the_place() && !matches!(self, Self::RunEnded(_))
    }

    /// True for a press that was broken off on purpose: it says nothing of the rig.
    #[must_use]
    pub(crate) const fn is_pause(&self) -> bool {
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
            Self::Storm {
                camera,
                level_ev_s,
                found_ev_s,
            } => write!(
                f,
                "{camera}: expected at most {level_ev_s} ev/s during the press (`suspend.event_rate`), found {found_ev_s:.0} ev/s"
            ),
            Self::Late(late) => late.fmt(f),
            Self::ClearLate { allowed, found } => write!(
                f,
                "expected to be back at clearance height within {allowed}, found {found}"
            ),
            Self::Aside {
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
            Self::Suspended(reason) => f.write_str(reason),
            Self::RunEnded(reason) => write!(f, "{}: {reason}", PressVerdict::CUT_OFF),
            Self::Touch(touch) => touch.fmt(f),
            Self::Moments(moments) => moments.fmt(f),
        }
    }
}
