//! Owns the input of an export: a session, and its tables.

use skinrig_analysis::{Analysis, LegStart};
use skinrig_model::{CameraId, RunHeader};
use skinrig_recorder::SessionReader;

/// A table of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableName {
    /// One row per press of the plan.
    Presses,
    /// One row per pose sample of the robot.
    Pose,
    /// One row per metric.
    Results,
    /// One row per CD event of a camera.
    Events(CameraId),
}

impl TableName {
    /// All tables, small ones first.
    pub const ALL: [Self; 5] = [
        Self::Presses,
        Self::Results,
        Self::Pose,
        Self::Events(CameraId::One),
        Self::Events(CameraId::Two),
    ];

    /// Name in file names.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Presses => "presses",
            Self::Pose => "pose",
            Self::Results => "results",
            Self::Events(CameraId::One) => "events_camera1",
            Self::Events(CameraId::Two) => "events_camera2",
        }
    }

    /// True if the table requires an analysis.
    #[must_use]
    pub const fn needs_analysis(self) -> bool {
        matches!(self, Self::Presses | Self::Results)
    }
}

/// Input of an export.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// The session.
    pub reader: &'a SessionReader,
    /// Its header.
    pub header: &'a RunHeader,
    /// Its analysis, and its later legs as aligned by the analysis. Without it, press columns that
    /// need an analysis are empty, and so is the table of results.
    pub analysis: Option<(&'a Analysis, &'a [LegStart])>,
}
