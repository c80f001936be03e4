//! A night as JUnit XML for CI servers: one test suite with one test case per check.
//!
//! FAIL becomes `failure`, INCONCLUSIVE becomes `failure` with its own type, and SKIPPED becomes `skipped`. INVALID, and failures
//! caused by the computer or by skinrig, become `error`. MARGINAL passes; its output shows it.

use std::fmt::Write as _;

use skinrig_model::text::visible;

use crate::cause::Cause;
use crate::night::{CheckResult, Night};
use crate::rules::{CROSS_CHECK_RULES, RULES};
use crate::verdict::Verdict;

/// JUnit outcome of a test case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// No child element.
    Passed,
    /// `failure`.
    Failure,
    /// `error`: the test could not decide.
    Error,
    /// `skipped`.
    Skipped,
}

impl Outcome {
    /// Outcome for a verdict and its cause.
    #[must_use]
    pub const fn of(verdict: Verdict, cause: Option<Cause>) -> Self {
        match (verdict, cause) {
            (Verdict::Skipped, _) => Self::Skipped,
            (Verdict::Pass | Verdict::Marginal, _) => Self::Passed,
            (Verdict::Inconclusive, _) => Self::Failure,
            (Verdict::Invalid, _)
            | (Verdict::Fail, Some(Cause::Infrastructure | Cause::Software)) => Self::Error,
            (Verdict::Fail, _) => Self::Failure,
        }
    }
}

/// Formats a night as a JUnit document. `host` is the computer's name.
#[must_use]
pub fn junit(night: &Night, host: &str) -> String {
    let count = |outcome: Outcome| {
        let of = |c: &&CheckResult| Outcome::of(c.verdict, c.cause) == outcome;
        night.checks.iter().filter(of).count()
    };
    let counts = format!(
        "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"{:.3}\"",
        night.checks.len(),
        count(Outcome::Failure),
        count(Outcome::Error),
        count(Outcome::Skipped),
        night.took_s.max(0.0)
    );
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let name = escape(&night.suite);
    // JUnit readers expect timestamps without a time zone; ours are UTC.
    let at = escape(night.started.trim_end_matches('Z'));
    let host = escape(host);
    push_line(
        &mut out,
        0,
        &format!("<testsuites name=\"{name}\" {counts}>"),
    );
    push_line(
        &mut out,
        1,
        &format!("<testsuite name=\"{name}\" {counts} timestamp=\"{at}\" hostname=\"{host}\">"),
    );
    properties(&mut out, night);
    for check in &night.checks {
        test_case(&mut out, night, check);
    }
    push_line(&mut out, 1, "</testsuite>");
    push_line(&mut out, 0, "</testsuites>");
    out
}

fn properties(out: &mut String, night: &Night) {
    push_line(out, 2, "<properties>");
    let mut property = |name: &str, value: &str| {
        let (name, value) = (escape(name), escape(value));
        push_line(
            out,
            3,
            &format!("<property name=\"{name}\" value=\"{value}\"/>"),
        );
    };
    property("night", &night.id);
    property("verdict", night.verdict.name());
    property("rig", &night.rig);
    property("rig_kind", &night.rig_kind);
    property("suite_sha256", &night.suite_sha256);
    property("software", &night.versions.software);
    property("finished", if night.finished { "true" } else { "false" });
    for (device, version) in &night.versions.firmware {
        property(&format!("firmware {device}"), version);
    }
    push_line(out, 2, "</properties>");
}

fn test_case(out: &mut String, night: &Night, check: &CheckResult) {
    let took_s = check.attempts.iter().fold(0.0, |sum, a| sum + a.took_s);
    push_line(
        out,
        2,
        &format!(
            "<testcase name=\"{}\" classname=\"{}\" time=\"{took_s:.3}\">",
            escape(&check.name),
            escape(&night.suite)
        ),
    );
    let kind = check.verdict.name();
    let message = escape(&message(check));
    match Outcome::of(check.verdict, check.cause) {
        Outcome::Passed => {}
        Outcome::Skipped => push_line(out, 3, &format!("<skipped message=\"{message}\"/>")),
        Outcome::Failure => failure(out, "failure", kind, &message, check),
        Outcome::Error => failure(out, "error", kind, &message, check),
    }
    let values = values(check);
    if !values.is_empty() {
        push_line(
            out,
            3,
            &format!("<system-out>{}</system-out>", escape(&values)),
        );
    }
    push_line(out, 2, "</testcase>");
}

fn failure(out: &mut String, tag: &str, kind: &str, message: &str, check: &CheckResult) {
    let text = escape(&evidence_text(check));
    push_line(
        out,
        3,
        &format!("<{tag} type=\"{kind}\" message=\"{message}\">{text}</{tag}>"),
    );
}

/// One-line reason of the verdict.
fn message(check: &CheckResult) -> String {
    if let Some(reason) = &check.skipped {
        return reason.clone();
    }
    let cause = check.cause.map_or("", Cause::name);
    let all = RULES.iter().chain(CROSS_CHECK_RULES);
    let named = |rule: &String| all.clone().find(|r| r.name == rule).map(|r| r.reason);
    let reason = check.rule.as_ref().and_then(named);
    format!("{cause}: {}", reason.unwrap_or("a limit was broken"))
}

/// Evidence and next steps.
fn evidence_text(check: &CheckResult) -> String {
    let mut text = String::new();
    for e in check.attempts.iter().flat_map(|a| &a.evidence) {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}: {}: {}", e.subject, e.kind.name(), e.what);
        if let Some(next) = &e.next {
            let _ = writeln!(text, "next: {next}");
        }
    }
    text
}

/// All measurements of all attempts, one per line.
fn values(check: &CheckResult) -> String {
    let mut text = String::new();
    for (number, attempt) in (1..).zip(&check.attempts) {
        if check.attempts.len() > 1 {
            let _ = writeln!(text, "attempt {number}: {}", attempt.verdict.name());
        }
        for part in &attempt.parts {
            for m in &part.measurements {
                let value = m.value.map_or("not measured".to_owned(), |v| v.to_string());
                let _ = write!(text, "{} {} {value} {}", part.subject, m.metric, m.unit);
                if let Some(limit) = &m.limit {
                    let bound = |name: &str, v: Option<f64>| {
                        v.map_or(String::new(), |v| format!(" {name} {v}"))
                    };
                    let (least, most) = (
                        bound("at_least", limit.at_least),
                        bound("at_most", limit.at_most),
                    );
                    let _ = write!(text, " ({}{least}{most})", m.verdict.name());
                }
                text.push('\n');
            }
        }
    }
    if let Some(repeats) = &check.repeats {
        let _ = writeln!(text, "{repeats}");
    }
    text
}

fn push_line(out: &mut String, depth: usize, line: &str) {
    for _ in 0..depth {
        out.push_str("  ");
    }
    out.push_str(line);
    out.push('\n');
}

/// Escapes text for XML. Replaces characters that XML 1.0 forbids.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in visible(text).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' => out.push(c),
            '\u{fffe}' | '\u{ffff}' => {
                out.push(char::REPLACEMENT_CHARACTER);
            }
            c => out.push(c),
        }
    }
    out
}
