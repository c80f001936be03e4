//! A session that is exported, and its tables.

use skinrig_analysis::{Analysis, LegStart};
use skinrig_model::{CameraId, RunHeader};
use skinrig_recorder::SessionReader;

/// A table of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableName {
    /// One row per press of the plan.
    Presses,
    /// One row per sample of the robot's path.
    Pose,
    /// One row per metric.
    Results,
    /// One row per CD event of a camera.
    Events(CameraId),
}

impl TableName {
    /// All of them, the small ones first.
    pub const ALL: [Self; 5] = [
        Self::Presses,
        Self::Results,
        Self::Pose,
        Self::Events(CameraId::One),
        Self::Events(CameraId::Two),
    ];

    /// Its name in files.
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

    /// Whether it tells what an analysis found.
    #[must_use]
    pub const fn needs_analysis(self) -> bool {
        matches!(self, Self::Presses | Self::Results)
    }
}

/// What is exported.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// The session.
    pub reader: &'a SessionReader,
    /// Its header.
    pub header: &'a RunHeader,
    /// What was found in it, and its further legs as the analysis moved them. Without it the columns of the presses that stand on
    /// an analysis are empty, and so is the table of results.
    pub analysis: Option<(&'a Analysis, &'a [LegStart])>,
}
