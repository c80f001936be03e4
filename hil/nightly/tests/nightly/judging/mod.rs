//! Tests of rules, attempts and repeats: verdict and cause of each kind of evidence, and
//! invariants.

mod junit;
mod support;

use proptest::prelude::*;
use skinrig_model::Limit;
use skinrig_nightly::judge::{RepeatRule, judge_attempt, part_verdicts};
use skinrig_nightly::rules::{
    CROSS_CHECK_RULES, CUT_SHORT, Case, GOLDEN_ON_A_BAD_RIG, RULES, WITNESSES,
    apply_cross_check_rules, apply_rules,
};
use skinrig_nightly::trend::History;
use skinrig_nightly::{Cause, Evidence, EvidenceKind, NightExit, Verdict};

use support::{attempts, check, measured, night, part};

const CAUSES: [Cause; 4] = [
    Cause::Infrastructure,
    Cause::Rig,
    Cause::Skin,
    Cause::Software,
];

fn evidence(kind: EvidenceKind, subject: &str) -> Evidence {
    Evidence::new(kind, subject, "something")
}

/// The values of a device at fault say nothing of it, and those of a check that others made INVALID nothing of any: no trend learns
/// from them.
#[test]
fn trends_leave_out_what_the_rules_made_invalid() {
    let limit = Limit {
        at_least: None,
        at_most: Some(1.0),
        margin: 0.0,
    };
    let measured_in = |subject, value| part(subject, vec![measured("jitter", Some(value), limit)]);
    let parts = vec![measured_in("camera1", 3.0), measured_in("camera2", 0.5)];
    let evidence = vec![evidence(EvidenceKind::TriggerFault, "camera1")];
    let attempt = judge_attempt((0.0, 1.0), parts, evidence, Cause::Rig);
    assert_eq!(attempt.verdict, Verdict::Invalid);
    let usable = |of_check: Verdict, attempt: &skinrig_nightly::Attempt| {
        let mut made = check("trigger_loopback", of_check, None);
        made.attempts = vec![attempt.clone()];
        let mut history = History::default();
        history.push(&night(vec![made]), "here");
        let points = history.series.iter().map(|s| s.points[0].usable());
        points.collect::<Vec<_>>()
    };
    assert_eq!(usable(Verdict::Invalid, &attempt), [None, Some(0.5)]);
    let good = judge_attempt(
        (0.0, 1.0),
        vec![measured_in("camera1", 0.4), measured_in("camera2", 0.5)],
        Vec::new(),
        Cause::Rig,
    );
    assert_eq!(usable(Verdict::Pass, &good), [Some(0.4), Some(0.5)]);
    assert_eq!(usable(Verdict::Invalid, &good), [None, None]);
    let made = check("trigger_loopback", Verdict::Invalid, None);
    assert_eq!(part_verdicts(&made, &good), [Verdict::Invalid; 2]);
    // An earlier attempt was inconclusive, or another check makes this one so.
    let mut made = check("depth", Verdict::Inconclusive, Some(Cause::Rig));
    assert_eq!(part_verdicts(&made, &good), [Verdict::Pass; 2]);
    made.witnesses = vec!["repeatability".to_owned()];
    assert_eq!(part_verdicts(&made, &good), [Verdict::Inconclusive; 2]);
    // A suite that was stopped.
    let stopped = judge_attempt(
        (0.0, 1.0),
        vec![measured_in("camera1", 0.4)],
        vec![self::evidence(EvidenceKind::Stopped, "computer")],
        Cause::Rig,
    );
    assert_eq!(usable(Verdict::Inconclusive, &stopped), [None]);
}

