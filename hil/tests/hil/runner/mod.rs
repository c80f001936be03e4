//! Tests of a suite's run with scripted findings and a manual clock.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up must fail")]

mod bench;

use bench::{DevicelessBench, ManualClock, ProgressLog, Script, night, run_suite, suite};
use skinrig_hil::Findings;
use skinrig_nightly::{Cause, CheckResult, EvidenceKind, Night, NightExit, Verdict};

const IDLE: &str = "  idle: {lost: {at_most: 0 B}}\n";
const STATE: &str = "  robot_state: {faults: {at_most: 0}}\n";
const GOLDEN: &str = "  golden: {protocol: golden.yaml, rmse: {at_most: 5 mm}}\n";

fn result_of<'a>(night: &'a Night, check: &str) -> &'a CheckResult {
    night.checks.iter().find(|c| c.name == check).unwrap()
}

/// Findings of one attempt.
type Step = fn(&mut Findings);
/// Attempts and the expected result: verdict, number of attempts, explanation.
type Case<'a> = (&'a [Step], Verdict, usize, Option<&'a str>);

fn add_passing(found: &mut Findings) {
    add_losses(found, [0.0; 2]);
}

fn add_losses(found: &mut Findings, bytes: [f64; 2]) {
    found.value("camera1", "lost", bytes[0]);
    found.value("camera2", "lost", bytes[1]);
}

#[test]
fn a_metric_that_one_camera_lacks_fails_that_camera() {
    let script = Script::default().attempt("idle", |f| {
        f.value("camera1", "lost", 0.0);
        f.value("camera1", "data_rate", 1e6);
    });
    let suite = suite(600, IDLE);
    let night = run_suite(&suite, &script);
    let idle = result_of(&night, "idle");
    let parts = &idle.attempts[0].parts;
    let reported: Vec<_> = parts
        .iter()
        .map(|p| (p.subject.as_str(), p.verdict))
        .collect();
    assert_eq!(
        reported,
        [("camera1", Verdict::Pass), ("camera2", Verdict::Fail)]
    );
    assert_eq!(parts[1].measurements[0].value, None);
    // Metrics without a limit are recorded.
    assert_eq!(parts[0].measurements.len(), 2);
    assert_eq!(
        (idle.verdict, idle.cause),
        (Verdict::Fail, Some(Cause::Rig))
    );
    assert_eq!(
        (night.verdict, night.exit),
        (Verdict::Fail, NightExit::Fail)
    );
}

#[test]
fn non_finite_unknown_and_duplicate_values_never_pass() {
    let broken: [(Step, Option<Cause>); 3] = [
        (|f| add_losses(f, [f64::NAN, 0.0]), Some(Cause::Rig)),
        (
            |f| {
                add_losses(f, [1.0, 0.0]);
                f.value("camera1", "lost", 0.0);
            },
            Some(Cause::Software),
        ),
        (
            |f| {
                f.value("camera1", "rmse", 0.0);
            },
            Some(Cause::Software),
        ),
    ];
    for (step, cause) in broken {
        let script = (0..3).fold(Script::default(), |s, _| s.attempt("idle", step));
        let night = run_suite(&suite(600, IDLE), &script);
        let idle = result_of(&night, "idle");
        assert_eq!((idle.verdict, idle.cause), (Verdict::Fail, cause));
        serde_json::to_string(&night).unwrap();
    }
}

#[test]
fn after_a_failure_only_consecutive_passes_count_and_only_as_marginal() {
    let bad = |f: &mut Findings| add_losses(f, [0.0, 7.0]);
    let worse = |f: &mut Findings| {
        f.add_evidence(EvidenceKind::DataLost, "camera2", "7 bytes");
        add_losses(f, [0.0, 7.0]);
    };
    let cases: [Case; 4] = [
        (&[add_passing], Verdict::Pass, 1, None),
        (
            &[bad, add_passing, add_passing],
            Verdict::Marginal,
            3,
            Some("FAIL at first; passed 2 times in a row when repeated, so MARGINAL"),
        ),
        // A third attempt could not change the verdict.
        (
            &[bad, bad, add_passing],
            Verdict::Fail,
            2,
            Some(
                "repeated once, passed never: 2 passes in a row were needed, so the failure stands",
            ),
        ),
        // The worst verdict stands.
        (
            &[bad, add_passing, worse],
            Verdict::Invalid,
            3,
            Some(
                "repeated 2 times, passed once: 2 passes in a row were needed, so the failure stands",
            ),
        ),
    ];
    for (steps, verdict, attempts, words) in cases {
        let script = steps
            .iter()
            .fold(Script::default(), |s, step| s.attempt("idle", *step));
        let (clock, mut bench, mut progress) = (
            ManualClock::default(),
            DevicelessBench::new(),
            ProgressLog::default(),
        );
        let suite = suite(600, IDLE);
        let night = night(&suite, &script, &clock, &mut bench, &mut progress);
        let idle = result_of(&night, "idle");
        assert_eq!((idle.verdict, idle.attempts.len()), (verdict, attempts));
        assert_eq!(idle.repeats.as_deref(), words);
        assert_eq!(idle.cause.is_none(), verdict.is_good());
        // Devices are closed before every repeat and at the end.
        assert_eq!(bench.closed as usize, attempts);
        assert_eq!(progress.started.len(), attempts);
    }
}

