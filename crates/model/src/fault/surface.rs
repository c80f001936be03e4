//! Touches that did not find the surface, and surfaces that are not where the frame puts them.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::motion::{NotArrived, point};
use crate::frame::{Point2, Point3, Skin};
use crate::id::{RepetitionId, as_index};
use crate::time::HostDuration;

/// Reason why a touch did not find the surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum TouchFault {
    /// The robot did not report forces.
    #[error("{during}: expected forces, found none")]
    NoForce {
        /// What needed them.
        during: TouchPhase,
    },
    /// The tare received too few forces.
    #[error("tare: expected forces for {0}, found fewer")]
    ShortTare(HostDuration),
    /// The motion down to the band did not arrive in time.
    #[error(transparent)]
    Late(NotArrived),
    /// The force did not rise within the band.
    #[error("expected the surface within {band_mm} mm of the frame's, found none down to {}", .lowest.as_ref().map_or_else(|| "an unknown height".to_owned(), point))]
    NotFound {
        /// Half width of the band, mm.
        band_mm: f64,
        /// Lowest tip position.
        lowest: Option<Point3<Skin>>,
    },
    /// The force rose immediately at the start of the search.
    #[error(
        "expected the surface within {band_mm} mm of the frame's, found contact immediately, at {height_mm:.3} mm"
    )]
    ImmediateContact {
        /// Half width of the band, mm.
        band_mm: f64,
        /// Height of the contact, mm.
        height_mm: f64,
    },
    /// A press from the touched surface would go below the floor.
    #[error(
        "expected a press of {depth_mm} mm to stay above the floor at -{max_depth_mm} mm, found the surface at {height_mm:.3} mm"
    )]
    TooLow {
        /// Depth of the press, mm.
        depth_mm: f64,
        /// Depth of the floor, mm, positive.
        max_depth_mm: f64,
        /// Height of the touched surface, mm.
        height_mm: f64,
    },
}

/// Phase of a touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TouchPhase {
    /// The mean force at clearance height.
    Tare,
    /// The slow motion down until contact.
    Search,
}

impl fmt::Display for TouchPhase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Tare => "tare",
            Self::Search => "search",
        })
    }
}

/// Result of the touch of a check point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceFinding {
    /// Height of the surface, skin frame, mm.
    HeightMm(f64),
    /// The surface was not found.
    NotFound(TouchFault),
}

impl fmt::Display for SurfaceFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::HeightMm(mm) => write!(f, "{mm:.3} mm"),
            Self::NotFound(fault) => fault.fmt(f),
        }
    }
}

/// A point of the surface check that failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfaceFault {
    /// The point, skin frame.
    pub at: Point2,
    /// Repetition before the check; `None` before the first press.
    #[serde(with = "as_index::option")]
    pub after: Option<RepetitionId>,
    /// Largest distance from z = 0, mm.
    pub tolerance_mm: f64,
    /// Result of the touch.
    pub found: SurfaceFinding,
}

impl SurfaceFault {
    /// Next step for the operator.
    pub const NEXT_STEP: &str = "check the mount and the skin, touch off again (`skinrig jog --rig FILE`: `touch`, `point NAME`), and enter \
                                 the points in the rig file";

    /// Name of the check.
    #[must_use]
    pub fn check(&self) -> String {
        let when = match self.after {
            None => "before the first press".to_owned(),
            Some(repetition) => format!("after {repetition}"),
        };
        format!("surface at ({}, {}) mm, {when}", self.at.x_mm, self.at.y_mm)
    }

    /// The expected height.
    #[must_use]
    pub fn expected(&self) -> String {
        format!("0 +- {} mm", self.tolerance_mm)
    }
}

impl fmt::Display for SurfaceFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: expected {}, found {}",
            self.check(),
            self.expected(),
            self.found
        )
    }
}