/// Verdict and cause of an exceeded limit of a skin check, with one piece of evidence.
#[test]
fn each_evidence_kind_gives_its_verdict_and_cause() {
    use EvidenceKind::*;
    use Verdict::{Fail, Inconclusive, Invalid};
    let infrastructure = Cause::Infrastructure;
    let rows = [
        (Absent, Fail, infrastructure),
        (NotPermitted, Fail, infrastructure),
        (Busy, Fail, infrastructure),
        (DeviceLost, Invalid, Cause::Rig),
        (OtherDevice, Invalid, Cause::Rig),
        (ReadBack, Invalid, Cause::Rig),
        (State, Invalid, Cause::Rig),
        (Refused, Invalid, Cause::Rig),
        (DataLost, Invalid, Cause::Rig),
        (TriggerFault, Invalid, Cause::Rig),
        (Trip, Invalid, Cause::Rig),
        (Disk, Fail, infrastructure),
        (HostLate, Fail, infrastructure),
        (TimeOut, Inconclusive, infrastructure),
        (Stopped, Inconclusive, infrastructure),
        (Lease, Fail, infrastructure),
        (Audit, Fail, Cause::Skin),
        (TooLittle, Inconclusive, Cause::Skin),
        (Software, Fail, Cause::Software),
    ];
    assert_eq!(rows.map(|r| r.0), EvidenceKind::ALL);
    for (kind, verdict, cause) in rows {
        let evidence = evidence(kind, "skin");
        let unmeasured = Case {
            verdict: Fail,
            exceeds_limit: false,
            default_cause: Cause::Skin,
            evidence: &[&evidence],
        };
        let ruling = apply_rules(&unmeasured);
        assert_eq!(
            (ruling.verdict, ruling.cause),
            (verdict, Some(cause)),
            "{kind:?}"
        );
        let named = RULES.iter().find(|r| Some(r.name) == ruling.rule);
        assert!(named.is_some_and(|r| r.kinds.contains(&kind)), "{kind:?}");
        // Evidence that explains missing samples does not excuse a value beyond its limit.
        let broken = Case {
            exceeds_limit: true,
            ..unmeasured
        };
        let expected = if verdict == Inconclusive {
            (Fail, Some(Cause::Skin), None)
        } else {
            (verdict, Some(cause), ruling.rule)
        };
        let ruling = apply_rules(&broken);
        assert_eq!(
            (ruling.verdict, ruling.cause, ruling.rule),
            expected,
            "{kind:?}"
        );
    }
}

/// A check that was cut short found nothing bad, because it hardly looked: that is no PASS, and no night of a trend.
#[test]
fn what_was_cut_short_is_not_good() {
    let limit = Limit::at_most(1.0);
    let parts = || {
        let lost = measured("lost", Some(0.0), limit);
        vec![
            part("camera1", vec![lost.clone()]),
            part("camera2", vec![lost]),
        ]
    };
    let judge = |kind| {
        judge_attempt(
            (0.0, 1.0),
            parts(),
            vec![evidence(kind, "computer")],
            Cause::Rig,
        )
    };
    for (kind, verdict) in [
        (EvidenceKind::Stopped, Verdict::Inconclusive),
        (EvidenceKind::TimeOut, Verdict::Inconclusive),
        (EvidenceKind::Lease, Verdict::Fail),
        (EvidenceKind::Software, Verdict::Fail),
        (EvidenceKind::HostLate, Verdict::Pass),
    ] {
        let attempt = judge(kind);
        assert_eq!(attempt.verdict, verdict, "{kind:?}");
        let mut made = check("idle", verdict, attempt.cause);
        made.attempts = vec![attempt.clone()];
        assert_eq!(part_verdicts(&made, &attempt), [verdict; 2], "{kind:?}");
    }
}

#[test]
fn evidence_on_one_camera_does_not_excuse_the_other() {
    let limit = Limit::at_most(1.0);
    let parts = || {
        vec![
            part("camera1", vec![measured("jitter", None, limit)]),
            part("camera2", vec![measured("jitter", Some(9.0), limit)]),
        ]
    };
    // Camera 1 is absent; camera 2 is present and jitters.
    let absent = vec![evidence(EvidenceKind::Absent, "camera1")];
    let judged = judge_attempt((0.0, 1.0), parts(), absent, Cause::Rig);
    assert_eq!(
        (judged.verdict, judged.cause),
        (Verdict::Fail, Some(Cause::Rig))
    );
    assert_eq!(judged.rule, None);
    // Evidence on a device without a part of its own applies to all parts.
    let no_box = vec![evidence(EvidenceKind::Absent, "trigger box")];
    let judged = judge_attempt((0.0, 1.0), parts(), no_box, Cause::Rig);
    assert_eq!(judged.cause, Some(Cause::Infrastructure));
    // An unmeasured value may have needed the other camera.
    let both = vec![
        part("camera1", vec![measured("offset", None, limit)]),
        part("camera2", vec![measured("drift", None, limit)]),
    ];
    let absent = vec![evidence(EvidenceKind::Absent, "camera2")];
    let judged = judge_attempt((0.0, 1.0), both, absent, Cause::Rig);
    assert_eq!(
        (judged.verdict, judged.cause),
        (Verdict::Fail, Some(Cause::Infrastructure))
    );
}

