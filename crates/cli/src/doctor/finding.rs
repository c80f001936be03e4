//! Findings of the doctor, one per check, as a table for people and as JSON for programs.

use std::fmt;

use serde::Serialize;
use skinrig_protocol::rig::RigFile;
use skinrig_text::{Column, LongWords, Paint, Style, hang, widest};

use crate::rig::bench::display_name;

/// Result of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) enum Verdict {
    /// As it should be.
    #[serde(rename = "ok")]
    Ok,
    /// The bench works but may fail during a long night.
    #[serde(rename = "warning")]
    Warning,
    /// The bench does not work.
    #[serde(rename = "problem")]
    Problem,
    /// The check was not possible; the finding states why.
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

    const fn style(self) -> Style {
        match self {
            Self::Ok => Style::Good,
            Self::Warning => Style::Warning,
            Self::Problem => Style::Error,
            Self::NotChecked => Style::Undecided,
        }
    }
}

/// One check and its result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Finding {
    /// `rig file`, `permissions`, `cables`, `USB speed`, `versions`, `disk`, `real time`, `power`, `clock`, `bench` or `notify`.
    pub area: &'static str,
    /// What was checked.
    pub check: String,
    /// Its result.
    pub verdict: Verdict,
    /// What was expected.
    pub expected: String,
    /// What was found, or why the check was not possible.
    pub found: String,
    /// What a measured figure means for recording: how long, how fast, with which margin.
    pub meaning: Option<String>,
    /// Next step, a command if there is one.
    pub next_step: Option<String>,
}

impl Finding {
    /// The finding with what its figure means.
    pub(super) fn means(self, meaning: impl Into<String>) -> Self {
        Self {
            meaning: Some(meaning.into()),
            ..self
        }
    }

    /// Found, and what it means.
    fn explained(&self) -> String {
        match &self.meaning {
            Some(meaning) => format!("{}: {meaning}", self.found),
            None => self.found.clone(),
        }
    }
}

/// A check without its result.
pub(super) struct Check {
    area: &'static str,
    check: String,
    expected: String,
}

/// Starts a check of `area`.
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
            meaning: None,
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

    /// Not checked, for the reason `why`.
    pub(crate) fn not_checked(self, why: impl fmt::Display) -> Finding {
        self.end(Verdict::NotChecked, why.to_string(), None)
    }

    /// Not checked, with the step that makes the check possible.
    pub(crate) fn not_checked_yet(
        self,
        why: impl Into<String>,
        next: impl Into<String>,
    ) -> Finding {
        self.end(Verdict::NotChecked, why, Some(next.into()))
    }
}

/// Number of findings with this verdict.
fn count(findings: &[Finding], verdict: Verdict) -> usize {
    findings.iter().filter(|f| f.verdict == verdict).count()
}

/// `1 problem`, `2 problems`.
fn counted(n: usize, what: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("{n} {what}{plural}")
}

/// The findings as JSON.
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

/// The findings as a table, by area. States what was expected only where a check did not pass.
pub(super) fn table(rig: Option<&RigFile>, findings: &[Finding], paint: Paint) -> String {
    let mut out = match rig {
        Some(rig) => format!("rig       {}\n", display_name(rig)),
        None => "rig       none (--rig FILE also checks against a rig file)\n".to_owned(),
    };
    let widest = widest(findings.iter().map(|f| f.check.as_str()));
    let mut area = "";
    for f in findings {
        if f.area != area {
            area = f.area;
            out += &format!("{}\n", paint.bold(area));
        }
        let verdict = Column::left(11).cell(f.verdict.name());
        let check = Column::left(widest).cell(&f.check);
        let head = format!("  {}  {check}  ", paint.apply(f.verdict.style(), &verdict));
        out += &hang(&head, &f.explained(), LongWords::Keep);
        if f.verdict != Verdict::Ok {
            out += &format!("{:15}expected: {}\n", "", f.expected);
        }
        if let Some(next) = &f.next_step {
            let label = paint.apply(Style::Help, "next:");
            out += &format!("{:15}{label} {next}\n", "");
        }
    }
    let total = |verdict| count(findings, verdict);
    out += &format!(
        "{} ok, {}, {}, {} not checked\n",
        total(Verdict::Ok),
        counted(total(Verdict::Warning), "warning"),
        counted(total(Verdict::Problem), "problem"),
        total(Verdict::NotChecked)
    );
    out
}
