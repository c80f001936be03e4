//! What a check of a session found.

use crate::error::RecorderError;
use crate::rows::SessionTotals;

/// Problems that are told in full; more are only counted.
const TOLD: usize = 100;

/// What [`verify`](super::verify) found.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct VerifyReport {
    /// Whether the file has a seal. Without one, hashes over the whole were not checked.
    pub sealed: bool,
    /// What is wrong, in words: nothing for a sound session.
    pub problems: Vec<String>,
    /// Problems found beyond those told in `problems`.
    pub more_problems: u64,
    /// What is worth knowing and no problem, in words.
    pub remarks: Vec<String>,
    /// Counts and sizes, from the rows; `None` when they cannot be read.
    pub totals: Option<SessionTotals>,
    /// The first thing that the machine, not the file, kept from being read.
    pub(super) unread: Option<String>,
}

impl VerifyReport {
    /// True when nothing is wrong.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.problems.is_empty()
    }

    pub(super) fn add(&mut self, problem: impl ToString) {
        if self.problems.len() < TOLD {
            self.problems.push(problem.to_string());
        } else {
            self.more_problems += 1;
        }
    }

    /// Keeps the value, or tells the error.
    pub(super) fn take<T>(&mut self, result: Result<T, RecorderError>) -> Option<T> {
        result.map_err(|e| self.add_error(e)).ok()
    }

    /// An error of the machine says nothing of the file.
    pub(super) fn add_error(&mut self, error: RecorderError) {
        if error.is_of_the_machine() {
            self.unread.get_or_insert(error.to_string());
        } else {
            self.add(error);
        }
    }

    pub(super) fn equal<T: PartialEq + std::fmt::Debug>(
        &mut self,
        what: &str,
        expected: &T,
        found: &T,
    ) {
        if expected != found {
            self.add(format!("{what}: expected {expected:?}, found {found:?}"));
        }
    }
}
