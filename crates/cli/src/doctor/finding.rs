//! What the doctor says: one finding per check, as a table for people and as JSON for programs.

use std::fmt;

use serde::Serialize;
use skinrig_protocol::rig::RigFile;
use skinrig_text::{Column, Table, widest};

use crate::rig::bench::display_name;

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) enum Verdict {
    /// As it should be.
    #[serde(rename = "ok")]
    Ok,
    /// The bench works, and may fail in a long night.
    #[serde(rename = "warning")]
    Warning,
    /// The bench cannot work like this.
    #[serde(rename = "problem")]
    Problem,
    /// Nobody can tell; the finding says why.
    #[serde(rename = "not checked")]
    NotChecked,
}

impl Verdict {
    const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warning => "warning",
            Self::Problem => "problem",
            Self::NotChecked => "not checked",
        }
    }
}

/// One check and how it ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Finding {
    /// `rig file`, `permissions`, `cables`, `USB speed`, `versions`, `disk`, `real time`, `power`, `clock` or `bench`.
    pub area: &'static str,
    /// What was checked.
    pub check: String,
    /// How it ended.
    pub verdict: Verdict,
    /// What was expected.
    pub expected: String,
    /// What was found; of what was not checked, why.
    pub found: String,
    /// What to do next, a command where there is one.
    pub next_step: Option<String>,
}

/// A check that is still to end.
pub(super) struct Check {
    area: &'static str,
    check: String,
    expected: String,
}

/// A check of `area` that expects `expected`.
pub(super) fn check(
    area: &'static str,
    check: impl Into<String>,
    expected: impl Into<String>,
) -> Check {
    Check {
        area,
        check: check.into(),
        expected: expected.into(),
    }
}

impl Check {
    fn end(self, verdict: Verdict, found: impl Into<String>, next: Option<String>) -> Finding {
        Finding {
            area: self.area,
            check: self.check,
            verdict,
            expected: self.expected,
            found: found.into(),
            next_step: next,
        }
    }

    pub(super) fn ok(self, found: impl Into<String>) -> Finding {
        self.end(Verdict::Ok, found, None)
    }

    pub(super) fn warning(self, found: impl Into<String>, next: impl Into<String>) -> Finding {
        self.end(Verdict::Warning, found, Some(next.into()))
    }

    pub(super) fn problem(self, found: impl Into<String>, next: impl Into<String>) -> Finding {
        self.end(Verdict::Problem, found, Some(next.into()))
    }

    /// `why` takes the place of what was found.
    pub(crate) fn not_checked(self, why: impl fmt::Display) -> Finding {
        self.end(Verdict::NotChecked, why.to_string(), None)
    }

    /// Not checked, and what would let it be.
    pub(crate) fn not_checked_yet(
        self,
        why: impl Into<String>,
        next: impl Into<String>,
    ) -> Finding {
        self.end(Verdict::NotChecked, why, Some(next.into()))
    }
}

/// How many findings ended so.
fn count(findings: &[Finding], verdict: Verdict) -> usize {
    findings.iter().filter(|f| f.verdict == verdict).count()
}

/// For programs.
pub(super) fn json(rig: Option<&RigFile>, findings: &[Finding]) -> serde_json::Value {
    serde_json::json!({
        "rig": rig.map(|r| &r.name),
        "kind": rig.map(|r| r.kind.name()),
        "problems": count(findings, Verdict::Problem),
        "warnings": count(findings, Verdict::Warning),
        "not_checked": count(findings, Verdict::NotChecked),
        "findings": findings,
    })
}

/// For people: area by area; what was expected is told where something else was found.
pub(super) fn table(rig: Option<&RigFile>, findings: &[Finding]) -> String {
    let mut out = match rig {
        Some(rig) => format!("rig       {}\n", display_name(rig)),
        None => "rig       none (--rig FILE also checks what the file says)\n".to_owned(),
    };
    let widest = widest(findings.iter().map(|f| f.check.as_str()));
    let table = Table::new([Column::left(11), Column::left(widest)]).indent(2);
    let mut area = "";
    for f in findings {
        if f.area != area {
            area = f.area;
            out += &format!("{area}\n");
        }
        out += &table.row([f.verdict.name(), &f.check, &f.found]);
        out.push('\n');
        if f.verdict != Verdict::Ok {
            out += &format!("{:15}expected: {}\n", "", f.expected);
        }
        if let Some(next) = &f.next_step {
            out += &format!("{:15}next: {next}\n", "");
        }
    }
    let total = |verdict| count(findings, verdict);
    out += &format!(
        "{} ok, {} warnings, {} problems, {} not checked\n",
        total(Verdict::Ok),
        total(Verdict::Warning),
        total(Verdict::Problem),
        total(Verdict::NotChecked)
    );
    out
}