#[test]
fn only_rig_witnesses_invalidate_the_golden_skin() {
    let golden = || check("golden", Verdict::Fail, Some(Cause::Skin));
    for (name, cause, expect_change) in [
        ("robot_state", Cause::Rig, true),
        ("noise_lit", Cause::Rig, true),
        ("robot_state", Cause::Infrastructure, false),
        ("stop_drill", Cause::Rig, false),
        ("disk", Cause::Infrastructure, false),
    ] {
        let mut checks = [check(name, Verdict::Invalid, Some(cause)), golden()];
        apply_cross_check_rules(&mut checks);
        let changed = checks[1].rule.as_deref() == Some(GOLDEN_ON_A_BAD_RIG.name);
        assert_eq!(changed, expect_change, "{name} {cause:?}");
        assert_eq!(
            checks[1].verdict == Verdict::Invalid,
            expect_change,
            "{name}"
        );
        // Applying the rules twice changes nothing.
        let once = checks.clone();
        apply_cross_check_rules(&mut checks);
        assert_eq!(checks, once);
    }
    // Unchanged: a good golden skin, a marginal witness, a golden skin with its own explanation.
    let untouched = [
        [
            check("idle", Verdict::Invalid, Some(Cause::Rig)),
            check("golden", Verdict::Pass, None),
        ],
        [check("idle", Verdict::Marginal, None), golden()],
        [
            check("idle", Verdict::Invalid, Some(Cause::Rig)),
            check("golden", Verdict::Fail, Some(Cause::Infrastructure)),
        ],
    ];
    for before in untouched {
        let mut checks = before.clone();
        apply_cross_check_rules(&mut checks);
        assert_eq!(checks, before);
    }
    assert!(!WITNESSES.contains(&"golden"));
}

/// Friction shifts the force that triggers a touch, so a good depth check does not prove a good
/// frame.
#[test]
fn touches_with_a_faulty_arm_are_inconclusive() {
    for (name, verdict, cause, expect_change) in [
        ("step_response", Verdict::Fail, Cause::Rig, true),
        ("repeatability", Verdict::Invalid, Cause::Rig, true),
        ("step_response", Verdict::Fail, Cause::Infrastructure, false),
        ("step_response", Verdict::Marginal, Cause::Rig, false),
        ("noise_lit", Verdict::Fail, Cause::Rig, false),
    ] {
        let arm = check(name, verdict, Some(cause));
        let mut checks = [arm, check("depth", Verdict::Pass, None)];
        apply_cross_check_rules(&mut checks);
        let expected = if expect_change {
            (Verdict::Inconclusive, Some(Cause::Rig))
        } else {
            (Verdict::Pass, None)
        };
        assert_eq!((checks[1].verdict, checks[1].cause), expected, "{name}");
        assert_eq!(checks[1].witnesses.is_empty(), !expect_change);
    }
    // An exceeded limit stays a failure, and force_ceiling depends on the motors only.
    let arm = || check("step_response", Verdict::Fail, Some(Cause::Rig));
    for other in [
        check("depth", Verdict::Fail, Some(Cause::Rig)),
        check("force_ceiling", Verdict::Pass, None),
    ] {
        let mut checks = [arm(), other.clone()];
        apply_cross_check_rules(&mut checks);
        assert_eq!(checks[1], other);
    }
}

/// docs/reference/nightly.md has a row for each rule.
#[test]
fn documentation_lists_the_rules() {
    let docs = include_str!("../../../../../docs/reference/nightly.md");
    for r in RULES.iter().chain(CROSS_CHECK_RULES) {
        let kinds: Vec<&str> = r.kinds.iter().map(|k| k.name()).collect();
        let kinds = if kinds.is_empty() {
            "other checks".to_owned()
        } else {
            kinds.join(", ")
        };
        let cause = r.cause.map_or("what the check is about", Cause::name);
        let row = format!(
            "| `{}` | {kinds} | {} | {cause} |",
            r.name,
            r.verdict.name()
        );
        assert!(
            docs.contains(&row),
            "expected in docs/reference/nightly.md:\n{row}"
        );
    }
}

fn is_cut_short(evidence: &Evidence) -> bool {
    CUT_SHORT.contains(&evidence.kind)
}

fn any_verdict() -> impl Strategy<Value = Verdict> {
    prop::sample::select(Verdict::ALL.to_vec())
}

fn any_evidence() -> impl Strategy<Value = Evidence> {
    let kind = prop::sample::select(EvidenceKind::ALL.to_vec());
    let subject = prop::sample::select(vec!["camera1", "camera2", "robot", "computer"]);
    (kind, subject).prop_map(|(kind, subject)| evidence(kind, subject))
}

