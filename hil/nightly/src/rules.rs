//! Rules that derive the cause of a bad verdict from evidence.

use crate::cause::Cause;
use crate::evidence::{Evidence, EvidenceKind};
use crate::night::CheckResult;
use crate::verdict::Verdict;

/// Result of the rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RuleResult {
    /// Verdict after considering the evidence.
    pub verdict: Verdict,
    /// Where to look; `None` when the verdict is good.
    pub cause: Option<Cause>,
    /// Name of the applied rule; `None`: a limit was broken without evidence that explains it.
    pub rule: Option<&'static str>,
}

/// A rule: the evidence that triggers it, and the resulting cause and verdict.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// Name in results.
    pub name: &'static str,
    /// Kinds of evidence that trigger it.
    pub kinds: &'static [EvidenceKind],
    /// Where to look; `None`: the default cause of the check.
    pub cause: Option<Cause>,
    /// Replaces a bad verdict. INCONCLUSIVE can explain a missing measurement, but never a broken
    /// limit.
    pub verdict: Verdict,
    /// Explanation for the reader.
    pub reason: &'static str,
}

/// The rules by precedence: the first one with matching evidence decides.
pub const RULES: &[Rule] = &[
    Rule {
        name: "software-fault",
        kinds: &[EvidenceKind::Software],
        cause: Some(Cause::Software),
        verdict: Verdict::Fail,
        reason: "this program failed; nothing is known about the bench",
    },
    Rule {
        name: "not-reachable",
        kinds: &[
            EvidenceKind::Absent,
            EvidenceKind::NotPermitted,
            EvidenceKind::Busy,
            EvidenceKind::Lease,
        ],
        cause: Some(Cause::Infrastructure),
        verdict: Verdict::Fail,
        reason: "a device could not be reached from this computer: cable, power, permissions, or another program",
    },
    Rule {
        name: "computer-held-up",
        kinds: &[EvidenceKind::Disk, EvidenceKind::HostLate],
        cause: Some(Cause::Infrastructure),
        verdict: Verdict::Fail,
        reason: "the computer was too slow",
    },
    Rule {
        name: "device-at-fault",
        kinds: &[
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
        reason: "a device of the rig was faulty; measurements with it do not describe the skin",
    },
    Rule {
        name: "ended-early",
        kinds: &[EvidenceKind::Stopped, EvidenceKind::TimeOut],
        cause: Some(Cause::Infrastructure),
        verdict: Verdict::Inconclusive,
        reason: "not measured: the suite was stopped or timed out",
    },
    Rule {
        name: "not-plausible",
        kinds: &[EvidenceKind::Audit],
        cause: None,
        verdict: Verdict::Fail,
        reason: "the session of the golden skin could not be analysed, or its numbers contradict each other",
    },
    Rule {
        name: "too-little",
        kinds: &[EvidenceKind::TooLittle],
        cause: None,
        verdict: Verdict::Inconclusive,
        reason: "too few samples for a verdict",
    },
];

/// Rule for the golden skin. It is triggered by other checks of the night, not by [`Evidence`].
pub const GOLDEN_ON_A_BAD_RIG: Rule = Rule {
    name: "golden-on-a-bad-rig",
    kinds: &[],
    cause: Some(Cause::Rig),
    verdict: Verdict::Invalid,
    reason: "a device that the golden campaign relies on was faulty in the same night",
};

/// Rule for presses by an arm that moves badly. It is triggered by other checks of the night, not
/// by [`Evidence`].
pub(crate) const TOUCH_ON_A_BAD_ARM: Rule = Rule {
    name: "touch-on-a-bad-arm",
    kinds: &[],
    cause: Some(Cause::Rig),
    verdict: Verdict::Inconclusive,
    reason: "the arm moved badly in the same night: friction shifts the force at which a touch is detected",
};

/// Rules triggered by other checks of the same night.
pub const CROSS_CHECK_RULES: [&Rule; 2] = [&GOLDEN_ON_A_BAD_RIG, &TOUCH_ON_A_BAD_ARM];

/// Input of the rules: a verdict and its evidence.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// Verdict before the rules.
    pub verdict: Verdict,
    /// Whether a measured value is beyond its limit. Missing values do not count.
    pub exceeds_limit: bool,
    /// Cause of a broken limit without evidence.
    pub default_cause: Cause,
    /// Evidence to consider.
    pub evidence: &'a [&'a Evidence],
}

