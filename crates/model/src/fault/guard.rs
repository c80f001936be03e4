//! Motions that the guard rejects.

use serde::{Deserialize, Serialize};

use super::watchdog::WatchdogTrip;
use crate::time::HostDuration;

/// A motion rejected by the guard. The robot received no command, and its current motion continues.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
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
        #[serde(with = "crate::number")]
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
        #[serde(with = "crate::number")]
        found_mm: f64,
    },
    /// The target is too deep.
    #[error("expected a depth of at most {limit_mm} mm, found {found_mm} mm")]
    Depth {
        /// Largest allowed depth, mm, positive.
        limit_mm: f64,
        /// Requested depth, mm, positive.
        #[serde(with = "crate::number")]
        found_mm: f64,
    },
    /// The target is too far below the surface of the rig's frame.
    #[error("expected at most {limit_mm} mm below the frame's surface, found {found_mm:.3} mm")]
    Floor {
        /// Largest allowed depth, mm, positive.
        limit_mm: f64,
        /// Requested depth, mm, positive.
        #[serde(with = "crate::number")]
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
        #[serde(with = "crate::number")]
        lateral_mm: f64,
        /// Lower end of the motion, mm.
        #[serde(with = "crate::number")]
        height_mm: f64,
    },
    /// A target below clearance height and beside the skin.
    #[error(
        "expected a target inside the skin's outline below clearance height, found it {outside_mm:.3} mm outside at {height_mm:.3} mm"
    )]
    Outline {
        /// Smallest distance from the outline, mm.
        #[serde(with = "crate::number")]
        outside_mm: f64,
        /// Height of the target, mm.
        #[serde(with = "crate::number")]
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
        #[serde(with = "crate::number")]
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
    #[error("expected a motion straight up after the watchdog tripped ({0}), found another motion")]
    Tripped(#[source] WatchdogTrip),
    /// The robot is not armed.
    #[error("expected an armed robot, found it disarmed")]
    NotArmed,
}
