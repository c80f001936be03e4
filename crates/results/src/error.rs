//! Owns the reasons for which a session has no analysis.

use std::path::PathBuf;

use skinrig_analysis::AnalysisError;
use skinrig_online::ThresholdError;
use skinrig_protocol::Diagnostics;
use skinrig_recorder::RecorderError;
use skinrig_statistics::{ComparisonError, SampleFault};

use crate::earlier_mismatch::EarlierMismatch;

/// Why a session has no analysis.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The file cannot be read.
    #[error(transparent)]
    Session(#[from] RecorderError),
    /// The description of the rig in the session cannot be read.
    #[error(
        "{}: cannot read the rig description in the session: {source}\n  next: run `skinrig verify` to check the file \
         for damage",
        path.display()
    )]
    Rig {
        /// The session.
        path: PathBuf,
        /// Parse error.
        source: serde_json::Error,
    },
    /// An override of a value that a recorded session cannot change.
    #[error(
        "--set {given}: expected a key below `analysis.`; a recorded session's other values cannot change"
    )]
    NotOfTheAnalysis {
        /// The override.
        given: String,
    },
    /// An override with a key that only recordings of earlier versions may contain.
    #[error(
        "--set {given}: expected `analysis.exclude_press_numbers`, which counts presses from 1, found the key of earlier versions, \
         which counts from 0"
    )]
    OldKey {
        /// The override.
        given: String,
    },
    /// The session's protocol or schedule does not parse with the overrides.
    #[error("{0}")]
    Settings(Diagnostics),
    /// The calibration of an earlier session cannot be about this one.
    #[error("--calibration-from {}: {why}", path.display())]
    Earlier {
        /// The earlier session.
        path: PathBuf,
        /// Why not.
        why: EarlierMismatch,
    },
    /// A plan that declares looks cannot be read.
    #[error("cannot read the plan in the session: {0}")]
    Plan(serde_json::Error),
    /// Nothing could be learnt from the session.
    #[error(transparent)]
    NotLearnt(#[from] NotLearnt),
    /// A look at a campaign found nothing that may be used.
    #[error("no look {number}: {why}")]
    NoLook {
        /// Number of the look.
        number: u32,
        /// Why not.
        why: LookFault,
    },
    /// The analysis rejects its input.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
}

/// Why a look has no answer.
#[derive(Debug, thiserror::Error)]
pub enum LookFault {
    /// The numbers of the session must not be used.
    #[error("{0}")]
    Invalid(String),
    /// The plan declares none.
    #[error("the plan declares no looks")]
    NoneDeclared,
    /// The plan has others.
    #[error("the plan has no such look")]
    NotInPlan,
    /// The plan has no rule for it.
    #[error("the plan has no rule")]
    NoRule,
    /// Its number is beyond those of the rule.
    #[error("it is beyond the declared looks")]
    Beyond,
    /// The error of those that are easy to locate is not that of the skin.
    #[error(
        "expected at least half of the attempted scored presses to count, found {located} of {attempted}"
    )]
    FewLocated {
        /// Scored presses that count.
        located: usize,
        /// Scored presses attempted.
        attempted: usize,
    },
    /// The presses so far make no sample.
    #[error(transparent)]
    Sample(#[from] SampleFault),
    /// The sample has no interval.
    #[error(transparent)]
    Interval(#[from] ComparisonError),
}

/// Why nothing could be learnt from a session.
#[derive(Debug, thiserror::Error)]
pub enum NotLearnt {
    /// Clocks start again in each leg.
    #[error("expected a session recorded in one go, found {legs} legs")]
    Legs {
        /// Number of legs.
        legs: usize,
    },
    /// Its results must not be used.
    #[error("expected a valid session, found an INVALID one: {}", because.join("; "))]
    Invalid {
        /// Reasons, as the analysis states them.
        because: Vec<String>,
    },
    /// Its calibration presses are too few, or unreadable.
    #[error(transparent)]
    Presses(#[from] ThresholdError),
}
