//! Rules over evidence, attempts and repeats: what each kind of evidence means, and laws that hold for all of it.

mod junit;
mod support;

use proptest::prelude::*;
use skinrig_model::Limit;
use skinrig_nightly::judge::{RepeatRule, attempt};
use skinrig_nightly::rules::{ACROSS, Case, GOLDEN_ON_A_BAD_RIG, RULES, WITNESSES, across, rule};
use skinrig_nightly::{Cause, Evidence, EvidenceKind, NightExit, Verdict};

use support::{attempts, check, measured, part};

const CAUSES: [Cause; 4] = [
    Cause::Infrastructure,
    Cause::Rig,
    Cause::Skin,
    Cause::Software,
];

fn seen(kind: EvidenceKind, subject: &str) -> Evidence {
    Evidence::new(kind, subject, "something")
}

/// What a limit that was broken on a check about the skin becomes with one piece of evidence.
#[test]
fn every_kind_of_evidence_has_its_meaning() {
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
        let evidence = seen(kind, "skin");
        let unmeasured = Case {
            verdict: Fail,
            broken: false,
            about: Cause::Skin,
            evidence: &[&evidence],
        };
        let ruling = rule(&unmeasured);
        assert_eq!(
            (ruling.verdict, ruling.cause),
            (verdict, Some(cause)),
            "{kind:?}"
        );
        let named = RULES.iter().find(|r| Some(r.name) == ruling.rule);
        assert!(named.is_some_and(|r| r.seen.contains(&kind)), "{kind:?}");
        // What explains why too little was measured does not excuse what was measured beyond its limit.
        let broken = Case {
            broken: true,
            ..unmeasured
        };
        let expected = if verdict == Inconclusive {
            (Fail, Some(Cause::Skin), None)
        } else {
            (verdict, Some(cause), ruling.rule)
        };
        let ruling = rule(&broken);
        assert_eq!(
            (ruling.verdict, ruling.cause, ruling.rule),
            expected,
            "{kind:?}"
        );
    }
}

#[test]
fn what_is_seen_of_one_camera_excuses_neither_the_other_nor_itself_twice() {
    let limit = Limit::at_most(1.0);
    let parts = || {
        vec![
            part("camera1", vec![measured("jitter", None, limit)]),
            part("camera2", vec![measured("jitter", Some(9.0), limit)]),
        ]
    };
    // Camera 1 is not there; camera 2 is, and jitters.
    let absent = vec![seen(EvidenceKind::Absent, "camera1")];
    let judged = attempt((0.0, 1.0), parts(), absent, Cause::Rig);
    assert_eq!(
        (judged.verdict, judged.cause),
        (Verdict::Fail, Some(Cause::Rig))
    );
    assert_eq!(judged.rule, None);
    // What has no part of its own concerns all.
    let no_box = vec![seen(EvidenceKind::Absent, "trigger box")];
    let judged = attempt((0.0, 1.0), parts(), no_box, Cause::Rig);
    assert_eq!(judged.cause, Some(Cause::Infrastructure));
    // What was only not measured may have needed the other.
    let both = vec![
        part("camera1", vec![measured("offset", None, limit)]),
        part("camera2", vec![measured("drift", None, limit)]),
    ];
    let absent = vec![seen(EvidenceKind::Absent, "camera2")];
    let judged = attempt((0.0, 1.0), both, absent, Cause::Rig);
    assert_eq!(
        (judged.verdict, judged.cause),
        (Verdict::Fail, Some(Cause::Infrastructure))
    );
}

#[test]
fn only_the_rigs_witnesses_speak_against_the_golden_skin() {
    let golden = || check("golden", Verdict::Fail, Some(Cause::Skin));
    for (name, cause, turns) in [
        ("robot_state", Cause::Rig, true),
        ("noise_lit", Cause::Rig, true),
        ("robot_state", Cause::Infrastructure, false),
        ("stop_drill", Cause::Rig, false),
        ("disk", Cause::Infrastructure, false),
    ] {
        let mut checks = [check(name, Verdict::Invalid, Some(cause)), golden()];
        across(&mut checks);
        let turned = checks[1].rule.as_deref() == Some(GOLDEN_ON_A_BAD_RIG.name);
        assert_eq!(turned, turns, "{name} {cause:?}");
        assert_eq!(checks[1].verdict == Verdict::Invalid, turns, "{name}");
        // Twice is as once.
        let once = checks.clone();
        across(&mut checks);
        assert_eq!(checks, once);
    }
    // A good golden skin stays good, a marginal witness is none, and what explains the golden skin itself holds.
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
        across(&mut checks);
        assert_eq!(checks, before);
    }
    assert!(!WITNESSES.contains(&"golden"));
}

/// Friction shifts the force at which a touch is detected: a good depth check beside it is not evidence of a good frame.
#[test]
fn touches_of_an_arm_that_moves_badly_are_inconclusive() {
    for (name, verdict, cause, turns) in [
        ("step_response", Verdict::Fail, Cause::Rig, true),
        ("repeatability", Verdict::Invalid, Cause::Rig, true),
        ("step_response", Verdict::Fail, Cause::Infrastructure, false),
        ("step_response", Verdict::Marginal, Cause::Rig, false),
        ("noise_lit", Verdict::Fail, Cause::Rig, false),
    ] {
        let arm = check(name, verdict, Some(cause));
        let mut checks = [arm, check("depth", Verdict::Pass, None)];
        across(&mut checks);
        let expected = if turns {
            (Verdict::Inconclusive, Some(Cause::Rig))
        } else {
            (Verdict::Pass, None)
        };
        assert_eq!((checks[1].verdict, checks[1].cause), expected, "{name}");
        assert_eq!(checks[1].witnesses.is_empty(), !turns);
    }
    // A broken limit stays broken, and force_ceiling asks about the motors alone.
    let arm = || check("step_response", Verdict::Fail, Some(Cause::Rig));
    for other in [
        check("depth", Verdict::Fail, Some(Cause::Rig)),
        check("force_ceiling", Verdict::Pass, None),
    ] {
        let mut checks = [arm(), other.clone()];
        across(&mut checks);
        assert_eq!(checks[1], other);
    }
}

