//! Why a press does not count, with its numbers; its texts, and its fields in results.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use skinrig_model::{
    CameraId, ExcludedReason, InvalidReason, MissedReason, PressVerdict, SelectionReason,
};

use crate::rule::{JournalRule, Rule, without_numbers};
use crate::tie::UntimedPress;

/// Why a press does not count. Its text has the press's numbers; presses are grouped by its [`rule`](Self::rule).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Exclusion {
    /// Missed according to the journal.
    Missed(MissedReason),
    /// Invalid according to the journal.
    Invalid(InvalidReason),
    /// The journal excludes it.
    Excluded(ExcludedReason),
    /// The journal holds no measured times.
    NoTimes,
    /// The journal holds no measured position.
    NoPosition,
    /// This camera's clock could not be aligned.
    NoClock {
        /// The camera.
        camera: CameraId,
    },
    /// This camera lost bytes in the press window.
    DataLost {
        /// The camera.
        camera: CameraId,
    },
    /// The alignment of this camera's clock does not reach the press.
    NotTimed {
        /// The camera.
        camera: CameraId,
        /// The nearest tie of its clock.
        nearest: UntimedPress,
    },
    /// No cluster of events in this camera.
    NoCluster {
        /// The camera.
        camera: CameraId,
    },
    /// Fewer events in the cluster of this camera than the settings ask for.
    FewClusterEvents {
        /// The camera.
        camera: CameraId,
        /// Clustered events.
        found: u32,
        /// Least number.
        least: u32,
    },
    /// No more events in this camera than without a press.
    NoResponse {
        /// The camera.
        camera: CameraId,
        /// Events in the window.
        found: u32,
        /// Events expected without a press.
        expected: f64,
        /// Its standard error.
        standard_error: f64,
    },
    /// A camera has no ray.
    NoView,
    /// The rays are parallel.
    ParallelRays,
    /// The rays meet at less than the smallest angle of the settings.
    NearlyParallelRays {
        /// Sine of the angle, without sign.
        sine: f64,
        /// Least sine.
        least: f64,
    },
    /// The rays meet behind a camera.
    BehindCamera,
    /// The rays meet outside the skin's outline.
    OutsideOutline,
    /// Left out by hand.
    ByHand,
    /// Left out by a selection.
    BySelection(SelectionReason),
}

impl Exclusion {
    /// Exclusion by the journal; `None` for a valid attempt.
    #[must_use]
    pub fn of_journal(verdict: PressVerdict) -> Option<Self> {
        match verdict {
            PressVerdict::Valid => None,
            PressVerdict::Missed(reason) => Some(Self::Missed(reason)),
            PressVerdict::Invalid(reason) => Some(Self::Invalid(reason)),
            PressVerdict::Excluded(reason) => Some(Self::Excluded(reason)),
        }
    }

    /// The rule behind it: the kind without the press's numbers.
    #[must_use]
    pub fn rule(&self) -> Rule {
        match self {
            Self::Missed(reason) => Rule::Journal(JournalRule::missed(reason)),
            Self::Invalid(reason) => Rule::Journal(JournalRule::invalid(reason)),
            Self::Excluded(reason) => Rule::Journal(JournalRule::excluded(reason)),
            Self::NoTimes => Rule::NoTimes,
            Self::NoPosition => Rule::NoPosition,
            Self::NoClock { camera } => Rule::NoClock(*camera),
            Self::DataLost { camera } => Rule::DataLost(*camera),
            Self::NotTimed { camera, .. } => Rule::NotTimed(*camera),
            Self::NoCluster { camera } => Rule::NoCluster(*camera),
            Self::FewClusterEvents { camera, .. } => Rule::FewClusterEvents(*camera),
            Self::NoResponse { camera, .. } => Rule::NoResponse(*camera),
            Self::NoView => Rule::NoView,
            Self::ParallelRays => Rule::ParallelRays,
            Self::NearlyParallelRays { .. } => Rule::NearlyParallelRays,
            Self::BehindCamera => Rule::BehindCamera,
            Self::OutsideOutline => Rule::OutsideOutline,
            Self::ByHand => Rule::ByHand,
            Self::BySelection(why) => Rule::BySelection(why.clone()),
        }
    }