#[test]
fn the_golden_skin_and_safety_checks_are_never_repeated() {
    for (text, name) in [
        (GOLDEN, "golden"),
        ("  force_ceiling: {peak: {at_most: 1 N}}\n", "force_ceiling"),
        (
            "  watchdog_drill: {drop: {at_most: 1 mm}}\n",
            "watchdog_drill",
        ),
        ("  stop_drill: {distance: {at_most: 1 mm}}\n", "stop_drill"),
    ] {
        let night = run_suite(&suite(600, text), &Script::default());
        let check = result_of(&night, name);
        assert_eq!((check.verdict, check.attempts.len()), (Verdict::Fail, 1));
    }
}

#[test]
fn a_panic_is_a_software_fault_and_the_other_checks_still_run() {
    let script = Script::default()
        .attempt("idle", |_| panic!("index out of bounds"))
        .attempt("idle", |_| panic!("index out of bounds"))
        .attempt("robot_state", |f| {
            f.value("robot", "faults", 0.0);
        });
    let night = run_suite(&suite(600, &format!("{IDLE}{STATE}")), &script);
    let idle = result_of(&night, "idle");
    assert_eq!(
        (idle.verdict, idle.cause, idle.rule.as_deref()),
        (Verdict::Fail, Some(Cause::Software), Some("software-fault"))
    );
    assert!(
        idle.attempts[0].evidence[0]
            .what
            .contains("index out of bounds")
    );
    assert_eq!(result_of(&night, "robot_state").verdict, Verdict::Pass);
    assert_eq!(night.exit, NightExit::Fail);
    assert!(night.finished);
}

#[test]
fn a_check_that_does_not_fit_the_budget_is_not_started() {
    let clock = ManualClock::default();
    let slow = clock.clone();
    let script = Script::default()
        .attempt("idle", move |f| {
            slow.advance(15);
            add_passing(f);
        })
        .attempt("robot_state", |_| panic!("must not run"));
    // Estimated: 9 s for the stream, 6 s for the robot.
    let suite = suite(20, &format!("{IDLE}{STATE}"));
    let (mut bench, mut progress) = (DevicelessBench::new(), ProgressLog::default());
    let night = night(&suite, &script, &clock, &mut bench, &mut progress);
    assert_eq!(
        (night.planned_s.round(), night.took_s.round()),
        (15.0, 15.0)
    );
    let state = result_of(&night, "robot_state");
    assert_eq!(
        (state.verdict, state.cause, state.rule.as_deref()),
        (
            Verdict::Inconclusive,
            Some(Cause::Infrastructure),
            Some("ended-early")
        )
    );
    assert_eq!(state.attempts[0].evidence[0].kind, EvidenceKind::TimeOut);
    assert_eq!(night.exit, NightExit::Infrastructure);
    assert_eq!(progress.started.len(), 1);
    // The night is published after every check, and is finished only at the end.
    assert_eq!(progress.published, [(1, false), (2, false), (2, true)]);
}

#[test]
fn a_repeat_leaves_budget_for_the_remaining_checks() {
    let clock = ManualClock::default();
    let slow = clock.clone();
    let script = Script::default()
        .attempt("idle", move |f| {
            slow.advance(10);
            add_losses(f, [1.0, 0.0]);
        })
        .attempt("robot_state", |f| {
            f.value("robot", "faults", 0.0);
        });
    let suite = suite(24, &format!("{IDLE}{STATE}"));
    let (mut bench, mut progress) = (DevicelessBench::new(), ProgressLog::default());
    let night = night(&suite, &script, &clock, &mut bench, &mut progress);
    let idle = result_of(&night, "idle");
    assert_eq!(idle.attempts.len(), 1);
    assert!(
        idle.repeats
            .as_ref()
            .unwrap()
            .contains("the remaining budget is needed")
    );
    assert_eq!(result_of(&night, "robot_state").verdict, Verdict::Pass);
}

