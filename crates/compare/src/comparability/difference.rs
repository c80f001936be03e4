//! One thing in which skins differ, and what it is worth.

use serde::{Deserialize, Serialize};

/// What a difference is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weight {
    /// No comparison.
    Blocking,
    /// A comparison whose outcome this may explain.
    Confounding,
    /// Nothing.
    Harmless,
}

impl Weight {
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

/// One thing in which the skins differ.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Names the rule; what lifts a blocking one.
    pub key: &'static str,
    /// Which fact.
    pub what: String,
    /// Its value in each skin.
    pub values: Vec<String>,
    /// What it is worth.
    pub weight: Weight,
    /// Why.
    pub reason: String,
    /// What to do about a blocking one.
    pub next: Option<String>,
    /// True for a blocking one that the user has lifted.
    pub lifted: bool,
}

/// A difference of this weight, without a next step.
pub(super) fn difference(
    key: &'static str,
    what: &str,
    weight: Weight,
    values: Vec<String>,
    reason: &str,
) -> Difference {
    Difference {
        key,
        what: what.to_owned(),
        values,
        weight,
        reason: reason.to_owned(),
        next: None,
        lifted: false,
    }
}
