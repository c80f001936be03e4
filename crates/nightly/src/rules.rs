//! Where to look when a check is not good: rules over the evidence, each with its name and its reason.

use serde::{Deserialize, Serialize};

use crate::evidence::{Evidence, EvidenceKind};
use crate::verdict::Verdict;

/// What is at fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The computer: its disk, cables, permissions, load; or another program.
    Infrastructure,
    /// A device of the rig.
    Rig,
    /// The skin on the bench.
    Skin,
    /// This program.
    Software,
}

/// What the rules make of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ruling {
    /// The verdict with the evidence in mind.
    pub verdict: Verdict,
    /// Where to look.
    pub cause: Option<Cause>,
    /// The rule that said so.
    pub rule: Option<&'static str>,
}

/// One rule: what speaks for it, and what it means.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// Its name, in results.
    pub name: &'static str,
    /// Evidence of these kinds speaks for it.
    pub seen: &'static [EvidenceKind],
    /// Where to look then.
    pub cause: Cause,
    /// What becomes of a verdict that is not good.
    pub verdict: Verdict,
    /// Why, for people.
    pub reason: &'static str,
}

/// The rules, strongest first: the first one whose evidence was seen tells the cause.
pub const RULES: &[Rule] = &[
    Rule {
        name: "software-fault",
        seen: &[EvidenceKind::Software],
        cause: Cause::Software,
        verdict: Verdict::Fail,
        reason: "this program failed; nothing is known about the bench",
    },
    Rule {
        name: "not-reachable",
        seen: &[
            EvidenceKind::Absent,
            EvidenceKind::NotPermitted,
            EvidenceKind::Busy,
            EvidenceKind::Lease,
        ],
        cause: Cause::Infrastructure,
        verdict: Verdict::Fail,
        reason: "a device could not be reached from this computer: cable, power, permission, or another program",
    },
    Rule {
        name: "computer-held-up",
        seen: &[EvidenceKind::Disk, EvidenceKind::HostLate],
        cause: Cause::Infrastructure,
        verdict: Verdict::Fail,
        reason: "the computer did not keep up",
    },
    Rule {
        name: "device-at-fault",
        seen: &[
            EvidenceKind::DeviceLost,
            EvidenceKind::OtherDevice,
            EvidenceKind::ReadBack,
            EvidenceKind::State,
            EvidenceKind::Refused,
            EvidenceKind::TriggerFault,
            EvidenceKind::DataLost,
            EvidenceKind::Trip,
        ],
        cause: Cause::Rig,
        verdict: Verdict::Invalid,
        reason: "a device of the rig was at fault; what was measured with it says nothing about the skin",
    },
    Rule {
        name: "too-little",
        seen: &[EvidenceKind::TooLittle, EvidenceKind::TimeOut],
        cause: Cause::Infrastructure,
        verdict: Verdict::Inconclusive,
        reason: "too little was measured to say",
    },
];

/// What `evidence` makes of `verdict` on a check that is about `about`. A good verdict stays: evidence explains a failure, it
/// does not make one. Without evidence a broken limit speaks of what the check is about.
#[must_use]
pub fn rule(verdict: Verdict, about: Cause, evidence: &[Evidence]) -> Ruling {
    if verdict.is_good() {
        return Ruling {
            verdict,
            cause: None,
            rule: None,
        };
    }
    let speaks = |rule: &&Rule| evidence.iter().any(|e| rule.seen.contains(&e.kind));
    RULES.iter().find(speaks).map_or(
        Ruling {
            verdict,
            cause: Some(about),
            rule: None,
        },
        |rule| Ruling {
            verdict: rule.verdict,
            cause: Some(rule.cause),
            rule: Some(rule.name),
        },
    )
}
