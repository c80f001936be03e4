//! The rules by which a press does not count: kinds without a press's numbers, so that presses can be grouped.

use serde::Serialize;
use skinrig_model::{
    CameraId, ExcludedReason, InvalidReason, MissedReason, PressFault, PressFaultKind,
    SelectionReason,
};

/// Why a press does not count, without the press's numbers. Programs decide by it, and the results hash covers it.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// Verdict of the journal.
    Journal(JournalRule),
    /// The journal holds no measured times.
    NoTimes,
    /// The journal holds no measured position.
    NoPosition,
    /// This camera's clock could not be aligned.
    NoClock(CameraId),
    /// This camera lost bytes in the press window.
    DataLost(CameraId),
    /// The alignment of this camera's clock does not reach the press.
    NotTimed(CameraId),
    /// No cluster of events in this camera.
    NoCluster(CameraId),
    /// Fewer events in the cluster of this camera than the settings ask for.
    FewClusterEvents(CameraId),
    /// No more events in this camera than without a press.
    NoResponse(CameraId),
    /// A camera has no ray.
    NoView,
    /// The rays are parallel.
    ParallelRays,
    /// The rays meet at less than the smallest angle of the settings.
    NearlyParallelRays,
    /// The rays meet behind a camera.
    BehindCamera,
    /// The rays meet outside the skin's outline.
    OutsideOutline,
    /// Left out by hand.
    ByHand,
    /// Left out by a selection.
    BySelection(SelectionReason),
}

/// Entry of the journal for a press.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum JournalRule {
    /// The run ended before it, or the session holds no attempt.
    Missed,
    /// The program ended during the attempt.
    CutOff,
    /// The attempt has these faults, each with its camera if it is one of a camera.
    Faults(Vec<(PressFaultKind, Option<CameraId>)>),
    /// The data set does not use it.
    NotUsed,
    /// A session of an older schema has only this text; here without its numbers.
    Recorded(String),
}

impl JournalRule {
    pub(crate) fn missed(reason: &MissedReason) -> Self {
        match reason {
            MissedReason::RunEnded(_) | MissedReason::NeverAttempted => Self::Missed,
            MissedReason::Recorded { text } => Self::Recorded(without_numbers(text)),
        }
    }

    pub(crate) fn invalid(reason: &InvalidReason) -> Self {
        match reason {
            InvalidReason::LegEnded { .. } => Self::CutOff,
            InvalidReason::Faults(faults) => {
                let kinds = faults.iter().map(|f| (f.kind(), PressFault::camera(f)));
                Self::Faults(kinds.collect())
            }
            InvalidReason::Recorded { text, kinds, .. } if kinds.is_empty() => {
                Self::Recorded(without_numbers(text))
            }
            InvalidReason::Recorded { kinds, .. } => {
                Self::Faults(kinds.iter().map(|kind| (*kind, None)).collect())
            }
        }
    }

    pub(crate) fn excluded(reason: &ExcludedReason) -> Self {
        match reason {
            ExcludedReason::NotUsed { .. } => Self::NotUsed,
            ExcludedReason::Recorded { text } => Self::Recorded(without_numbers(text)),
        }
    }
}

impl Rule {
    /// True for a rule that excludes a press that was done as planned for what the cameras saw of it; false for what
    /// the journal or a hand left out, and for what cannot be judged.
    #[must_use]
    pub const fn is_on_data(&self) -> bool {
        match self {
            Self::NoCluster(_)
            | Self::FewClusterEvents(_)
            | Self::NoResponse(_)
            | Self::NoView
            | Self::ParallelRays
            | Self::NearlyParallelRays
            | Self::BehindCamera
            | Self::OutsideOutline => true,
            Self::Journal(_)
            | Self::NoTimes
            | Self::NoPosition
            | Self::NoClock(_)
            | Self::DataLost(_)
            | Self::NotTimed(_)
            | Self::ByHand
            | Self::BySelection(_) => false,
        }
    }

    /// True for a press that a person excluded, whatever its data.
    #[must_use]
    pub const fn is_by_hand(&self) -> bool {
        matches!(self, Self::ByHand | Self::BySelection(_))
    }
}

/// `text` with `…` for every number, except the number of a camera.
pub(crate) fn without_numbers(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        let (before, number) = rest.split_at(at);
        let end = number
            .find(|c: char| !(c.is_ascii_digit() || c == '.'))
            .unwrap_or(number.len());
        // A full stop or an ellipsis after the number is not part of it.
        let digits = number[..end].trim_end_matches('.');
        if before.ends_with("camera ") {
            out.push_str(before);
            out.push_str(digits);
        } else {
            // A minus sign goes with its number; a hyphen stays.
            let sign = before.strip_suffix('-');
            let sign = sign.filter(|b| b.chars().next_back().is_none_or(|c| !c.is_alphanumeric()));
            out.push_str(sign.unwrap_or(before));
            out.push('…');
        }
        rest = &number[digits.len()..];
    }
    out.push_str(rest);
    out
}
