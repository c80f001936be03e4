//! What becomes of an attempt, and whether another one may bring what it did not.

use std::fmt;

use skinrig_model::{
    CameraId, HostDuration, HostTime, Point3, PressOutcome, PressTiming, PressVerdict,
};

use crate::core::OpenPress;
use crate::moments::PressTracker;

/// Why a press is invalid although the tip is back at clearance height.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Trouble {
    reason: String,
    /// Another attempt may do better.
    again: bool,
}

impl Trouble {
    /// What passes: a motion that was late, a camera that lost data, an operator who broke the press off.
    pub(crate) const fn passing(reason: String) -> Self {
        Self {
            reason,
            again: true,
        }
    }

    /// What the skin or the robot is like at this place: pressing it again would only wear it.
    pub(crate) const fn stays(reason: String) -> Self {
        Self {
            reason,
            again: false,
        }
    }

    /// The run ended during the press, for this reason.
    pub(crate) fn cut_off(reason: &str) -> Self {
        Self::stays(format!("{}: {reason}", PressVerdict::CUT_OFF))
    }
}

/// What spoilt the data of a press, besides lost bytes. All of it passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Spoilt {
    /// What a camera saw of the press had not come when the verdict could wait no longer.
    DataLate {
        camera: CameraId,
        /// The end of the press.
        end: HostTime,
        /// How long the verdict waited.
        waited: HostDuration,
        /// Up to when the camera's data have come; `None`: none have.
        reached: Option<HostTime>,
    },
    /// A camera sent more events per second than a storm has.
    Storm {
        camera: CameraId,
        level_ev_s: f64,
        found_ev_s: f64,
    },
}

impl fmt::Display for Spoilt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
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
        }
    }
}

/// The outcome of a press, valid only when all was measured, stayed in place and nothing was lost; and whether it is worth
/// another attempt: when everything that is wrong passes.
pub(crate) fn judge(open: &OpenPress, trouble: Option<Trouble>) -> (PressOutcome, bool) {
    let mut troubles: Vec<Trouble> = trouble.into_iter().collect();
    let mut timing: Option<PressTiming> = None;
    if let Some(tracker) = &open.tracker {
        match tracker.timing() {
            Ok(t) => timing = Some(t),
            Err(reason) if troubles.is_empty() => troubles.push(Trouble::stays(reason)),
            Err(_) => {}
        }
        if tracker.at_depth().is_some() {
            troubles.extend(tracker.check_hold().err().map(Trouble::stays));
        }
    }
    for camera in CameraId::ALL {
        let (lost, bytes) = (open.lost[camera.index()], open.bytes[camera.index()]);
        if lost > 0 {
            troubles.push(Trouble::passing(format!("{camera} lost {lost} bytes")));
        } else if bytes == 0 {
            troubles.push(Trouble::passing(format!("{camera} sent no bytes")));
        }
    }
    let spoilt = open.spoilt.iter().map(ToString::to_string);
    troubles.extend(spoilt.map(Trouble::passing));
    let again = !troubles.is_empty() && troubles.iter().all(|t| t.again);
    let reasons: Vec<String> = troubles.into_iter().map(|t| t.reason).collect();
    let tracker = open.tracker.as_ref();
    let mean = tracker.and_then(PressTracker::mean);
    let outcome = PressOutcome {
        attempt: open.attempt,
        verdict: if reasons.is_empty() {
            PressVerdict::Valid
        } else {
            PressVerdict::Invalid(reasons.join("; "))
        },
        timing,
        measured_at: mean.map(Point3::plane),
        measured_depth_mm: mean.zip(tracker).map(|(m, t)| t.surface_mm() - m.z_mm),
        touched_mm: tracker.and_then(PressTracker::touched_mm),
        peak_force_n: tracker.and_then(PressTracker::peak_force_n),
        scheduled: false,
    };
    (outcome, again)
}
