//! What can end a run before its plan does.

use skinrig_device::DeviceError;
use skinrig_model::{HostDuration, PreflightCheck};

use crate::not_arrived::NotArrived;
use crate::press_fault::PressFault;
use crate::sink::SinkFault;
use crate::watchdog::Trip;

/// A motion that never reached the robot. Nothing was done; the present motion goes on unchanged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GuardError {
    /// A coordinate or the speed is NaN or infinite.
    #[error("expected finite coordinates and speed, found {found}")]
    NotFinite {
        /// What was asked for.
        found: String,
    },
    /// The speed is not above zero or beyond the limit.
    #[error("expected a speed above 0 and at most {limit_mm_s} mm/s, found {found_mm_s} mm/s")]
    Speed {
        /// mm/s.
        limit_mm_s: f64,
        /// mm/s.
        found_mm_s: f64,
    },
    /// The target lies outside the workspace.
    #[error("expected a target with {axis} from {min_mm} to {max_mm} mm, found {found_mm} mm")]
    Workspace {
        /// `x`, `y` or `z` of the skin frame.
        axis: char,
        /// mm.
        min_mm: f64,
        /// mm.
        max_mm: f64,
        /// mm.
        found_mm: f64,
    },
    /// The target lies deeper than allowed.
    #[error("expected a depth of at most {limit_mm} mm, found {found_mm} mm")]
    Depth {
        /// mm, positive.
        limit_mm: f64,
        /// mm, positive.
        found_mm: f64,
    },
    /// The target lies deeper below the surface of the rig's frame than allowed.
    #[error("expected at most {limit_mm} mm below the frame's surface, found {found_mm:.3} mm")]
    Floor {
        /// mm, positive.
        limit_mm: f64,
        /// mm, positive.
        found_mm: f64,
    },
    /// Sideways motion below clearance height.
    #[error(
        "expected lateral motion only at {clearance_mm} mm or higher, found {lateral_mm:.3} mm sideways at {height_mm:.3} mm"
    )]
    Lateral {
        /// mm.
        clearance_mm: f64,
        /// How far sideways, mm.
        lateral_mm: f64,
        /// The lower end of the motion, mm.
        height_mm: f64,
    },
    /// A target below clearance height beside the skin.
    #[error(
        "expected a target inside the skin's outline below clearance height, found one {outside_mm:.3} mm outside at {height_mm:.3} mm"
    )]
    Outline {
        /// How far outside, at least, mm.
        outside_mm: f64,
        /// Its height, mm.
        height_mm: f64,
    },
    /// The straight way to the target leads too close to something.
    #[error(
        "expected a straight way more than {margin_mm} mm from `{name}`, found {found_mm:.3} mm"
    )]
    KeepOut {
        /// What stands there.
        name: String,
        /// mm.
        margin_mm: f64,
        /// mm.
        found_mm: f64,
    },
    /// The robot's position is not known well enough to move.
    #[error("expected a pose sample no older than {limit}, found {found}")]
    StalePose {
        /// Longest allowed age.
        limit: HostDuration,
        /// Age of the newest sample, or `none`.
        found: String,
    },
    /// The watchdog tripped: only straight up.
    #[error("expected a motion straight up after the watchdog tripped ({why}), found another one")]
    Tripped {
        /// Why it did.
        why: String,
    },
    /// The robot is not armed.
    #[error("expected an armed robot, found it disarmed")]
    NotArmed,
}

