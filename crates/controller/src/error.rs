//! Reasons why a run ends before its plan does.

use skinrig_device::DeviceError;
use skinrig_model::{HostDuration, PreflightCheck};

use crate::not_arrived::NotArrived;
use crate::press_fault::PressFault;
use crate::sink::SinkFault;
use crate::watchdog::WatchdogTrip;

/// A motion rejected by the guard. The robot received no command, and its current motion continues.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GuardError {
    /// A coordinate or the speed is NaN or infinite.
    #[error("expected finite coordinates and speed, found {found}")]
    NotFinite {
        /// The requested target and speed.
        found: String,
    },
    /// The speed is not above zero or beyond the limit.
    #[error("expected a speed above 0 and at most {limit_mm_s} mm/s, found {found_mm_s} mm/s")]
    Speed {
        /// Largest allowed speed, mm/s.
        limit_mm_s: f64,
        /// Requested speed, mm/s.
        found_mm_s: f64,
    },
    /// The target lies outside the workspace.
    #[error("expected a target with {axis} from {min_mm} to {max_mm} mm, found {found_mm} mm")]
    Workspace {
        /// `x`, `y` or `z` of the skin frame.
        axis: char,
        /// Lower limit, mm.
        min_mm: f64,
        /// Upper limit, mm.
        max_mm: f64,
        /// Requested coordinate, mm.
        found_mm: f64,
    },
    /// The target is too deep.
    #[error("expected a depth of at most {limit_mm} mm, found {found_mm} mm")]
    Depth {
        /// Largest allowed depth, mm, positive.
        limit_mm: f64,
        /// Requested depth, mm, positive.
        found_mm: f64,
    },
    /// The target is too far below the surface of the rig's frame.
    #[error("expected at most {limit_mm} mm below the frame's surface, found {found_mm:.3} mm")]
    Floor {
        /// Largest allowed depth, mm, positive.
        limit_mm: f64,
        /// Requested depth, mm, positive.
        found_mm: f64,
    },
    /// Lateral motion below clearance height.
    #[error(
        "expected lateral motion only at {clearance_mm} mm or higher, found {lateral_mm:.3} mm sideways at {height_mm:.3} mm"
    )]
    Lateral {
        /// Clearance height, mm.
        clearance_mm: f64,
        /// Lateral distance, mm.
        lateral_mm: f64,
        /// Lower end of the motion, mm.
        height_mm: f64,
    },
    /// A target below clearance height and beside the skin.
    #[error(
        "expected a target inside the skin's outline below clearance height, found it {outside_mm:.3} mm outside at {height_mm:.3} mm"
    )]
    Outline {
        /// Smallest distance from the outline, mm.
        outside_mm: f64,
        /// Height of the target, mm.
        height_mm: f64,
    },
    /// The straight path to the target passes too close to an obstacle.
    #[error(
        "expected a straight path more than {margin_mm} mm from `{name}`, found {found_mm:.3} mm"
    )]
    KeepOut {
        /// Name of the obstacle.
        name: String,
        /// Required distance, mm.
        margin_mm: f64,
        /// Distance of the path, mm.
        found_mm: f64,
    },
    /// The position of the robot is not known well enough to move.
    #[error("expected a pose sample no older than {limit}, found {found}")]
    StalePose {
        /// Longest allowed age.
        limit: HostDuration,
        /// Age of the newest sample, or `none`.
        found: String,
    },
    /// The watchdog tripped: only straight upward motion is allowed.
    #[error(
        "expected a motion straight up after the watchdog tripped ({reason}), found another motion"
    )]
    Tripped {
        /// Reason of the trip.
        reason: String,
    },
    /// The robot is not armed.
    #[error("expected an armed robot, found it disarmed")]
    NotArmed,
}