    /// Text of its rule, for a group of presses.
    #[must_use]
    pub fn label(&self) -> String {
        match self.rule() {
            Rule::Journal(_) => without_numbers(&self.to_string()),
            Rule::NoTimes => "no measured times".to_owned(),
            Rule::NoPosition => "no measured position".to_owned(),
            Rule::NoClock(camera) => format!("no clock alignment ({camera})"),
            Rule::DataLost(camera) => format!("data lost in window ({camera})"),
            Rule::NotTimed(camera) => format!("not timed ({camera})"),
            Rule::NoCluster(camera) => format!("no cluster ({camera})"),
            Rule::FewClusterEvents(camera) => format!("too few cluster events ({camera})"),
            Rule::NoResponse(camera) => format!("no response ({camera})"),
            Rule::NoView => "no view".to_owned(),
            Rule::ParallelRays => "parallel rays".to_owned(),
            Rule::NearlyParallelRays => "nearly parallel rays".to_owned(),
            Rule::BehindCamera => "behind camera".to_owned(),
            Rule::OutsideOutline => "outside the skin outline".to_owned(),
            Rule::ByHand => "by hand".to_owned(),
            Rule::BySelection(_) => self.to_string(),
        }
    }
}

impl fmt::Display for Exclusion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missed(reason) => reason.fmt(f),
            Self::Invalid(reason) => reason.fmt(f),
            Self::Excluded(reason) => reason.fmt(f),
            Self::NotTimed { camera, nearest } => write!(f, "not timed: {nearest} ({camera})"),
            Self::FewClusterEvents {
                camera,
                found,
                least,
            } => write!(f, "too few cluster events: {found} < {least} ({camera})"),
            Self::NoResponse {
                camera,
                found,
                expected,
                standard_error,
            } => write!(
                f,
                "no response: {found} events, {expected:.0} ± {standard_error:.0} expected at the idle rate ({camera})"
            ),
            Self::NearlyParallelRays { sine, least } => {
                write!(f, "nearly parallel rays: sine {sine:.4} < {least}")
            }
            Self::ByHand => f.write_str("left out by hand"),
            Self::BySelection(why) => write!(
                f,
                "excluded by the selection: {} ({})",
                why.reason, why.decided_by
            ),
            Self::NoTimes
            | Self::NoPosition
            | Self::NoClock { .. }
            | Self::DataLost { .. }
            | Self::NoCluster { .. }
            | Self::NoView
            | Self::ParallelRays
            | Self::BehindCamera
            | Self::OutsideOutline => f.write_str(&self.label()),
        }
    }
}

/// Fields of an exclusion in results: kind and fields for programs, and its two texts. Only `cause` is read back.
#[derive(Serialize)]
struct ExclusionFields<'a> {
    reason: Option<String>,
    rule: Option<String>,
    cause: Option<&'a Exclusion>,
}

#[derive(Deserialize)]
struct StoredExclusion {
    cause: Option<Exclusion>,
}

/// Writes the fields.
///
/// # Errors
/// Those of the serializer.
pub(crate) fn serialize<S: Serializer>(
    cause: &Option<Exclusion>,
    to: S,
) -> Result<S::Ok, S::Error> {
    let cause = cause.as_ref();
    let written = ExclusionFields {
        reason: cause.map(Exclusion::to_string),
        rule: cause.map(Exclusion::label),
        cause,
    };
    written.serialize(to)
}

/// Reads the fields.
///
/// # Errors
/// Those of the deserializer.
pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
    from: D,
) -> Result<Option<Exclusion>, D::Error> {
    StoredExclusion::deserialize(from).map(|read| read.cause)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_have_the_numbers_and_labels_the_rule() {
        let camera = CameraId::Two;
        for (cause, text, label) in [
            (
                Exclusion::NearlyParallelRays {
                    sine: 0.0499,
                    least: 0.05,
                },
                "nearly parallel rays: sine 0.0499 < 0.05",
                "nearly parallel rays",
            ),
            (
                Exclusion::NoResponse {
                    camera,
                    found: 32,
                    expected: 10.0,
                    standard_error: 20f64.sqrt(),
                },
                "no response: 32 events, 10 ± 4 expected at the idle rate (camera 2)",
                "no response (camera 2)",
            ),
            (
                Exclusion::FewClusterEvents {
                    camera,
                    found: 19,
                    least: 20,
                },
                "too few cluster events: 19 < 20 (camera 2)",
                "too few cluster events (camera 2)",
            ),
            (Exclusion::ByHand, "left out by hand", "by hand"),
        ] {
            assert_eq!(
                (cause.to_string(), cause.label()),
                (text.to_owned(), label.to_owned())
            );
        }
    }

    #[test]
    fn a_label_of_the_journal_has_no_numbers_but_a_camera() {
        assert_eq!(
            without_numbers("settled -0.31 mm from plan, limit 0.10. Robot-3 lost: camera 2"),
            "settled … mm from plan, limit …. Robot-… lost: camera 2"
        );
        assert_eq!(
            without_numbers("the run was stopped"),
            "the run was stopped"
        );
    }
}