/// The tables of the rules are in the documentation, word for word.
#[test]
fn the_documentation_has_the_rules() {
    let docs = include_str!("../../../../docs/reference/nightly.md");
    for r in RULES.iter().chain(ACROSS) {
        let kinds: Vec<&str> = r.seen.iter().map(|k| k.name()).collect();
        let seen = if kinds.is_empty() {
            "other checks".to_owned()
        } else {
            kinds.join(", ")
        };
        let cause = r.cause.map_or("what the check is about", Cause::name);
        let row = format!(
            "| `{}` | {seen} | {} | {cause} | {} |",
            r.name,
            r.verdict.name(),
            r.reason
        );
        assert!(
            docs.contains(&row),
            "expected in docs/reference/nightly.md:\n{row}"
        );
    }
}

fn any_verdict() -> impl Strategy<Value = Verdict> {
    prop::sample::select(Verdict::ALL.to_vec())
}

fn any_evidence() -> impl Strategy<Value = Evidence> {
    let kind = prop::sample::select(EvidenceKind::ALL.to_vec());
    let subject = prop::sample::select(vec!["camera1", "camera2", "robot", "computer"]);
    (kind, subject).prop_map(|(kind, subject)| seen(kind, subject))
}

proptest! {
    /// Evidence explains; it makes nothing good that is bad, nothing bad that is good, and nothing that is measured beyond its
    /// limit less than a failure.
    #[test]
    fn evidence_never_turns_a_verdict(
        verdict in any_verdict(),
        broken in any::<bool>(),
        about in prop::sample::select(CAUSES.to_vec()),
        evidence in prop::collection::vec(any_evidence(), 0..6),
    ) {
        let near: Vec<&Evidence> = evidence.iter().collect();
        let ruling = rule(&Case { verdict, broken, about, evidence: &near });
        prop_assert_eq!(ruling.verdict.is_good(), verdict.is_good());
        prop_assert_eq!(ruling.cause.is_some(), !verdict.is_good());
        if verdict == Verdict::Fail && broken {
            prop_assert!(ruling.verdict >= Verdict::Fail);
        }
    }

    /// More evidence on an attempt never makes it good, and an attempt is good only when all its parts are.
    #[test]
    fn an_attempt_is_good_only_when_everything_is(
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
        let good = parts.iter().all(|p| p.verdict.is_good());
        let judged = attempt((0.0, 0.0), parts.clone(), evidence.clone(), Cause::Rig);
        prop_assert_eq!(judged.verdict.is_good(), good);
        let with = attempt((0.0, 0.0), parts, [evidence, vec![more]].concat(), Cause::Rig);
        prop_assert_eq!(with.verdict.is_good(), good);
    }

    /// After a failure nothing is PASS any more; MARGINAL only after enough in a row; all attempts that were made are needed.
    #[test]
    fn repeats_never_hide_a_failure(
        verdicts in prop::collection::vec(any_verdict(), 1..6),
        at_most in 0..4u32,
        must_pass in 1..4u32,
    ) {
        let rule = RepeatRule { at_most, must_pass };
        let mut made = 1;
        while made < verdicts.len() && rule.goes_on(&attempts(&verdicts[..made])) {
            made += 1;
        }
        prop_assert!(made <= 1 + at_most as usize);
        let verdicts = &verdicts[..made];
        let together = rule.together(&attempts(verdicts));
        let failed = verdicts.iter().any(|v| !v.is_good());
        if failed {
            let row = verdicts.iter().rev().take_while(|v| v.is_good()).count();
            let turned = row >= must_pass as usize;
            prop_assert_eq!(together.verdict == Verdict::Marginal, turned);
            prop_assert!(turned || !together.verdict.is_good());
            prop_assert_eq!(together.words.is_some(), made > 1);
        } else {
            prop_assert_eq!(made, 1);
            prop_assert_eq!(together.verdict, verdicts[0]);
            prop_assert_eq!(together.words, None);
        }
    }

    /// A night's code is 0 only when every check that was made is good, and 3 only when nothing but the computer is named.
    #[test]
    fn the_code_follows_from_the_checks(
        checks in prop::collection::vec((any_verdict(), prop::sample::select(CAUSES.to_vec())), 0..8),
    ) {
        let exit = NightExit::of(checks.iter().map(|(v, c)| (*v, Some(*c))));
        let bad: Vec<_> = checks.iter().filter(|(v, _)| !v.is_good()).collect();
        let made = checks.iter().any(|(v, _)| *v != Verdict::Skipped);
        prop_assert_eq!(exit == NightExit::Pass, made && bad.is_empty());
        let invalid = bad.iter().any(|(v, _)| *v == Verdict::Invalid);
        prop_assert_eq!(exit == NightExit::Invalid, invalid);
        if exit == NightExit::Infrastructure {
            prop_assert!(bad.iter().all(|(_, c)| *c == Cause::Infrastructure));
        }
    }
}
