//! Result of a verification.

use std::fmt::{Debug, Display};

use crate::error::RecorderError;
use crate::problem::Problem;
use crate::rows::SessionTotals;

/// Most problems listed in full; further ones are only counted.
const MAX_LISTED: usize = 100;

/// Result of [`verify`](super::verify).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct VerifyReport {
    /// Whether the file has a seal. Without one, there are no hashes over the whole file to check.
    pub sealed: bool,
    /// Problems found; empty for a sound session.
    pub problems: Vec<Problem>,
    /// Number of problems beyond those in `problems`.
    pub more_problems: u64,
    /// Remarks that are not problems.
    pub remarks: Vec<String>,
    /// Counts and sizes computed from the rows; `None` if they cannot be read.
    pub totals: Option<SessionTotals>,
    /// First read failure caused by the system rather than by the file.
    pub(super) system_failure: Option<String>,
}

impl VerifyReport {
    /// True without problems.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.problems.is_empty()
    }

    pub(super) fn add(&mut self, problem: Problem) {
        if self.problems.len() < MAX_LISTED {
            self.problems.push(problem);
        } else {
            self.more_problems += 1;
        }
    }

    /// Adds what a later check found.
    pub(super) fn append(&mut self, later: Self) {
        self.more_problems += later.more_problems;
        for problem in later.problems {
            self.add(problem);
        }
        self.remarks.extend(later.remarks);
        self.sealed |= later.sealed;
        self.totals = self.totals.or(later.totals);
        self.system_failure = self.system_failure.take().or(later.system_failure);
    }

    /// The value, or `None` after adding the error to the report.
    pub(super) fn ok_or_add<T>(&mut self, result: Result<T, RecorderError>) -> Option<T> {
        result.map_err(|e| self.add_error(e)).ok()
    }

    /// Adds an error. A system failure is kept apart, because it is not a problem of the file.
    pub(super) fn add_error(&mut self, error: RecorderError) {
        if error.is_system_failure() {
            self.system_failure.get_or_insert(error.to_string());
        } else {
            self.add(error.into());
        }
    }

    /// Adds what differs from the expectation.
    pub(super) fn mismatch(
        &mut self,
        place: impl Display,
        expected: impl Display,
        found: impl Display,
    ) {
        self.add(Problem::new(place, expected, found));
    }

    pub(super) fn expect_equal<T: PartialEq + Debug>(
        &mut self,
        place: &str,
        expected: &T,
        found: &T,
    ) {
        if expected != found {
            self.mismatch(
                place,
                format_args!("{expected:?}"),
                format_args!("{found:?}"),
            );
        }
    }
}