/// Evidence that a check did not measure all it was asked to. What it did measure proves nothing, even within all limits.
pub const CUT_SHORT: [EvidenceKind; 4] = [
    EvidenceKind::Software,
    EvidenceKind::Lease,
    EvidenceKind::Stopped,
    EvidenceKind::TimeOut,
];

/// Applies the rules. A good verdict stands unless the check was [`CUT_SHORT`]: other evidence can explain a failure but cannot
/// cause one.
#[must_use]
pub fn apply_rules(case: &Case<'_>) -> RuleResult {
    let Case {
        verdict,
        exceeds_limit,
        default_cause,
        evidence,
    } = *case;
    let is_good = verdict.is_good();
    let kinds = evidence.iter().map(|e| e.kind);
    let counts = |kind: &EvidenceKind| !is_good || CUT_SHORT.contains(kind);
    let kinds: Vec<EvidenceKind> = kinds.filter(counts).collect();
    if is_good && kinds.is_empty() {
        return RuleResult {
            verdict,
            cause: None,
            rule: None,
        };
    }
    let matches = |rule: &&Rule| {
        let explains = is_good || rule.verdict != Verdict::Inconclusive || !exceeds_limit;
        explains && kinds.iter().any(|kind| rule.kinds.contains(kind))
    };
    RULES.iter().find(matches).map_or(
        RuleResult {
            verdict,
            cause: Some(default_cause),
            rule: None,
        },
        |rule| RuleResult {
            verdict: rule.verdict,
            cause: Some(rule.cause.unwrap_or(default_cause)),
            rule: Some(rule.name),
        },
    )
}

/// Names of the checks of devices that the golden campaign uses. If one of them fails because of
/// the rig, a golden skin beyond its limits proves nothing about the skin. Drills are excluded:
/// they run later and test only the brakes. The disk belongs to the computer.
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

/// Checks of the arm's free motion. The touches of `PRESS_CHECK` rely on them.
const ARM_MOTION: [&str; 2] = ["repeatability", "step_response"];
const PRESS_CHECK: &str = "depth";

/// Applies the rules triggered by other checks of the night: they change the verdicts of presses and of the golden skin.
pub fn apply_cross_check_rules(checks: &mut [CheckResult]) {
    downgrade_presses(checks);
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

/// Downgrades good press results of an arm that moves badly: they do not prove that the frame is
/// right.
fn downgrade_presses(checks: &mut [CheckResult]) {
    let moves_badly = |c: &&CheckResult| {
        ARM_MOTION.contains(&c.name.as_str()) && !c.verdict.is_good() && c.cause == Some(Cause::Rig)
    };
    let witnesses = checks.iter().filter(moves_badly);
    let witnesses: Vec<String> = witnesses.map(|c| c.name.clone()).collect();
    if witnesses.is_empty() {
        return;
    }
    let is_good_run = |c: &&mut CheckResult| c.verdict.is_good() && c.skipped.is_none();
    let presses = checks.iter_mut().filter(|c| c.name == PRESS_CHECK);
    for press in presses.filter(is_good_run) {
        press.verdict = TOUCH_ON_A_BAD_ARM.verdict;
        press.cause = TOUCH_ON_A_BAD_ARM.cause;
        press.rule = Some(TOUCH_ON_A_BAD_ARM.name.to_owned());
        press.witnesses.clone_from(&witnesses);
    }
}