proptest! {
    /// Evidence never makes a bad verdict good, makes a good one bad exactly if the check was cut short, and a value beyond its
    /// limit stays a failure.
    #[test]
    fn evidence_never_turns_a_verdict(
        verdict in any_verdict(),
        exceeds_limit in any::<bool>(),
        default_cause in prop::sample::select(CAUSES.to_vec()),
        evidence in prop::collection::vec(any_evidence(), 0..6),
    ) {
        let near: Vec<&Evidence> = evidence.iter().collect();
        let ruling = apply_rules(&Case { verdict, exceeds_limit, default_cause, evidence: &near });
        let is_whole = !evidence.iter().any(is_cut_short);
        prop_assert_eq!(ruling.verdict.is_good(), verdict.is_good() && is_whole);
        prop_assert_eq!(ruling.cause.is_some(), !ruling.verdict.is_good());
        if verdict == Verdict::Fail && exceeds_limit {
            prop_assert!(ruling.verdict >= Verdict::Fail);
        }
    }

    /// More evidence never makes an attempt good, and an attempt is good only if all its parts are.
    #[test]
    fn an_attempt_is_good_only_when_all_its_parts_are(
        values in prop::collection::vec(prop::option::of(0.0..2.0f64), 1..5),
        evidence in prop::collection::vec(any_evidence(), 0..5),
        more in any_evidence(),
    ) {
        let names = ["camera1", "camera2", "robot", "skin"];
        let parts: Vec<_> = names
            .iter()
            .zip(&values)
            .map(|(name, v)| part(name, vec![measured("jitter", *v, Limit::at_most(1.0))]))
            .collect();
        let within = parts.iter().all(|p| p.verdict.is_good());
        let good = |evidence: Vec<Evidence>| {
            let judged = judge_attempt((0.0, 0.0), parts.clone(), evidence, Cause::Rig);
            judged.verdict.is_good()
        };
        let whole = !evidence.iter().any(is_cut_short);
        prop_assert!(good(evidence.clone()) <= within);
        prop_assert!(good(evidence.clone()) || !within || !whole);
        prop_assert!(good([evidence.clone(), vec![more]].concat()) <= good(evidence));
    }

    /// A check that failed once never becomes PASS, and becomes MARGINAL only after enough
    /// consecutive passes. No attempt is superfluous.
    #[test]
    fn repeats_never_hide_a_failure(
        verdicts in prop::collection::vec(any_verdict(), 1..6),
        at_most in 0..4u32,
        must_pass in 1..4u32,
    ) {
        let rule = RepeatRule { at_most, must_pass };
        let mut attempt_count = 1;
        while attempt_count < verdicts.len() && rule.should_repeat(&attempts(&verdicts[..attempt_count])) {
            attempt_count += 1;
        }
        prop_assert!(attempt_count <= 1 + at_most as usize);
        let verdicts = &verdicts[..attempt_count];
        let together = rule.combine(&attempts(verdicts));
        let failed = verdicts.iter().any(|v| !v.is_good());
        if failed {
            let row = verdicts.iter().rev().take_while(|v| v.is_good()).count();
            let changed = row >= must_pass as usize;
            prop_assert_eq!(together.verdict == Verdict::Marginal, changed);
            prop_assert!(changed || !together.verdict.is_good());
            prop_assert_eq!(together.explanation.is_some(), attempt_count > 1);
        } else {
            prop_assert_eq!(attempt_count, 1);
            prop_assert_eq!(together.verdict, verdicts[0]);
            prop_assert_eq!(together.explanation, None);
        }
    }

    /// The exit code is 0 only when every check that ran is good, and 3 only when all causes are infrastructure.
    #[test]
    fn exit_code_follows_from_the_checks(
        checks in prop::collection::vec((any_verdict(), prop::sample::select(CAUSES.to_vec())), 0..8),
    ) {
        let exit = NightExit::of(checks.iter().map(|(v, c)| (*v, Some(*c))));
        let bad: Vec<_> = checks.iter().filter(|(v, _)| !v.is_good()).collect();
        let attempt_count = checks.iter().any(|(v, _)| *v != Verdict::Skipped);
        prop_assert_eq!(exit == NightExit::Pass, attempt_count && bad.is_empty());
        let invalid = bad.iter().any(|(v, _)| *v == Verdict::Invalid);
        prop_assert_eq!(exit == NightExit::Invalid, invalid);
        if exit == NightExit::Infrastructure {
            prop_assert!(bad.iter().all(|(_, c)| *c == Cause::Infrastructure));
        }
    }
}

/// Whoever reads of a night whose files are lost must not take it for a good one.
#[test]
fn a_night_whose_files_are_lost_is_not_good() {
    for (measured, expected) in [
        (Verdict::Pass, Verdict::Fail),
        (Verdict::Invalid, Verdict::Invalid),
    ] {
        let mut lost = night(vec![check("disk", measured, None)]);
        lost.verdict = measured;
        lost.lose("no space left");
        assert_eq!((lost.verdict, lost.finished), (expected, false));
        assert_eq!(lost.exit, NightExit::Infrastructure);
        assert!(
            lost.ended_early
                .is_some_and(|why| why.contains("no space left"))
        );
    }
}
