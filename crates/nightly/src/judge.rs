//! From measured parts and evidence to verdicts: of an attempt, and of a check after its repeats.

use crate::cause::Cause;
use crate::evidence::Evidence;
use crate::night::{Attempt, Part};
use crate::rules::{Case, Ruling, rule};
use crate::verdict::Verdict;

/// The computer runs every check: what is seen of it concerns every device.
const SHARED: &str = "computer";

/// An attempt from its parts and its evidence, when the check is about `about`.
///
/// Each part is ruled by itself, so that what is seen of one camera does not excuse the other. A part meets the evidence about
/// its own subject, about the computer, and about subjects that have no part (a check of the skin relies on all devices). A part
/// that was only not measured, and of whose subject nothing was seen, meets all evidence: it may have needed the others.
#[must_use]
pub fn attempt(
    (began_s, took_s): (f64, f64),
    parts: Vec<Part>,
    evidence: Vec<Evidence>,
    about: Cause,
) -> Attempt {
    let worst = parts
        .iter()
        .map(|part| rule_part(part, &parts, &evidence, about))
        .max_by_key(weight)
        .unwrap_or_else(|| rule_nothing(&evidence, about));
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

/// Of two equally bad rulings the one that does not blame the computer holds: what is at fault elsewhere must not hide behind it.
fn weight(ruling: &Ruling) -> (Verdict, bool) {
    (ruling.verdict, ruling.cause != Some(Cause::Infrastructure))
}

fn rule_part(part: &Part, parts: &[Part], evidence: &[Evidence], about: Cause) -> Ruling {
    let concerns = |e: &&Evidence| {
        e.subject == part.subject
            || e.subject == SHARED
            || !parts.iter().any(|p| p.subject == e.subject)
    };
    let mut near: Vec<&Evidence> = evidence.iter().filter(concerns).collect();
    if near.is_empty() && !part.is_broken() {
        near = evidence.iter().collect();
    }
    rule(&Case {
        verdict: part.verdict,
        broken: part.is_broken(),
        about,
        evidence: &near,
    })
}

/// Nothing at all was measured.
fn rule_nothing(evidence: &[Evidence], about: Cause) -> Ruling {
    let all: Vec<&Evidence> = evidence.iter().collect();
    rule(&Case {
        verdict: Verdict::worst([]),
        broken: false,
        about,
        evidence: &all,
    })
}

/// When attempts are made again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RepeatRule {
    /// How often at most.
    pub at_most: u32,
    /// So many in a row must be good after a failure.
    pub must_pass: u32,
}

impl RepeatRule {
    /// A check that is never made again.
    pub const NEVER: Self = Self {
        at_most: 0,
        must_pass: 1,
    };

    /// Whether a further attempt may change the verdict.
    #[must_use]
    pub fn goes_on(&self, attempts: &[Attempt]) -> bool {
        let left = self.at_most.saturating_sub(repeats(attempts));
        let failed = attempts.iter().any(|a| !a.verdict.is_good());
        let in_a_row = passed_in_a_row(attempts);
        failed && in_a_row < self.must_pass && in_a_row + left >= self.must_pass && left > 0
    }

    /// What the attempts say together, and in words how, when there was more than one or one was not good. Without a failure
    /// the only attempt's verdict holds. After a failure the worst attempt's holds, or MARGINAL once enough in a row were
    /// good: never PASS.
    #[must_use]
    pub fn together(&self, attempts: &[Attempt]) -> Together {
        let weight = |a: &&Attempt| (a.verdict, a.cause != Some(Cause::Infrastructure));
        let Some(worst) = attempts.iter().max_by_key(weight) else {
            return Together {
                verdict: Verdict::worst([]),
                cause: None,
                rule: None,
                words: None,
            };
        };
        let in_a_row = passed_in_a_row(attempts);
        let made = repeats(attempts);
        if worst.verdict.is_good() || (made > 0 && in_a_row >= self.must_pass) {
            let repeated = made > 0 && !worst.verdict.is_good();
            return Together {
                verdict: if repeated {
                    Verdict::Marginal
                } else {
                    worst.verdict
                },
                cause: None,
                rule: None,
                words: repeated.then(|| {
                    format!(
                        "{} at first; good {in_a_row} times in a row when repeated, so MARGINAL",
                        attempts[0].verdict.name()
                    )
                }),
            };
        }
        let words = (made > 0).then(|| {
            let good = attempts.iter().filter(|a| a.verdict.is_good()).count();
            format!(
                "repeated {} and good {}: {} in a row were needed, so the failure stays",
                times(made),
                times(u32::try_from(good).unwrap_or(u32::MAX)),
                self.must_pass
            )
        });
        Together {
            verdict: worst.verdict,
            cause: worst.cause,
            rule: worst.rule.clone(),
            words,
        }
    }
}

/// What the attempts at a check say together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Together {
    /// After the rules of repeats.
    pub verdict: Verdict,
    /// Where to look, when it is not good.
    pub cause: Option<Cause>,
    /// The rule that told it.
    pub rule: Option<String>,
    /// How it came from the attempts.
    pub words: Option<String>,
}

fn repeats(attempts: &[Attempt]) -> u32 {
    u32::try_from(attempts.len().saturating_sub(1)).unwrap_or(u32::MAX)
}

fn passed_in_a_row(attempts: &[Attempt]) -> u32 {
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