/// Reason why a run cannot start or continue. Each of them ends the run safely.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ControllerError {
    /// A device failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The consumer of records failed.
    #[error(transparent)]
    Sink(#[from] SinkFault),
    /// The guard rejected a motion before the robot received it.
    #[error("motion refused: {0}")]
    Guard(#[from] GuardError),
    /// This controller cannot execute the plan.
    #[error("plan, {place}: expected {expected}, found {found}; compile the plan again")]
    Plan {
        /// Location in the plan.
        place: String,
        /// What is valid there.
        expected: String,
        /// What was found.
        found: String,
    },
    /// The rig does not fit the plan or its header.
    #[error("rig, {place}: expected {expected}, found {found}")]
    Rig {
        /// Part of the rig.
        place: String,
        /// What the run needs.
        expected: String,
        /// What was found.
        found: String,
    },
    /// The surface of the skin is not where the frame puts it; no press was made since the last check.
    #[error("surface check: {}; {next}", .failed.join("; "))]
    Surface {
        /// Each failed point with location, expected and found. Not empty.
        failed: Vec<String>,
        /// Next step for the operator.
        next: &'static str,
    },
    /// Too many consecutive presses were invalid.
    #[error("invalid presses: expected fewer than {limit} in a row (`limits.max_consecutive_invalid`), found {limit}: {}", joined(.faults))]
    InvalidInARow {
        /// The limit, which was reached.
        limit: u32,
        /// The faults, each once. Not empty.
        faults: Vec<PressFault>,
    },
    /// A preflight check failed; nothing was powered.
    #[error("preflight: {} failed: {}", count(.failed), joined(&descriptions(.failed)))]
    Preflight {
        /// Each failed check. Not empty.
        failed: Vec<PreflightCheck>,
    },
    /// The pose stream did not start, or lacks required data.
    #[error("pose stream: expected {expected}, found {found}")]
    PoseStream {
        /// What the stream must contain.
        expected: String,
        /// What arrived.
        found: String,
    },
    /// A motion did not reach its target.
    #[error(transparent)]
    NotArrived(#[from] NotArrived),
    /// A measured limit was exceeded.
    #[error(transparent)]
    Watchdog(#[from] WatchdogTrip),
    /// A camera's chunks are not consecutive.
    #[error("{camera}: expected chunk {expected}, found chunk {found}")]
    ChunkOrder {
        /// Camera of the chunks.
        camera: skinrig_model::CameraId,
        /// Expected chunk number.
        expected: u64,
        /// Received chunk number.
        found: u64,
    },
    /// The robot did not come to rest properly at the end of the session.
    #[error(transparent)]
    NotAtRest(#[from] NotAtRest),
    /// The operator switched the motors off.
    #[error("operator: halt; the motors are off and the tip stayed where it was")]
    Halted,
    /// A camera's clock jumped forward.
    #[error(
        "{camera}: expected its time to follow the host's within {limit}, found a forward jump of {found}; \
         resume the session: a further leg has its own clock"
    )]
    ClockStep {
        /// Camera with the jump.
        camera: skinrig_model::CameraId,
        /// Largest allowed deviation.
        limit: HostDuration,
        /// Deviation found.
        found: HostDuration,
    },
    /// A suspension lasted too long.
    #[error("{reason}; expected it to be over within {limit}")]
    Suspended {
        /// Reason of the suspension.
        reason: String,
        /// Longest suspension.
        limit: HostDuration,
    },
    /// The controller itself failed, or the run was dropped before its end.
    #[error("internal error: {0}")]
    Internal(String),
}

/// Unsafe state of the robot at the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotAtRest {
    /// The tip may be in contact.
    #[error("the tip did not reach clearance height: check its position")]
    NotClear,
    /// The motors may be on.
    #[error("the robot did not confirm that it is disarmed: switch it off by hand")]
    NotDisarmed,
}

/// A problem besides the cause of a run's end, mostly while bringing the robot to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Failed operation of the run's end, for example `disarm`; empty if the error is clear without it.
    pub doing: &'static str,
    /// The failure.
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

/// Description of each failed check.
fn descriptions(failed: &[PreflightCheck]) -> Vec<String> {
    let one = |c: &PreflightCheck| {
        format!(
            "{}: expected {}, found {}; {}",
            c.check, c.expected, c.found, c.next_step
        )
    };
    failed.iter().map(one).collect()
}

/// Joins descriptions with semicolons.
fn joined(parts: &[impl std::fmt::Display]) -> String {
    let parts: Vec<String> = parts.iter().map(ToString::to_string).collect();
    parts.join("; ")
}

/// Reason why the steps of a plan end early.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Halt {
    /// The operator requested a stop; nothing is in progress.
    Stopped,
    /// The operator requested an abort.
    Aborted,
    /// The operator requested a halt: motors off, wherever the tip is.
    Halted,
    /// The operator requested an immediate pause off the skin. The code that commanded the motion handles it; the run continues.
    PausedNow,
    /// Something failed.
    Fault(ControllerError),
}

impl<E: Into<ControllerError>> From<E> for Halt {
    fn from(e: E) -> Self {
        Self::Fault(e.into())
    }
}
