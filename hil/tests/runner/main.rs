//! The run of a suite, on checks that find what is written down for them and a clock that is set.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up must fail")]

mod bench;

use bench::{Hands, NoBench, Notes, Script, night, plain, suite};
use skinrig_hil::Findings;
use skinrig_nightly::{Cause, CheckResult, EvidenceKind, Night, NightExit, Verdict};

const IDLE: &str = "  idle: {lost: {at_most: 0 B}}\n";
const STATE: &str = "  robot_state: {faults: {at_most: 0}}\n";
const GOLDEN: &str = "  golden: {protocol: golden.yaml, rmse: {at_most: 5 mm}}\n";

fn of<'a>(night: &'a Night, check: &str) -> &'a CheckResult {
    night.checks.iter().find(|c| c.name == check).unwrap()
}

/// What an attempt finds.
type Step = fn(&mut Findings);
/// Attempts, and what they come to: verdict, how many are made, in words.
type Case<'a> = (&'a [Step], Verdict, usize, Option<&'a str>);

fn good(found: &mut Findings) {
    lost(found, [0.0; 2]);
}

fn lost(found: &mut Findings, bytes: [f64; 2]) {
    found.value("camera1", "lost", bytes[0]);
    found.value("camera2", "lost", bytes[1]);
}

#[test]
fn what_was_not_measured_on_one_camera_is_a_failure_of_that_camera() {
    let script = Script::default().then("idle", |f| {
        f.value("camera1", "lost", 0.0);
        f.value("camera1", "data_rate", 1e6);
    });
    let suite = suite(600, IDLE);
    let night = plain(&suite, &script);
    let idle = of(&night, "idle");
    let parts = &idle.attempts[0].parts;
    let told: Vec<_> = parts
        .iter()
        .map(|p| (p.subject.as_str(), p.verdict))
        .collect();
    assert_eq!(
        told,
        [("camera1", Verdict::Pass), ("camera2", Verdict::Fail)]
    );
    assert_eq!(parts[1].measurements[0].value, None);
    // What no limit was stated for is kept for the record.
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
fn numbers_that_are_none_unknown_metrics_and_doubles_are_never_good() {
    let broken: [(Step, Option<Cause>); 3] = [
        (|f| lost(f, [f64::NAN, 0.0]), Some(Cause::Rig)),
        (
            |f| {
                lost(f, [1.0, 0.0]);
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
        let script = (0..3).fold(Script::default(), |s, _| s.then("idle", step));
        let night = plain(&suite(600, IDLE), &script);
        let idle = of(&night, "idle");
        assert_eq!((idle.verdict, idle.cause), (Verdict::Fail, cause));
        serde_json::to_string(&night).unwrap();
    }
}

#[test]
fn after_a_failure_only_passes_in_a_row_help_and_only_to_marginal() {
    let bad = |f: &mut Findings| lost(f, [0.0, 7.0]);
    let worse = |f: &mut Findings| {
        f.saw(EvidenceKind::DataLost, "camera2", "7 bytes");
        lost(f, [0.0, 7.0]);
    };
    let cases: [Case; 4] = [
        (&[good], Verdict::Pass, 1, None),
        (
            &[bad, good, good],
            Verdict::Marginal,
            3,
            Some("FAIL at first; good 2 times in a row when repeated, so MARGINAL"),
        ),
        // A third attempt could not change it any more.
        (
            &[bad, bad, good],
            Verdict::Fail,
            2,
            Some("repeated once and good never: 2 in a row were needed, so the failure stays"),
        ),
        // The worst attempt is what remains.
        (
            &[bad, good, worse],
            Verdict::Invalid,
            3,
            Some("repeated 2 times and good once: 2 in a row were needed, so the failure stays"),
        ),
    ];
    for (steps, verdict, attempts, words) in cases {
        let script = steps
            .iter()
            .fold(Script::default(), |s, step| s.then("idle", *step));
        let (hands, mut bench, mut notes) = (Hands::default(), NoBench::new(), Notes::default());
        let suite = suite(600, IDLE);
        let night = night(&suite, &script, &hands, &mut bench, &mut notes);
        let idle = of(&night, "idle");
        assert_eq!((idle.verdict, idle.attempts.len()), (verdict, attempts));
        assert_eq!(idle.repeats.as_deref(), words);
        assert_eq!(idle.cause.is_none(), verdict.is_good());
        // Devices are closed before every repeat and in the end.
        assert_eq!(bench.closed as usize, attempts);
        assert_eq!(notes.begun.len(), attempts);
    }
}

#[test]
fn the_golden_skin_and_what_tests_a_guard_are_never_repeated() {
    for (text, name) in [
        (GOLDEN, "golden"),
        ("  force_ceiling: {peak: {at_most: 1 N}}\n", "force_ceiling"),
        (
            "  watchdog_drill: {drop: {at_most: 1 mm}}\n",
            "watchdog_drill",
        ),
        ("  stop_drill: {distance: {at_most: 1 mm}}\n", "stop_drill"),
    ] {
        let night = plain(&suite(600, text), &Script::default());
        let check = of(&night, name);
        assert_eq!((check.verdict, check.attempts.len()), (Verdict::Fail, 1));
    }
}

#[test]
fn a_panic_is_a_fault_of_the_software_and_everything_else_goes_on() {
    let script = Script::default()
        .then("idle", |_| panic!("index out of bounds"))
        .then("idle", |_| panic!("index out of bounds"))
        .then("robot_state", |f| {
            f.value("robot", "faults", 0.0);
        });
    let night = plain(&suite(600, &format!("{IDLE}{STATE}")), &script);
    let idle = of(&night, "idle");
    assert_eq!(
        (idle.verdict, idle.cause, idle.rule.as_deref()),
        (Verdict::Fail, Some(Cause::Software), Some("software-fault"))
    );
    assert!(
        idle.attempts[0].evidence[0]
            .what
            .contains("index out of bounds")
    );
    assert_eq!(of(&night, "robot_state").verdict, Verdict::Pass);
    assert_eq!(night.exit, NightExit::Fail);
    assert!(night.finished);
}

#[test]
fn what_does_not_fit_the_budget_any_more_is_not_begun() {
    let hands = Hands::default();
    let slow = hands.clone();
    let script = Script::default()
        .then("idle", move |f| {
            slow.pass(15);
            good(f);
        })
        .then("robot_state", |_| panic!("was to be left out"));
    // As planned: 9 s for the stream, 6 s for the robot.
    let suite = suite(20, &format!("{IDLE}{STATE}"));
    let (mut bench, mut notes) = (NoBench::new(), Notes::default());
    let night = night(&suite, &script, &hands, &mut bench, &mut notes);
    assert_eq!(
        (night.planned_s.round(), night.took_s.round()),
        (15.0, 15.0)
    );
    let state = of(&night, "robot_state");
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
    assert_eq!(notes.begun.len(), 1);
    // Kept after every check, and finished only in the end.
    assert_eq!(notes.kept, [(1, false), (2, false), (2, true)]);
}

#[test]
fn a_repeat_leaves_room_for_what_is_still_to_come() {
    let hands = Hands::default();
    let slow = hands.clone();
    let script = Script::default()
        .then("idle", move |f| {
            slow.pass(10);
            lost(f, [1.0, 0.0]);
        })
        .then("robot_state", |f| {
            f.value("robot", "faults", 0.0);
        });
    let suite = suite(24, &format!("{IDLE}{STATE}"));
    let (mut bench, mut notes) = (NoBench::new(), Notes::default());
    let night = night(&suite, &script, &hands, &mut bench, &mut notes);
    let idle = of(&night, "idle");
    assert_eq!(idle.attempts.len(), 1);
    assert!(
        idle.repeats
            .as_ref()
            .unwrap()
            .contains("the budget holds only")
    );
    assert_eq!(of(&night, "robot_state").verdict, Verdict::Pass);
}

#[test]
fn an_end_on_request_leaves_the_rest_inconclusive_and_a_lost_bench_is_a_failure() {
    for lost_lease in [false, true] {
        let script = Script::default();
        let suite = suite(
            600,
            &format!(
                "{IDLE}{STATE}  stop_drill: {{skip: the arm is away, distance: {{at_most: 1 mm}}}}\n"
            ),
        );
        let (hands, mut bench, mut notes) = (Hands::default(), NoBench::new(), Notes::default());
        bench.stop.set(!lost_lease);
        bench.lost.set(lost_lease);
        let night = night(&suite, &script, &hands, &mut bench, &mut notes);
        let idle = of(&night, "idle");
        let ended = if lost_lease {
            Verdict::Fail
        } else {
            Verdict::Inconclusive
        };
        assert_eq!(
            (idle.verdict, idle.cause),
            (ended, Some(Cause::Infrastructure))
        );
        assert_eq!(of(&night, "robot_state").verdict, ended);
        assert_eq!(of(&night, "stop_drill").verdict, Verdict::Skipped);
        assert!(night.ended_early.is_some() && night.finished);
        assert_eq!(night.exit, NightExit::Infrastructure);
        assert!(notes.begun.is_empty());
    }
}

#[test]
fn an_arm_that_does_not_obey_is_not_sent_to_the_skin() {
    let script = Script::default()
        .then("robot_state", |f| {
            f.saw(EvidenceKind::State, "robot", "not initialised");
            f.value("robot", "faults", 1.0);
        })
        .then("robot_state", |f| {
            f.value("robot", "faults", 1.0);
        })
        .then("golden", |_| panic!("was to be left out"));
    let night = plain(&suite(600, &format!("{STATE}{GOLDEN}")), &script);
    let golden = of(&night, "golden");
    assert_eq!(
        (golden.verdict, golden.cause),
        (Verdict::Invalid, Some(Cause::Rig))
    );
    assert_eq!(golden.witnesses, ["robot_state"]);
    assert_eq!(night.exit, NightExit::Invalid);
}

#[test]
fn a_golden_skin_beyond_its_limits_says_nothing_when_the_rig_was_at_fault_the_same_night() {
    let worn = |f: &mut Findings| {
        f.value("skin", "rmse", 9.0);
    };
    for (camera_lost, verdict, cause, exit) in [
        (0.0, Verdict::Fail, Cause::Skin, NightExit::Fail),
        (9.0, Verdict::Invalid, Cause::Rig, NightExit::Invalid),
    ] {
        let idle = move |f: &mut Findings| lost(f, [camera_lost, 0.0]);
        let script = (0..3).fold(Script::default(), |s, _| s.then("idle", idle));
        let night = plain(
            &suite(600, &format!("{IDLE}{GOLDEN}")),
            &script.then("golden", worn),
        );
        let golden = of(&night, "golden");
        assert_eq!((golden.verdict, golden.cause), (verdict, Some(cause)));
        assert_eq!(night.exit, exit);
    }
}

#[test]
fn a_night_of_nothing_but_skipped_checks_is_not_good() {
    let night = plain(
        &suite(600, IDLE),
        &Script::default().then("idle", |f| f.not_here = Some("not here".to_owned())),
    );
    assert_eq!(of(&night, "idle").skipped.as_deref(), Some("not here"));
    assert_eq!(
        (night.verdict, night.exit),
        (Verdict::Skipped, NightExit::Fail)
    );
    assert_eq!(
        night.versions.firmware,
        [("robot".to_owned(), "3.1".to_owned())]
    );
}
