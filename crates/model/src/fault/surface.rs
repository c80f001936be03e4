//! Surfaces that are not where the frame puts them.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::press::TouchFault;
use crate::frame::Point2;
use crate::id::{RepetitionId, as_index};

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
