//! A problem of a session file: where it is, what was expected there and what was found.

use std::fmt::{self, Display};

use serde::Serialize;

/// Something in a session or bundle that is not as it was recorded. Does not repeat the path of the session or bundle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// Table and row, chunk, press, file of a bundle or a similar location.
    pub place: String,
    /// What is valid there.
    pub expected: String,
    /// What was found.
    pub found: String,
}

impl Problem {
    /// A problem from its parts.
    #[must_use]
    pub fn new(place: impl Display, expected: impl Display, found: impl Display) -> Self {
        Self {
            place: place.to_string(),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }
}

impl Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            place,
            expected,
            found,
        } = self;
        write!(f, "{place}: expected {expected}, found {found}")
    }
}
