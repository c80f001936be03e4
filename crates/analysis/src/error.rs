//! What can keep an analysis from giving a result.

use skinrig_model::{CameraId, PressId};

/// Why there is no analysis. Everything else that goes wrong is a row, a count or a warning in the result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AnalysisError {
    /// The journal does not fit the plan.
    #[error(
        "expected one outcome slot per planned press ({planned}), found {outcomes}; the session's journal and plan do not belong together"
    )]
    JournalLength {
        /// Planned presses.
        planned: usize,
        /// Outcome slots.
        outcomes: usize,
    },
    /// An outcome stands in the row of another press.
    #[error("expected the outcome of {expected} in its row of the journal, found that of {found}")]
    JournalOrder {
        /// Press of the row.
        expected: PressId,
        /// Press that the outcome names.
        found: PressId,
    },
    /// A setting is out of its range.
    #[error("expected {expected} for the analysis setting `{name}`, found {found}")]
    Setting {
        /// Its name in the protocol.
        name: String,
        /// What is allowed.
        expected: String,
        /// What was given.
        found: String,
    },
    /// The rig's geometry cannot be used.
    #[error(
        "expected a camera within 1000 km of the origin and away from the point it aims at, with a lens that sees, found {found} for {camera}; check the rig description of the session"
    )]
    Geometry {
        /// Which camera.
        camera: CameraId,
        /// What was given.
        found: String,
    },
    /// The skin's outline is no outline.
    #[error(
        "expected a skin outline with sides above 0 mm and corners that fit into them, found {found}; check the rig description of the session"
    )]
    Outline {
        /// What was given.
        found: String,
    },
    /// The plan has a number that is none.
    #[error(
        "expected finite positions and depths in the plan, found {found} for {press}; check the session's plan"
    )]
    Plan {
        /// Which press.
        press: PressId,
        /// What was given.
        found: String,
    },
    /// The events of a camera could not be read to their end.
    #[error("{camera}: {message}")]
    Events {
        /// Which camera.
        camera: CameraId,
        /// What the source said.
        message: String,
    },
    /// An event lies off the sensor.
    #[error(
        "expected events within 640 x 480 px but for at most 1 %, found {events} of {of} outside ({camera}); the stream is another sensor's or was decoded with the wrong format: `skinrig inspect` shows its header"
    )]
    OffSensor {
        /// Which camera.
        camera: CameraId,
        /// Events outside the sensor.
        events: u64,
        /// Events in all.
        of: u64,
    },
    /// More events in the windows of presses than a counter holds, or than an estimator that needs them all may keep.
    #[error(
        "expected at most {most} events in the window of {press} and those that overlap it, found more ({camera}); shorten the press window or set `thinning`, both below `analysis` in the protocol"
    )]
    TooManyEvents {
        /// Which camera.
        camera: CameraId,
        /// The press.
        press: PressId,
        /// The most that there may be.
        most: usize,
    },
    /// The session is invalid: none of its numbers is to be used.
    #[error("the session is INVALID: {0}")]
    Invalid(String),
    /// No press can be located in any way.
    #[error(
        "expected scored presses with measured times in the clocks of both cameras, found none; `skinrig analyze` says what is missing"
    )]
    NothingToCompare,
}
