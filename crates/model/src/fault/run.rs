//! Faults that end a run.

use serde::{Deserialize, Serialize};

use super::causes::{Causes, joined};
use super::device::DeviceError;
use super::guard::GuardError;
use super::motion::NotArrived;
use super::press::PressFault;
use super::surface::SurfaceFault;
use super::suspension::Suspension;
use super::watchdog::WatchdogTrip;
use crate::id::CameraId;
use crate::preflight::PreflightCheck;
use crate::run_end::StopReason;
use crate::time::HostDuration;

/// Reason why a run cannot start or continue. Each of them ends the run safely.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum RunFault {
    /// A device failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The consumer of records failed.
    #[error(transparent)]
    #[serde(rename = "recorder")]
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
    #[error("surface check: {failed}; {}", SurfaceFault::NEXT_STEP)]
    Surface {
        /// Each failed point.
        failed: Causes<SurfaceFault>,
    },
    /// Too many consecutive presses were invalid.
    #[error(
        "invalid presses: expected fewer than {limit} in a row (`limits.max_consecutive_invalid`), found {limit}: {}",
        of_each_kind(faults)
    )]
    InvalidInARow {
        /// The limit, which was reached.
        limit: u32,
        /// The faults, each once.
        faults: Causes<PressFault>,
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
        camera: CameraId,
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
        camera: CameraId,
        /// Largest allowed deviation.
        limit: HostDuration,
        /// Deviation found.
        found: HostDuration,
    },
    /// A suspension lasted too long.
    #[error("{suspension}; expected it to be over within {limit}")]
    Suspended {
        /// The suspension.
        suspension: Suspension,
        /// Longest suspension.
        limit: HostDuration,
    },
    /// The operator stopped the run, and a fault followed or came before.
    #[error("{0}")]
    Stopped(StopReason),
    /// The controller itself failed, or the run was dropped before its end.
    #[error("internal error: {0}")]
    Internal(String),
    /// A session of an older schema has only this text.
    #[error("{text}")]
    Recorded {
        /// All causes.
        text: String,
    },
}

/// The sink of the records failed; the run must end safely.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum SinkFault {
    /// The record was rejected.
    #[error("recorder: {0}")]
    Rejected(String),
    /// The record was accepted but is delayed on its way to the disk: it may already be there, or arrive later.
    #[error("recorder: {0}")]
    Delayed(String),
}

/// Unsafe state of the robot at the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum NotAtRest {
    /// The tip may be in contact.
    #[error("the tip did not reach clearance height: check its position")]
    NotClear,
    /// The motors may be on.
    #[error("the robot did not confirm that it is disarmed: switch it off by hand")]
    NotDisarmed,
}

/// `1 check` or `2 checks`.
fn count(failed: &[PreflightCheck]) -> String {
    match failed.len() {
        1 => "1 check".to_owned(),
        n => format!("{n} checks"),
    }
}

/// The first fault of each kind and camera, and the number of others.
fn of_each_kind(faults: &Causes<PressFault>) -> String {
    let mut shown: Vec<&PressFault> = Vec::new();
    for fault in faults.iter() {
        let key = (fault.kind(), fault.camera());
        if shown.iter().all(|s| (s.kind(), s.camera()) != key) {
            shown.push(fault);
        }
    }
    let text = joined(&shown);
    match faults.as_slice().len() - shown.len() {
        0 => text,
        others => format!("{text}; and {others} more of these kinds"),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::HostTime;

    #[test]
    fn invalid_presses_in_a_row_name_each_kind_of_fault_once() {
        let late = |ms: i64| PressFault::DataLate {
            camera: CameraId::One,
            end: HostTime(ms * 1_000_000),
            waited: HostDuration::from_millis(1000),
            reached: None,
        };
        let silent = PressFault::NoData {
            camera: CameraId::One,
        };
        let mut faults = Causes::one(silent);
        faults.push(late(5000));
        faults.push(late(9000));
        let text = RunFault::InvalidInARow { limit: 3, faults }.to_string();
        assert!(
            text.contains("found 3: camera 1 sent no bytes; data late"),
            "{text}"
        );
        assert!(text.ends_with("; and 1 more of these kinds"), "{text}");
        assert!(!text.contains("9.0"), "{text}");
    }
}
