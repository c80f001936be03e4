//! The rules by which a press does not count, as types; their names in results and on pages.

use std::fmt;

use serde::{Deserialize, Serialize};
use skinrig_model::CameraId;

/// Why a press does not count, without the press's numbers, so that presses can be grouped. Programs decide by it;
/// results hold its name.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "String", from = "String")]
pub enum Rule {
    /// The journal says so: its reason with every number but a camera's left out.
    Journal(String),
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
            | Self::ByHand => false,
        }
    }

    /// The rule of the journal behind `reason`.
    pub(crate) fn of_journal(reason: &str) -> Self {
        Self::Journal(without_numbers(reason))
    }

    /// Every rule but those of the journal.
    fn named() -> impl Iterator<Item = Self> {
        let of_a_camera = [
            Self::NoClock,
            Self::DataLost,
            Self::NotTimed,
            Self::NoCluster,
            Self::FewClusterEvents,
            Self::NoResponse,
        ];
        let others = [
            Self::NoTimes,
            Self::NoPosition,
            Self::NoView,
            Self::ParallelRays,
            Self::NearlyParallelRays,
            Self::BehindCamera,
            Self::OutsideOutline,
            Self::ByHand,
        ];
        let of_cameras = of_a_camera
            .into_iter()
            .flat_map(|rule| CameraId::ALL.map(rule));
        of_cameras.chain(others)
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Journal(rule) => f.write_str(rule),
            Self::NoTimes => f.write_str("no measured times"),
            Self::NoPosition => f.write_str("no measured position"),
            Self::NoClock(camera) => write!(f, "no clock alignment ({camera})"),
            Self::DataLost(camera) => write!(f, "data lost in window ({camera})"),
            Self::NotTimed(camera) => write!(f, "not timed ({camera})"),
            Self::NoCluster(camera) => write!(f, "no cluster ({camera})"),
            Self::FewClusterEvents(camera) => write!(f, "too few cluster events ({camera})"),
            Self::NoResponse(camera) => write!(f, "no response ({camera})"),
            Self::NoView => f.write_str("no view"),
            Self::ParallelRays => f.write_str("parallel rays"),
            Self::NearlyParallelRays => f.write_str("nearly parallel rays"),
            Self::BehindCamera => f.write_str("behind camera"),
            Self::OutsideOutline => f.write_str("outside the skin outline"),
            Self::ByHand => f.write_str("by hand"),
        }
    }
}

impl From<Rule> for String {
    fn from(rule: Rule) -> Self {
        rule.to_string()
    }
}

impl From<String> for Rule {
    /// The rule of this name; a name that no rule has comes from the journal.
    fn from(name: String) -> Self {
        let named = Self::named().find(|rule| rule.to_string() == name);
        named.unwrap_or(Self::Journal(name))
    }
}

/// `text` with `…` for every number, except the number of a camera.
fn without_numbers(text: &str) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_of_the_journal_has_no_numbers_but_a_camera() {
        assert_eq!(
            without_numbers("settled -0.31 mm from plan, limit 0.10. Robot-3 lost: camera 2"),
            "settled … mm from plan, limit …. Robot-… lost: camera 2"
        );
        assert_eq!(
            without_numbers("the run was stopped"),
            "the run was stopped"
        );
    }

    #[test]
    fn every_name_reads_back() {
        for rule in Rule::named().chain([Rule::of_journal("settled 0.3 mm from plan")]) {
            let json = serde_json::to_string(&rule).unwrap();
            assert_eq!(serde_json::from_str::<Rule>(&json).unwrap(), rule, "{json}");
        }
    }
}
