//! A night as JUnit XML, for programs that collect test results: one test suite, one test case per check.
//!
//! FAIL is a `failure`, INCONCLUSIVE a `failure` of its own type; INVALID, and whatever the computer or this program is at fault
//! for, an `error`; SKIPPED is `skipped`. MARGINAL passes, and says so in its output.

use std::fmt::Write as _;

use skinrig_model::text::visible;

use crate::cause::Cause;
use crate::night::{CheckResult, Night};
use crate::rules::{ACROSS, RULES};
use crate::verdict::Verdict;

/// How a check is told in JUnit's words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// A test case without a child.
    Passed,
    /// `failure`.
    Failure,
    /// `error`: the test could not tell.
    Error,
    /// `skipped`.
    Skipped,
}

impl Outcome {
    /// Of a check.
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

/// The night as a JUnit document. `host` is the computer's name.
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
    let name = escaped(&night.suite);
    // What reads JUnit knows dates without a zone; all of ours are UTC.
    let at = escaped(night.started.trim_end_matches('Z'));
    let host = escaped(host);
    push(
        &mut out,
        0,
        &format!("<testsuites name=\"{name}\" {counts}>"),
    );
    push(
        &mut out,
        1,
        &format!("<testsuite name=\"{name}\" {counts} timestamp=\"{at}\" hostname=\"{host}\">"),
    );
    properties(&mut out, night);
    for check in &night.checks {
        case(&mut out, night, check);
    }
    push(&mut out, 1, "</testsuite>");
    push(&mut out, 0, "</testsuites>");
    out
}

fn properties(out: &mut String, night: &Night) {
    push(out, 2, "<properties>");
    let mut property = |name: &str, value: &str| {
        let (name, value) = (escaped(name), escaped(value));
        push(
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
    push(out, 2, "</properties>");
}

fn case(out: &mut String, night: &Night, check: &CheckResult) {
    let took_s = check.attempts.iter().fold(0.0, |sum, a| sum + a.took_s);
    push(
        out,
        2,
        &format!(
            "<testcase name=\"{}\" classname=\"{}\" time=\"{took_s:.3}\">",
            escaped(&check.name),
            escaped(&night.suite)
        ),
    );
    let kind = check.verdict.name();
    let message = escaped(&message(check));
    match Outcome::of(check.verdict, check.cause) {
        Outcome::Passed => {}
        Outcome::Skipped => push(out, 3, &format!("<skipped message=\"{message}\"/>")),
        Outcome::Failure => child(out, "failure", kind, &message, check),
        Outcome::Error => child(out, "error", kind, &message, check),
    }
    let values = values(check);
    if !values.is_empty() {
        push(
            out,
            3,
            &format!("<system-out>{}</system-out>", escaped(&values)),
        );
    }
    push(out, 2, "</testcase>");
}

fn child(out: &mut String, tag: &str, kind: &str, message: &str, check: &CheckResult) {
    let text = escaped(&seen(check));
    push(
        out,
        3,
        &format!("<{tag} type=\"{kind}\" message=\"{message}\">{text}</{tag}>"),
    );
}

/// Why it is as it is, in one line.
fn message(check: &CheckResult) -> String {
    if let Some(reason) = &check.skipped {
        return reason.clone();
    }
    let cause = check.cause.map_or("", Cause::name);
    let all = RULES.iter().chain(ACROSS);
    let named = |rule: &String| all.clone().find(|r| r.name == rule).map(|r| r.reason);
    let reason = check.rule.as_ref().and_then(named);
    format!("{cause}: {}", reason.unwrap_or("a limit was broken"))
}

/// What was seen, and what to do next.
fn seen(check: &CheckResult) -> String {
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

/// Everything that was measured, a line each, every attempt.
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

fn push(out: &mut String, depth: usize, line: &str) {
    for _ in 0..depth {
        out.push_str("  ");
    }
    out.push_str(line);
    out.push('\n');
}

/// Text for an attribute or an element: what acts instead of showing is written out, other characters that XML 1.0 forbids are replaced.
fn escaped(text: &str) -> String {
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