/// A run cannot start or go on. Every one of these ends the run safely.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ControllerError {
    /// A device failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The consumer of records failed.
    #[error(transparent)]
    Sink(#[from] SinkFault),
    /// A motion was refused before it reached the robot.
    #[error("motion refused: {0}")]
    Guard(#[from] GuardError),
    /// The plan is not one that this controller executes.
    #[error("plan, {place}: expected {expected}, found {found}; compile the plan again")]
    Plan {
        /// Where in the plan.
        place: String,
        /// What a plan has there.
        expected: String,
        /// What it has.
        found: String,
    },
    /// The rig does not fit the plan or its header.
    #[error("rig, {place}: expected {expected}, found {found}")]
    Rig {
        /// Which part of the rig.
        place: String,
        /// What the run needs.
        expected: String,
        /// What there is.
        found: String,
    },
    /// The surface of the skin is not where the frame says; no press was made on it since.
    #[error("surface check: {}; {next}", .failed.join("; "))]
    Surface {
        /// Each point that failed: place, expected, found. Not empty.
        failed: Vec<String>,
        /// What to do.
        next: &'static str,
    },
    /// Presses went wrong one after the other.
    #[error("invalid presses: expected fewer than {limit} in a row (`limits.max_consecutive_invalid`), found {limit}: {}", joined(.faults))]
    InvalidInARow {
        /// So many are too many.
        limit: u32,
        /// Why, each reason once. Not empty.
        faults: Vec<PressFault>,
    },
    /// A check before the run failed; nothing was powered.
    #[error("preflight: {} failed: {}", count(.failed), joined(&words(.failed)))]
    Preflight {
        /// Each failed check. Not empty.
        failed: Vec<PreflightCheck>,
    },
    /// The pose stream did not begin, or says too little.
    #[error("pose stream: expected {expected}, found {found}")]
    PoseStream {
        /// What a stream delivers.
        expected: String,
        /// What came.
        found: String,
    },
    /// A motion did not end where it should.
    #[error(transparent)]
    NotArrived(#[from] NotArrived),
    /// A measured limit was broken.
    #[error(transparent)]
    Watchdog(#[from] Trip),
    /// A camera's chunks do not follow each other.
    #[error("{camera}: expected chunk {expected}, found chunk {found}")]
    ChunkOrder {
        /// Which camera.
        camera: skinrig_model::CameraId,
        /// The number due.
        expected: u64,
        /// The number that came.
        found: u64,
    },
    /// A session ended whose robot did not come to rest as it should.
    #[error(transparent)]
    NotAtRest(#[from] NotAtRest),
    /// The operator switched the motors off.
    #[error("operator: halt; the motors are off, the tip was left where it was")]
    Halted,
    /// A camera's clock was set forward.
    #[error(
        "{camera}: expected its time to go with the host's within {limit}, found it set forward by {found}; \
         go on with a further leg, which has a clock of its own"
    )]
    ClockStep {
        /// Which camera.
        camera: skinrig_model::CameraId,
        /// By how much it may be off.
        limit: HostDuration,
        /// By how much it is.
        found: HostDuration,
    },
    /// What suspended the run went on for too long.
    #[error("{reason}; expected it to be over within {limit}")]
    Suspended {
        /// What suspended it.
        reason: String,
        /// Longest suspension.
        limit: HostDuration,
    },
    /// The code itself failed, or the run was dropped before its end.
    #[error("internal error: {0}")]
    Internal(String),
}

/// How the robot was left at the end of a run, when it is not as it should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotAtRest {
    /// It may be in contact.
    #[error("the tip was not seen at clearance height: look where it is")]
    NotClear,
    /// Its motors may be on.
    #[error("the robot did not confirm that it is disarmed: switch it off by hand")]
    NotDisarmed,
}

/// What went wrong besides what ended a run, mostly while it was brought to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Which part of the end failed, for example `disarm`; empty where the error says it.
    pub doing: &'static str,
    /// How.
    pub error: ControllerError,
}

impl std::fmt::Display for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.doing {
            "" => self.error.fmt(f),
            doing => write!(f, "{doing}: {}", self.error),
        }
    }
}

/// `1 check` or `2 checks`.
fn count(failed: &[PreflightCheck]) -> String {
    match failed.len() {
        1 => "1 check".to_owned(),
        n => format!("{n} checks"),
    }
}

/// Each failed check in words.
fn words(failed: &[PreflightCheck]) -> Vec<String> {
    let one = |c: &PreflightCheck| {
        format!(
            "{}: expected {}, found {}; {}",
            c.check, c.expected, c.found, c.next_step
        )
    };
    failed.iter().map(one).collect()
}

/// With semicolons between.
fn joined(parts: &[impl std::fmt::Display]) -> String {
    let parts: Vec<String> = parts.iter().map(ToString::to_string).collect();
    parts.join("; ")
}

/// Why the steps of a plan ended early.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Halt {
    /// The operator asked for it; nothing is under way.
    Stopped,
    /// The operator wants it to end now.
    Aborted,
    /// The operator wants the motors off, wherever the tip is.
    Halted,
    /// The operator wants to wait, off the skin. Ends no run: whoever commanded the motion catches it.
    PausedNow,
    /// Something failed.
    Fault(ControllerError),
}

impl<E: Into<ControllerError>> From<E> for Halt {
    fn from(e: E) -> Self {
        Self::Fault(e.into())
    }
}