#[test]
fn a_stop_request_leaves_the_rest_inconclusive_and_a_lost_lease_is_a_failure() {
    for lost_lease in [false, true] {
        let script = Script::default();
        let suite = suite(
            600,
            &format!(
                "{IDLE}{STATE}  stop_drill: {{skip: the arm is away, distance: {{at_most: 1 mm}}}}\n"
            ),
        );
        let (clock, mut bench, mut progress) = (
            ManualClock::default(),
            DevicelessBench::new(),
            ProgressLog::default(),
        );
        bench.stop.set(!lost_lease);
        bench.lost.set(lost_lease);
        let night = night(&suite, &script, &clock, &mut bench, &mut progress);
        let idle = result_of(&night, "idle");
        let ended = if lost_lease {
            Verdict::Fail
        } else {
            Verdict::Inconclusive
        };
        assert_eq!(
            (idle.verdict, idle.cause),
            (ended, Some(Cause::Infrastructure))
        );
        assert_eq!(result_of(&night, "robot_state").verdict, ended);
        assert_eq!(result_of(&night, "stop_drill").verdict, Verdict::Skipped);
        assert!(night.ended_early.is_some() && night.finished);
        assert_eq!(night.exit, NightExit::Infrastructure);
        assert!(progress.started.is_empty());
    }
}

#[test]
fn an_arm_that_ignores_commands_is_not_sent_to_the_skin() {
    let script = Script::default()
        .attempt("robot_state", |f| {
            f.add_evidence(EvidenceKind::State, "robot", "not initialised");
            f.value("robot", "faults", 1.0);
        })
        .attempt("robot_state", |f| {
            f.value("robot", "faults", 1.0);
        })
        .attempt("golden", |_| panic!("must not run"));
    let night = run_suite(&suite(600, &format!("{STATE}{GOLDEN}")), &script);
    let golden = result_of(&night, "golden");
    assert_eq!(
        (golden.verdict, golden.cause),
        (Verdict::Invalid, Some(Cause::Rig))
    );
    assert_eq!(golden.witnesses, ["robot_state"]);
    assert_eq!(night.exit, NightExit::Invalid);
}

#[test]
fn a_golden_skin_beyond_its_limits_is_invalid_when_the_rig_was_faulty_in_the_same_night() {
    let bad_skin = |f: &mut Findings| {
        f.value("skin", "rmse", 9.0);
    };
    for (camera_lost, verdict, cause, exit) in [
        (0.0, Verdict::Fail, Cause::Skin, NightExit::Fail),
        (9.0, Verdict::Invalid, Cause::Rig, NightExit::Invalid),
    ] {
        let idle = move |f: &mut Findings| add_losses(f, [camera_lost, 0.0]);
        let script = (0..3).fold(Script::default(), |s, _| s.attempt("idle", idle));
        let night = run_suite(
            &suite(600, &format!("{IDLE}{GOLDEN}")),
            &script.attempt("golden", bad_skin),
        );
        let golden = result_of(&night, "golden");
        assert_eq!((golden.verdict, golden.cause), (verdict, Some(cause)));
        assert_eq!(night.exit, exit);
    }
}

/// A camera that no longer offers what a check needs does not undo what it did before.
#[test]
fn a_repeat_that_does_not_apply_leaves_the_failure() {
    let night = run_suite(
        &suite(600, IDLE),
        &Script::default()
            .attempt("idle", |f| add_losses(f, [0.0, 7.0]))
            .attempt("idle", |f| f.not_applicable = Some("not here".to_owned())),
    );
    let idle = result_of(&night, "idle");
    assert_eq!((idle.verdict, idle.attempts.len()), (Verdict::Fail, 1));
    assert_eq!(idle.skipped, None);
    let repeats = idle.repeats.as_deref();
    assert_eq!(repeats, Some("a repeat did not apply: not here"));
}

#[test]
fn a_night_with_only_skipped_checks_is_not_good() {
    let night = run_suite(
        &suite(600, IDLE),
        &Script::default().attempt("idle", |f| f.not_applicable = Some("not here".to_owned())),
    );
    assert_eq!(
        result_of(&night, "idle").skipped.as_deref(),
        Some("not here")
    );
    assert_eq!(
        (night.verdict, night.exit),
        (Verdict::Skipped, NightExit::Fail)
    );
    assert_eq!(
        night.versions.firmware,
        [("robot".to_owned(), "3.1".to_owned())]
    );
}
