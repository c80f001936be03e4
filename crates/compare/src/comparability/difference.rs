//! One difference between skins, and how severe it is.

use serde::{Deserialize, Serialize};

/// Consequence of a difference for the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Prevents the comparison unless overridden.
    Blocking,
    /// May explain the result.
    Confounding,
    /// Does not affect the result.
    Harmless,
}

impl Severity {
    /// `blocking`, `confounding` or `harmless`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Blocking => "blocking",
            Self::Confounding => "confounding",
            Self::Harmless => "harmless",
        }
    }
}

/// A fact with different values among the skins.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Key of the rule; `--despite` takes it to override a blocking difference.
    pub key: &'static str,
    /// Label of the fact.
    pub what: String,
    /// Path of the fact; `None` for what is not a single fact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fact: Option<String>,
    /// Value per skin.
    pub values: Vec<String>,
    /// Severity of the difference.
    #[serde(rename = "weight")]
    pub severity: Severity,
    /// Why it has this severity.
    pub reason: String,
    /// What the user can do about a blocking difference.
    pub next: Option<String>,
    /// True if nothing would be left to compare, whatever the user decides.
    #[serde(skip)]
    pub is_final: bool,
    /// True for a blocking difference that the user has overridden.
    #[serde(rename = "lifted")]
    pub overridden: bool,
}

/// A difference without a next step.
pub(super) fn difference(
    key: &'static str,
    what: &str,
    severity: Severity,
    values: Vec<String>,
    reason: &str,
) -> Difference {
    Difference {
        key,
        what: what.to_owned(),
        fact: None,
        values,
        severity,
        reason: reason.to_owned(),
        next: None,
        is_final: false,
        overridden: false,
    }
}

/// The difference as one that blocks, with the next step.
pub(super) fn as_blocking(mut difference: Difference, next: &str) -> Difference {
    difference.severity = Severity::Blocking;
    difference.next = Some(next.to_owned());
    difference
}
