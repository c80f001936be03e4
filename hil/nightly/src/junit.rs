//! A night as JUnit XML for CI servers: one test suite with one test case per check.
//!
//! FAIL and INCONCLUSIVE become `failure`, and SKIPPED becomes `skipped`. INVALID, and failures caused by the computer or by skinrig,
//! become `error`. The type of each is the rule that decided; the property `verdict` tells INCONCLUSIVE from FAIL and MARGINAL from PASS.

use std::fmt::Write as _;
use std::time::Duration;

pub use quick_junit::SerializeError;
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};
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
    /// `error`: the test could not reach a verdict.
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
///
/// # Errors
/// [`SerializeError`] when writing fails; no known input causes this.
pub fn junit(night: &Night, host: &str) -> Result<String, SerializeError> {
    let took = duration(night.took_s);
    let mut suite = TestSuite::new(printable(&night.suite));
    suite.set_time(took);
    // JUnit readers expect timestamps without a time zone; ours are UTC.
    let at = night.started.trim_end_matches('Z');
    for (name, value) in [("timestamp", at), ("hostname", host)] {
        suite.extra.insert(name.into(), printable(value).into());
    }
    add_properties(&mut suite, night);
    let cases = night.checks.iter().map(|check| test_case(night, check));
    suite.add_test_cases(cases);
    let mut report = Report::new(printable(&night.suite));
    report.set_time(took);
    report.add_test_suite(suite);
    report.to_string()
}

fn add_properties(suite: &mut TestSuite, night: &Night) {
    let mut add = |name: &str, value: &str| {
        suite.add_property((printable(name), printable(value)));
    };
    add("night", &night.id);
    add("verdict", night.verdict.name());
    add("rig", &night.rig);
    add("rig_kind", &night.rig_kind);
    add("suite_sha256", &night.suite_sha256);
    add("software", &night.versions.software);
    add("finished", if night.finished { "true" } else { "false" });
    for (device, version) in &night.versions.firmware {
        add(&format!("firmware {device}"), version);
    }
}

/// Type of a failure that no evidence explains.
const BROKEN_LIMIT: &str = "broken-limit";

fn test_case(night: &Night, check: &CheckResult) -> TestCase {
    let non_success = |kind: NonSuccessKind| {
        let mut status = TestCaseStatus::non_success(kind);
        status.set_type(check.rule.as_deref().unwrap_or(BROKEN_LIMIT));
        status.set_description(printable(&evidence_text(check)));
        status
    };
    let mut status = match Outcome::of(check.verdict, check.cause) {
        Outcome::Passed => TestCaseStatus::success(),
        Outcome::Skipped => TestCaseStatus::skipped(),
        Outcome::Failure => non_success(NonSuccessKind::Failure),
        Outcome::Error => non_success(NonSuccessKind::Error),
    };
    status.set_message(printable(&message(check)));
    let mut case = TestCase::new(printable(&check.name), status);
    case.set_classname(printable(&night.suite));
    case.set_time(duration(check.attempts.iter().map(|a| a.took_s).sum()));
    for (name, value) in kinds(check) {
        case.add_property((name, printable(&value).as_str()));
    }
    let values = values(check);
    if !values.is_empty() {
        case.set_system_out(printable(&values));
    }
    case
}

/// Verdict, cause, rule and evidence as kinds, for programs; the texts for people are in the message and in the description.
fn kinds(check: &CheckResult) -> Vec<(&'static str, String)> {
    let mut all = vec![("verdict", check.verdict.name().to_owned())];
    all.extend(check.cause.map(|cause| ("cause", cause.name().to_owned())));
    all.extend(check.rule.iter().map(|rule| ("rule", rule.clone())));
    for e in check.attempts.iter().flat_map(|a| &a.evidence) {
        let evidence = ("evidence", format!("{}: {}", e.subject, e.kind.name()));
        if !all.contains(&evidence) {
            all.push(evidence);
        }
    }
    all
}

/// Returns zero for negative and non-finite values.
fn duration(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
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

/// `text` with hidden characters spelled out, and without characters that XML 1.0 forbids.
fn printable(text: &str) -> String {
    let text = visible(text).replace('\t', " ");
    text.replace(['\u{fffe}', '\u{ffff}'], "\u{fffd}")
}
