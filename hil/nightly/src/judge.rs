//! Verdicts: from measurements and evidence to an attempt, and from repeated attempts to a check.

use crate::cause::Cause;
use crate::evidence::Evidence;
use crate::night::{Attempt, CheckResult, Part};
use crate::rules::{Case, RuleResult, apply_rules};
use crate::verdict::Verdict;

/// The computer takes part in every check, so evidence about it concerns every device.
const COMPUTER: &str = "computer";

/// Judges an attempt. `default_cause` applies to a broken limit without evidence.
///
/// Each part is judged separately, so that evidence about one camera does not excuse the other. A
/// part considers evidence about its own subject, about the computer, and about subjects that have
/// no part (a check of the skin relies on all devices). A part with neither a broken limit nor
/// evidence of its own considers all evidence: its measurement may have needed the other devices.
#[must_use]
pub fn judge_attempt(
    (began_s, took_s): (f64, f64),
    parts: Vec<Part>,
    evidence: Vec<Evidence>,
    default_cause: Cause,
) -> Attempt {
    let worst = parts
        .iter()
        .map(|part| judge_part(part, &parts, &evidence, default_cause))
        .max_by_key(severity)
        .unwrap_or_else(|| judge_empty(&evidence, default_cause));
    Attempt {
        began_s,
        took_s,
        verdict: worst.verdict,
        cause: worst.cause,
        rule: worst.rule.map(str::to_owned),
        parts,
        evidence,
    }
}

/// Sort key. Of two equally severe rulings, the one that does not blame the computer wins, so that
/// other faults stay visible.
fn severity(ruling: &RuleResult) -> (Verdict, bool) {
    (ruling.verdict, ruling.cause != Some(Cause::Infrastructure))
}

/// Verdict of each part of an attempt at `check`, after the rules: INVALID for a device at fault, and that of the check for all parts
/// if other checks made it INVALID or INCONCLUSIVE.
#[must_use]
pub fn part_verdicts(check: &CheckResult, attempt: &Attempt) -> Vec<Verdict> {
    let by_others = match check.verdict {
        Verdict::Invalid => attempt.verdict != Verdict::Invalid,
        Verdict::Inconclusive => attempt.verdict.is_good() && !check.witnesses.is_empty(),
        _ => false,
    };
    let parts = attempt.parts.iter();
    let judged = parts.map(|part| {
        // The cause plays no part in it.
        let ruling = judge_part(part, &attempt.parts, &attempt.evidence, Cause::Rig);
        let own = part.verdict.max(ruling.verdict);
        if by_others { check.verdict } else { own }
    });
    judged.collect()
}

fn judge_part(
    part: &Part,
    parts: &[Part],
    evidence: &[Evidence],
    default_cause: Cause,
) -> RuleResult {
    let concerns = |e: &&Evidence| {
        e.subject == part.subject
            || e.subject == COMPUTER
            || !parts.iter().any(|p| p.subject == e.subject)
    };
    let mut relevant: Vec<&Evidence> = evidence.iter().filter(concerns).collect();
    if relevant.is_empty() && !part.exceeds_limit() {
        relevant = evidence.iter().collect();
    }
    apply_rules(&Case {
        verdict: part.verdict,
        exceeds_limit: part.exceeds_limit(),
        default_cause,
        evidence: &relevant,
    })
}

/// Judges an attempt without parts.
fn judge_empty(evidence: &[Evidence], default_cause: Cause) -> RuleResult {
    let all: Vec<&Evidence> = evidence.iter().collect();
    apply_rules(&Case {
        verdict: Verdict::worst([]),
        exceeds_limit: false,
        default_cause,
        evidence: &all,
    })
}

/// How often a failed check is repeated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RepeatRule {
    /// Maximum number of repeats.
    pub at_most: u32,
    /// Consecutive passes required after a failure.
    pub must_pass: u32,
}

impl RepeatRule {
    /// No repeats.
    pub const NEVER: Self = Self {
        at_most: 0,
        must_pass: 1,
    };

    /// Whether another attempt could change the verdict.
    #[must_use]
    pub fn should_repeat(&self, attempts: &[Attempt]) -> bool {
        let left = self.at_most.saturating_sub(repeats(attempts));
        let failed = attempts.iter().any(|a| !a.verdict.is_good());
        let passes = trailing_passes(attempts);
        failed && passes < self.must_pass && passes + left >= self.must_pass && left > 0
    }

    /// Combines the attempts. Without a failure the verdict of the only attempt stands. After a failure the worst verdict stands, or
    /// MARGINAL after enough consecutive passes; never PASS. The explanation is present for repeated checks.
    #[must_use]
    pub fn combine(&self, attempts: &[Attempt]) -> CombinedVerdict {
        let severity = |a: &&Attempt| (a.verdict, a.cause != Some(Cause::Infrastructure));
        let Some(worst) = attempts.iter().max_by_key(severity) else {
            return CombinedVerdict {
                verdict: Verdict::worst([]),
                cause: None,
                rule: None,
                explanation: None,
            };
        };
        let passes = trailing_passes(attempts);
        let repeated = repeats(attempts);
        if worst.verdict.is_good() || (repeated > 0 && passes >= self.must_pass) {
            let is_repeated = repeated > 0 && !worst.verdict.is_good();
            return CombinedVerdict {
                verdict: if is_repeated {
                    Verdict::Marginal
                } else {
                    worst.verdict
                },
                cause: None,
                rule: None,
                explanation: is_repeated.then(|| {
                    format!(
                        "{} at first; passed {passes} times in a row when repeated, so MARGINAL",
                        attempts[0].verdict.name()
                    )
                }),
            };
        }
        let explanation = (repeated > 0).then(|| {
            let good = attempts.iter().filter(|a| a.verdict.is_good()).count();
            format!(
                "repeated {}, passed {}: {} passes in a row were needed, so the failure stands",
                times(repeated),
                times(u32::try_from(good).unwrap_or(u32::MAX)),
                self.must_pass
            )
        });
        CombinedVerdict {
            verdict: worst.verdict,
            cause: worst.cause,
            rule: worst.rule.clone(),
            explanation,
        }
    }
}

/// Combined verdict of the attempts to run a check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CombinedVerdict {
    /// Verdict under the repeat rule.
    pub verdict: Verdict,
    /// Where to look; `None` when the verdict is good.
    pub cause: Option<Cause>,
    /// Name of the rule behind the cause.
    pub rule: Option<String>,
    /// How the verdict follows from the attempts.
    pub explanation: Option<String>,
}

fn repeats(attempts: &[Attempt]) -> u32 {
    u32::try_from(attempts.len().saturating_sub(1)).unwrap_or(u32::MAX)
}

fn trailing_passes(attempts: &[Attempt]) -> u32 {
    let good = attempts.iter().rev().take_while(|a| a.verdict.is_good());
    u32::try_from(good.count()).unwrap_or(u32::MAX)
}

fn times(n: u32) -> String {
    match n {
        0 => "never".to_owned(),
        1 => "once".to_owned(),
        n => format!("{n} times"),
    }
}
