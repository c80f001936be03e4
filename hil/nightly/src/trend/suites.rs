//! The suites whose nights a history or a catalogue has, and the choice of one of them.

use std::fmt;

use crate::night::Night;

/// A suite on one bench, with the number of its nights.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SuiteNights {
    /// Name of the bench.
    pub rig: String,
    /// `bench` or `emulated`.
    pub rig_kind: String,
    /// Name of the suite.
    pub suite: String,
    /// Number of nights.
    pub nights: usize,
    /// Start of the newest, RFC 3339, UTC.
    pub newest: String,
}

/// Selects the nights of a suite. Empty fields match any.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Filter {
    /// Name of the bench.
    pub rig: Option<String>,
    /// Name of the suite.
    pub suite: Option<String>,
    /// `bench` or `emulated`.
    pub rig_kind: Option<String>,
}

/// No suite matches: what was expected, and what there is.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, found {found}")]
pub struct NoSuchNights {
    /// The request.
    pub expected: String,
    /// The suites that there are.
    pub found: String,
}

impl SuiteNights {
    /// Whether the night is one of this suite on this bench.
    #[must_use]
    pub fn has(&self, night: &Night) -> bool {
        (&self.rig, &self.rig_kind, &self.suite) == (&night.rig, &night.rig_kind, &night.suite)
    }
}

impl fmt::Display for SuiteNights {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} on {}", self.suite, self.rig)
    }
}

impl Filter {
    /// Whether it selects this suite.
    #[must_use]
    pub fn matches(&self, suite: &SuiteNights) -> bool {
        let fits = |asked: &Option<String>, name: &String| asked.as_ref().is_none_or(|a| a == name);
        fits(&self.rig, &suite.rig)
            && fits(&self.suite, &suite.suite)
            && fits(&self.rig_kind, &suite.rig_kind)
    }

    /// Index of the first of `suites` that it selects. Nights of two benches, or of a bench and its emulation, are never judged together.
    ///
    /// # Errors
    /// [`NoSuchNights`] if it selects none.
    pub fn choose(&self, suites: &[SuiteNights]) -> Result<usize, NoSuchNights> {
        let found = suites.iter().position(|suite| self.matches(suite));
        found.ok_or_else(|| NoSuchNights {
            expected: format!(
                "nights of {} on {}",
                self.suite.as_deref().unwrap_or("any suite"),
                self.rig.as_deref().unwrap_or("any bench")
            ),
            found: match suites {
                [] => "no nights".to_owned(),
                all => {
                    let each: Vec<String> = all.iter().map(ToString::to_string).collect();
                    each.join(", ")
                }
            },
        })
    }
}
