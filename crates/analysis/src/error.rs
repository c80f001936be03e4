//! Owns the errors of an analysis.

use skinrig_model::{CameraId, PressId};

use crate::input::EventSourceError;
use crate::locator::LocatorModelError;
use crate::result::RemountPart;

/// Why a session cannot use the calibration of an earlier one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecalibrationError {
    /// The earlier session must not be used.
    #[error(
        "the earlier session is INVALID: {}\n  next: take the calibration from a valid session",
        .because.join("; ")
    )]
    EarlierInvalid {
        /// Why.
        because: Vec<String>,
    },
    /// The earlier session calibrated nothing.
    #[error(
        "expected a calibration in the earlier session, found only the nominal camera geometry\n  next: take the calibration \
         from a session whose protocol calibrates"
    )]
    EarlierUncalibrated,
    /// Too few presses correct it.
    #[error(
        "expected at least {needed} valid calibration presses to correct the earlier calibration, found {found}\n  next: add \
         calibrating locations to the protocol; five, spread over the skin, are enough"
    )]
    FewPresses {
        /// Required number.
        needed: usize,
        /// Number of the session.
        found: usize,
    },
    /// The skin moved further than a remount does.
    #[error(
        "expected a correction of at most {limit} standard deviations of a remount, found {sigmas:.1}: {part} {value:.2}\n  next: \
         calibrate in full, or describe your holder below `analysis.remount` in the protocol or with --set"
    )]
    TooLarge {
        /// The part of the move.
        part: RemountPart,
        /// Its value, mm or degrees.
        value: f64,
        /// The same in standard deviations.
        sigmas: f64,
        /// `analysis.remount.max_sigmas`.
        limit: f64,
    },
    /// No remount explains the presses.
    #[error(
        "the earlier calibration does not fit: no remount explains the {presses} calibration presses (chance {chance:.1e}, at least \
         {limit} expected)\n  next: calibrate in full; was another skin mounted, or a lens turned?"
    )]
    DoesNotFit {
        /// Probability of such a disagreement if it did.
        chance: f64,
        /// `analysis.remount.min_chance`.
        limit: f64,
        /// Presses that correct.
        presses: usize,
    },
    /// Numbers that are not finite.
    #[error("the calibration presses determine no correction\n  next: calibrate in full")]
    Degenerate,
}

/// Why there is no analysis. All other problems become rows, counts or warnings in the result.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// The journal does not fit the plan.
    #[error(
        "expected one outcome slot per planned press ({planned}), found {outcomes}; the session's journal does not match its plan"
    )]
    JournalLength {
        /// Planned presses.
        planned: usize,
        /// Outcome slots.
        outcomes: usize,
    },
    /// An outcome is in the row of another press.
    #[error("expected the outcome of {expected} in its journal row, found that of {found}")]
    JournalOrder {
        /// Press of the row.
        expected: PressId,
        /// Press that the outcome names.
        found: PressId,
    },
    /// A setting is out of its range.
    #[error("expected {expected} for the analysis setting `{name}`, found {found}")]
    Setting {
        /// Name in the protocol.
        name: String,
        /// Allowed values.
        expected: String,
        /// Given value.
        found: String,
    },
    /// The camera geometry is unusable.
    #[error(
        "expected a camera within 1000 km of the origin and away from the point it aims at, with a lens that sees, found {found} for {camera}; check the rig description of the session"
    )]
    Geometry {
        /// Camera.
        camera: CameraId,
        /// Given value.
        found: String,
    },
    /// The outline of the skin is invalid.
    #[error(
        "expected a skin outline with sides above 0 mm and corners that fit into them, found {found}; check the rig description of the session"
    )]
    Outline {
        /// What was given.
        found: String,
    },
    /// The plan contains NaN, infinity or an excessive value.
    #[error(
        "expected finite positions and depths in the plan, found {found} for {press}; check the session's plan"
    )]
    Plan {
        /// The press.
        press: PressId,
        /// What was given.
        found: String,
    },
    /// The events of a camera could not be read to the end.
    #[error("{camera}: {source}")]
    Events {
        /// Which camera.
        camera: CameraId,
        /// Error of the source.
        source: EventSourceError,
    },
    /// Too many events are off the sensor.
    #[error(
        "expected events within 640 x 480 px but for at most 1 %, found {events} of {of} outside ({camera}); the stream is from another sensor or was decoded in the wrong format; `skinrig inspect` shows its header"
    )]
    OffSensor {
        /// Which camera.
        camera: CameraId,
        /// Events outside the sensor.
        events: u64,
        /// All events.
        of: u64,
    },
    /// Press windows contain more events than a counter can hold, or than an estimator may cache.
    #[error(
        "expected at most {most} events in the window of {press} and those that overlap it, found more ({camera}); shorten the press window or set `thinning`, both below `analysis` in the protocol"
    )]
    TooManyEvents {
        /// Which camera.
        camera: CameraId,
        /// The press.
        press: PressId,
        /// The limit.
        most: usize,
    },
    /// The calibration of an earlier session cannot be used.
    #[error("--calibration-from: {0}")]
    Recalibration(#[from] RecalibrationError),
    /// What the locator learnt cannot be used.
    #[error("locator of the analysis: {0}; analyse the session again")]
    Locator(#[from] LocatorModelError),
    /// The session is invalid, and its numbers must not be used.
    #[error("the session is INVALID: {0}")]
    Invalid(String),
    /// No press can be located.
    #[error(
        "expected scored presses with measured times in the clocks of both cameras, found none; `skinrig analyze` lists what is missing"
    )]
    NothingToCompare,
}
