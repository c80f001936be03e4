//! Owns the reasons of invalid presses and of stopped runs, and the text by which sessions store them.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Why an attempt at a press is invalid; stored as its text.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum InvalidReason {
    /// The program ended before the outcome: whether the robot pressed is unknown.
    LegEnded {
        /// Leg of the session that made the attempt.
        leg: u32,
    },
    /// The run ended during the attempt.
    RunEnded {
        /// The run's own reason, then further faults of the attempt, separated by `; `.
        reason: String,
    },
    /// The attempt has faults, whose kinds are in [`PressOutcome::faults`](crate::PressOutcome::faults), or the analysis
    /// cannot use it.
    Faults {
        /// The faults, separated by `; `.
        text: String,
    },
}

impl InvalidReason {
    /// Start of the text of an attempt that did not finish.
    pub const CUT_OFF: &'static str = "cut off: ";

    /// True if the attempt did not finish: the state of its press is unknown.
    #[must_use]
    pub const fn is_cut_off(&self) -> bool {
        matches!(self, Self::LegEnded { .. } | Self::RunEnded { .. })
    }

    /// The text; borrowed if it is stored as such.
    pub(crate) fn text(&self) -> std::borrow::Cow<'_, str> {
        match self {
            Self::Faults { text } => text.into(),
            _ => self.to_string().into(),
        }
    }
}

impl fmt::Display for InvalidReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LegEnded { leg } => write!(
                f,
                "{}leg {leg} of the session ended without its outcome",
                Self::CUT_OFF
            ),
            Self::RunEnded { reason } => write!(f, "{}{reason}", Self::CUT_OFF),
            Self::Faults { text } => f.write_str(text),
        }
    }
}

/// Reads a stored text; writing it again gives the same text.
impl From<String> for InvalidReason {
    fn from(text: String) -> Self {
        let Some(reason) = text.strip_prefix(Self::CUT_OFF) else {
            return Self::Faults { text };
        };
        let leg = reason.strip_prefix("leg ").and_then(|rest| {
            let number = rest.split(' ').next()?.parse().ok()?;
            Some(Self::LegEnded { leg: number }).filter(|found| found.to_string() == text)
        });
        leg.unwrap_or_else(|| Self::RunEnded {
            reason: reason.to_owned(),
        })
    }
}

impl From<InvalidReason> for String {
    fn from(reason: InvalidReason) -> Self {
        reason.text().into_owned()
    }
}

/// Why a run stopped without a fault; stored as its text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum StopReason {
    /// The operator stopped it after a press.
    Stop,
    /// The operator aborted it: the tip retracted immediately.
    Abort,
    /// The operator switched the motors off: the tip stayed in place.
    Halt,
    /// A reason recorded by another program.
    Other {
        /// Its text.
        text: String,
    },
}

impl StopReason {
    const OWN: [Self; 3] = [Self::Stop, Self::Abort, Self::Halt];

    /// The text, as stored and shown.
    #[must_use]
    pub fn text(&self) -> &str {
        match self {
            Self::Stop => "operator: stop",
            Self::Abort => "operator: abort",
            Self::Halt => {
                "operator: halt; the tip stayed where it was: check it before you power the robot again"
            }
            Self::Other { text } => text,
        }
    }
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

/// Reads a stored text; writing it again gives the same text.
impl From<String> for StopReason {
    fn from(text: String) -> Self {
        let own = Self::OWN.into_iter().find(|reason| reason.text() == text);
        own.unwrap_or(Self::Other { text })
    }
}

impl From<StopReason> for String {
    fn from(reason: StopReason) -> Self {
        reason.text().to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PressVerdict, RunEnd};
    use proptest::prelude::*;

    fn invalid(text: &str) -> InvalidReason {
        InvalidReason::from(text.to_owned())
    }

    #[test]
    fn stored_reasons_of_cut_off_attempts_are_recognised() {
        assert_eq!(
            invalid("cut off: leg 12 of the session ended without its outcome"),
            InvalidReason::LegEnded { leg: 12 }
        );
        for (text, is_cut_off) in [
            ("cut off: operator: abort; camera 1 sent no bytes", true),
            (
                "cut off: leg 012 of the session ended without its outcome",
                true,
            ),
            (
                "cut off: leg 1 of the session ended without its outcome; more",
                true,
            ),
            ("cut off: ", true),
            ("camera 1 lost 64 bytes; cut off: x", false),
            ("", false),
        ] {
            assert_eq!(invalid(text).is_cut_off(), is_cut_off, "{text}");
            assert!(
                !matches!(invalid(text), InvalidReason::LegEnded { .. }),
                "{text}"
            );
        }
    }

    #[test]
    fn stored_forms_of_verdicts_and_ends_are_unchanged() {
        for (verdict, text) in [
            (
                PressVerdict::cut_off(1),
                r#"{"verdict":"invalid","reason":"cut off: leg 1 of the session ended without its outcome"}"#,
            ),
            (
                PressVerdict::Invalid(invalid("camera 1 lost 64 bytes")),
                r#"{"verdict":"invalid","reason":"camera 1 lost 64 bytes"}"#,
            ),
        ] {
            assert_eq!(serde_json::to_string(&verdict).unwrap(), text);
            assert_eq!(serde_json::from_str::<PressVerdict>(text).unwrap(), verdict);
        }
        for (reason, words) in [
            (StopReason::Stop, "operator: stop"),
            (StopReason::Abort, "operator: abort"),
            (
                StopReason::Halt,
                "operator: halt; the tip stayed where it was: check it before you power the robot again",
            ),
        ] {
            let text = format!(r#"{{"status":"stopped","reason":"{words}"}}"#);
            let end = RunEnd::Stopped(reason);
            assert_eq!(serde_json::to_string(&end).unwrap(), text);
            assert_eq!(serde_json::from_str::<RunEnd>(&text).unwrap(), end);
        }
    }

    proptest! {
        #[test]
        fn every_stored_text_reads_back(
            text in "(cut off: ?)?(leg [0-9]{1,12})?( of the session ended without its outcome)?.{0,20}",
            stop in "(operator: )?(stop|abort|halt|.{0,9})",
        ) {
            prop_assert_eq!(invalid(&text).to_string(), text.clone());
            prop_assert_eq!(String::from(invalid(&text)), text);
            prop_assert_eq!(StopReason::from(stop.clone()).to_string(), stop);
        }
    }
}
