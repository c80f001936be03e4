//! Where to look when something is not good: rules over the evidence, each with its name and its reason.

use crate::cause::Cause;
use crate::evidence::{Evidence, EvidenceKind};
use crate::night::CheckResult;
use crate::verdict::Verdict;

/// What the rules make of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ruling {
    /// The verdict with the evidence in mind.
    pub verdict: Verdict,
    /// Where to look; `None` when it is good.
    pub cause: Option<Cause>,
    /// The rule that said so; `None`: a limit was broken, and nothing was seen that explains it.
    pub rule: Option<&'static str>,
}

/// One rule: what speaks for it, and what it means.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// Its name, in results.
    pub name: &'static str,
    /// Evidence of these kinds speaks for it.
    pub seen: &'static [EvidenceKind],
    /// Where to look then; `None`: at what the check is about.
    pub cause: Option<Cause>,
    /// What becomes of a verdict that is not good. INCONCLUSIVE explains what was not measured, and no broken limit.
    pub verdict: Verdict,
    /// Why, for people.
    pub reason: &'static str,
}

/// The rules, strongest first: the first one whose evidence was seen tells the cause.
pub const RULES: &[Rule] = &[
    Rule {
        name: "software-fault",
        seen: &[EvidenceKind::Software],
        cause: Some(Cause::Software),
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
        cause: Some(Cause::Infrastructure),
        verdict: Verdict::Fail,
        reason: "a device could not be reached from this computer: cable, power, permission, or another program",
    },
    Rule {
        name: "computer-held-up",
        seen: &[EvidenceKind::Disk, EvidenceKind::HostLate],
        cause: Some(Cause::Infrastructure),
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
            EvidenceKind::DataLost,
            EvidenceKind::TriggerFault,
            EvidenceKind::Trip,
        ],
        cause: Some(Cause::Rig),
        verdict: Verdict::Invalid,
        reason: "a device of the rig was at fault; what was measured with it says nothing about the skin",
    },
    Rule {
        name: "not-plausible",
        seen: &[EvidenceKind::Audit],
        cause: None,
        verdict: Verdict::Fail,
        reason: "the session of the golden skin could not be analysed, or its numbers contradict one another",
    },
    Rule {
        name: "ended-early",
        seen: &[EvidenceKind::Stopped, EvidenceKind::TimeOut],
        cause: Some(Cause::Infrastructure),
        verdict: Verdict::Inconclusive,
        reason: "somebody ended the suite, or its time ran out, before this was measured",
    },
    Rule {
        name: "too-little",
        seen: &[EvidenceKind::TooLittle],
        cause: None,
        verdict: Verdict::Inconclusive,
        reason: "too few samples to say",
    },
];

/// The rule across the checks of one night. Its evidence is other checks, not a kind of [`Evidence`].
pub const GOLDEN_ON_A_BAD_RIG: Rule = Rule {
    name: "golden-on-a-bad-rig",
    seen: &[],
    cause: Some(Cause::Rig),
    verdict: Verdict::Invalid,
    reason: "a device that the golden campaign relies on was found at fault in the same night",
};

/// The rule for presses of an arm that moves badly. Its evidence is other checks, as above.
pub(crate) const TOUCH_ON_A_BAD_ARM: Rule = Rule {
    name: "touch-on-a-bad-arm",
    seen: &[],
    cause: Some(Cause::Rig),
    verdict: Verdict::Inconclusive,
    reason: "the arm did not move as it should in the same night: friction shifts the force at which a touch is detected",
};

/// Rules whose evidence is other checks of the same night.
pub const ACROSS: [&Rule; 2] = [&GOLDEN_ON_A_BAD_RIG, &TOUCH_ON_A_BAD_ARM];

/// What a verdict is about.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// Before the rules.
    pub verdict: Verdict,
    /// Something was measured beyond its limit, other than not measured at all.
    pub broken: bool,
    /// What a broken limit speaks of when nothing else was seen.
    pub about: Cause,
    /// What was seen.
    pub evidence: &'a [&'a Evidence],
}

/// What the evidence makes of a verdict. A good one stays: evidence explains a failure, it does not make one.
#[must_use]
pub fn rule(case: &Case<'_>) -> Ruling {
    let Case {
        verdict,
        broken,
        about,
        evidence,
    } = *case;
    if verdict.is_good() {
        return Ruling {
            verdict,
            cause: None,
            rule: None,
        };
    }
    let speaks = |rule: &&Rule| {
        let explains = rule.verdict != Verdict::Inconclusive || !broken;
        explains && evidence.iter().any(|e| rule.seen.contains(&e.kind))
    };
    RULES.iter().find(speaks).map_or(
        Ruling {
            verdict,
            cause: Some(about),
            rule: None,
        },
        |rule| Ruling {
            verdict: rule.verdict,
            cause: Some(rule.cause.unwrap_or(about)),
            rule: Some(rule.name),
        },
    )
}

/// Checks of whose devices the golden campaign makes use, by name: when one of them is the rig's fault, a golden skin beyond its
/// limits says nothing about the skin. The drills come after it and ask about the arm's brakes alone; the disk is the computer's.
pub const WITNESSES: &[&str] = &[
    "identity",
    "settings",
    "trigger_loopback",
    "clocks",
    "idle",
    "noise_dark",
    "noise_lit",
    "test_pattern",
    "robot_state",
    "repeatability",
    "step_response",
    "depth",
    "force_ceiling",
];

/// Checks of the free arm's motion, and the check whose touches rely on it, by name.
const ARM_MOTION: [&str; 2] = ["repeatability", "step_response"];
const PRESSES: &str = "depth";

/// The rules across the checks of one night: faults that other checks found change the verdict of presses and of the golden skin.
pub fn across(checks: &mut [CheckResult]) {
    touches(checks);
    let at_fault = |c: &&CheckResult| {
        WITNESSES.contains(&c.name.as_str()) && !c.verdict.is_good() && c.cause == Some(Cause::Rig)
    };
    let witnesses: Vec<String> = checks
        .iter()
        .filter(at_fault)
        .map(|c| c.name.clone())
        .collect();
    if witnesses.is_empty() {
        return;
    }
    for golden in checks.iter_mut().filter(|c| c.name == "golden") {
        if golden.verdict.is_good() || golden.cause != Some(Cause::Skin) {
            continue;
        }
        golden.verdict = GOLDEN_ON_A_BAD_RIG.verdict;
        golden.cause = GOLDEN_ON_A_BAD_RIG.cause;
        golden.rule = Some(GOLDEN_ON_A_BAD_RIG.name.to_owned());
        golden.witnesses.clone_from(&witnesses);
    }
}

/// A good press of a bad arm is not evidence of a good frame.
fn touches(checks: &mut [CheckResult]) {
    let moves_badly = |c: &&CheckResult| {
        ARM_MOTION.contains(&c.name.as_str()) && !c.verdict.is_good() && c.cause == Some(Cause::Rig)
    };
    let witnesses = checks.iter().filter(moves_badly);
    let witnesses: Vec<String> = witnesses.map(|c| c.name.clone()).collect();
    if witnesses.is_empty() {
        return;
    }
    let made = |c: &&mut CheckResult| c.verdict.is_good() && c.skipped.is_none();
    let presses = checks.iter_mut().filter(|c| c.name == PRESSES);
    for press in presses.filter(made) {
        press.verdict = TOUCH_ON_A_BAD_ARM.verdict;
        press.cause = TOUCH_ON_A_BAD_ARM.cause;
        press.rule = Some(TOUCH_ON_A_BAD_ARM.name.to_owned());
        press.witnesses.clone_from(&witnesses);
    }
}
