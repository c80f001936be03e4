//! Comparisons of a crate, printed as they are made.

use serde::Serialize;
use skinrig_recorder::Problem;

/// One comparison.
#[derive(Debug, Serialize)]
pub(super) struct Check {
    /// Subject of the comparison.
    what: String,
    pub pass: bool,
    expected: String,
    found: String,
}

impl Check {
    pub(super) fn pass(what: impl Into<String>, found: impl Into<String>) -> Self {
        let found = found.into();
        Self {
            what: what.into(),
            pass: true,
            expected: found.clone(),
            found,
        }
    }

    pub(super) fn fail(
        what: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        Self {
            what: what.into(),
            pass: false,
            expected: expected.into(),
            found: found.into(),
        }
    }

    fn print(&self) {
        if self.pass {
            outln!("PASS  {}: {}", self.what, self.found);
        } else {
            outln!(
                "FAIL  {}: expected {}, found {}",
                self.what,
                self.expected,
                self.found
            );
        }
    }
}

/// All comparisons.
#[derive(Debug, Default)]
pub(super) struct Checks {
    pub all: Vec<Check>,
    /// Prints nothing: the document follows.
    pub is_quiet: bool,
}

impl Checks {
    pub(super) fn add(&mut self, check: Check) {
        if !self.is_quiet {
            check.print();
        }
        self.all.push(check);
    }

    pub(super) fn fail(&mut self, problem: &Problem) {
        let Problem {
            place,
            expected,
            found,
        } = problem;
        self.add(Check::fail(&**place, &**expected, &**found));
    }

    pub(super) fn failed(&self) -> usize {
        self.all.iter().filter(|c| !c.pass).count()
    }
}
