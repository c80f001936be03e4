//! Tests of the robot checks on simulated devices: results of a healthy robot, and of each fault.
#![expect(clippy::unwrap_used, reason = "tests")]

mod bench;

use bench::SimBench;
use skinrig_hil::{DrillResult, Findings};
use skinrig_model::{HostTime, RigFault};
use skinrig_nightly::EvidenceKind;
use skinrig_sim::{Fault, FaultTrigger, MotionPhase};

const STATE: &str = "robot_state: {faults: {at_most: 0}}";
const REPEATABILITY: &str = "repeatability: {approaches: 3, spread: {at_most: 1 mm}}";
const STEP: &str = "step_response: {steps: 4, error: {at_most: 1 mm}}";
const DEPTH: &str = "depth: {depth: 1 mm, presses: 2, error: {at_most: 1 mm}}";
const FORCE: &str = "force_ceiling: {force: 1 N, depth: 2.5 mm, peak: {at_most: 2 N}}";
const STOP: &str = "stop_drill: {distance: {at_most: 1 mm}}";
const WATCHDOG: &str = "watchdog_drill: {drop: {at_most: 1 mm}}";

fn value(found: &Findings, metric: &str) -> Option<f64> {
    let of = |v: &&skinrig_hil::findings::Value| v.metric == metric;
    let values: Vec<_> = found.values.iter().filter(of).collect();
    assert_eq!(values.len(), 1, "{metric} once in {found:?}");
    values[0].value
}

fn kinds(found: &Findings) -> Vec<EvidenceKind> {
    found.evidence.iter().map(|e| e.kind).collect()
}

fn from_start(fault: RigFault) -> Fault {
    Fault::new(fault, FaultTrigger::At(HostTime::ZERO)).unwrap()
}

/// Whether the arm is braked; a braked arm rejects commands.
fn is_braked(bench: &mut SimBench) -> bool {
    use skinrig_hil::bench::Bench;
    let devices = bench.devices();
    let robot = devices.robot.as_mut().unwrap();
    let mut observed = Vec::new();
    robot.poll(&mut observed).unwrap();
    let at = observed
        .last()
        .map_or_else(|| skinrig_model::Point3::new(0.0, 0.0, 0.0), |s| s.measured);
    robot.command(at, 1.0).is_err()
}

#[test]
fn a_healthy_robot_gives_small_numbers_and_is_braked_after_each_check() {
    let mut bench = SimBench::new(Vec::new());
    let state = bench.run_check(STATE);
    assert_eq!(value(&state, "faults"), Some(0.0));
    // Wander 4 µm, noise 3 µm per axis: a mean over 100 ms is accurate to a few µm.
    assert!(value(&state, "creep").unwrap() < 0.02, "{state:?}");
    let repeats = bench.run_check(REPEATABILITY);
    assert!(value(&repeats, "spread").unwrap() < 0.02, "{repeats:?}");
    assert!(value(&repeats, "error").unwrap() < 0.05, "{repeats:?}");
    let step = bench.run_check(STEP);
    assert!(value(&step, "settling").unwrap() < 0.2, "{step:?}");
    assert!(value(&step, "overshoot").unwrap() < 0.2, "{step:?}");
    assert!(value(&step, "error").unwrap() < 0.05, "{step:?}");
    assert!(is_braked(&mut bench));
    let depth = bench.run_check(DEPTH);
    assert_eq!(depth.evidence, []);
    // A touch is detected at 0.2 N, 0.33 mm deep in a skin of 0.6 N/mm.
    let height = value(&depth, "height").unwrap();
    assert!((-0.5..-0.25).contains(&height), "{depth:?}");
    assert!(value(&depth, "spread").unwrap() < 0.05, "{depth:?}");
    assert!(value(&depth, "error").unwrap() < 0.05, "{depth:?}");
    let force = bench.run_check(FORCE);
    let peak = value(&force, "peak").unwrap();
    assert!((0.9..1.3).contains(&peak), "{force:?}");
    assert_eq!(value(&force, "trips"), Some(0.0));
    assert!(is_braked(&mut bench));
    let stop = bench.run_check(STOP);
    assert!(value(&stop, "stopped_within").unwrap() < 1.0, "{stop:?}");
    let way = value(&stop, "distance").unwrap();
    // From 40 mm/s at 500 mm/s^2: 1.6 mm, plus the lag behind the set point.
    assert!((0.2..4.0).contains(&way), "{stop:?}");
    for found in [state, repeats, step, depth, force, stop] {
        assert_eq!(found.evidence, [], "{found:?}");
        assert_eq!(found.not_applicable, None);
    }
    assert!(is_braked(&mut bench));
    assert_eq!(bench.opened, 1);
}

#[test]
fn a_lost_robot_gives_no_measurement_and_is_reopened() {
    let lost = Fault::new(
        RigFault::RobotLost,
        FaultTrigger::Moment(MotionPhase::Travel, 4),
    )
    .unwrap();
    let mut bench = SimBench::new(vec![lost]);
    let found = bench.run_check(REPEATABILITY);
    assert!(
        kinds(&found).contains(&EvidenceKind::DeviceLost),
        "{found:?}"
    );
    assert_eq!(value(&found, "spread"), None);
    assert_eq!(value(&found, "error"), None);
    let repeated = bench.run_check(STATE);
    assert_eq!(value(&repeated, "faults"), Some(0.0), "{repeated:?}");
    assert_eq!(bench.opened, 2);
}

#[test]
fn a_limit_that_does_not_read_back_is_a_fault_of_the_robot() {
    let mut bench = SimBench::new(vec![from_start(RigFault::RobotSettingIgnored)]);
    let found = bench.run_check(STATE);
    assert_eq!(value(&found, "faults"), Some(1.0), "{found:?}");
    assert_eq!(value(&found, "creep"), None);
    assert_eq!(kinds(&found), [EvidenceKind::ReadBack]);
}

#[test]
fn a_stalled_and_a_slow_robot_are_detected() {
    let mut bench = SimBench::new(vec![from_start(RigFault::RobotStalled)]);
    let found = bench.run_check(REPEATABILITY);
    assert_eq!(value(&found, "spread"), None);
    assert!(kinds(&found).contains(&EvidenceKind::State), "{found:?}");
    let mut bench = SimBench::new(vec![from_start(RigFault::RobotSlow)]);
    bench.config.fault_sizes.slow_percent = 10;
    let healthy = SimBench::new(Vec::new()).run_check(STEP);
    let found = bench.run_check(STEP);
    let settling = |found: &Findings| value(found, "settling").unwrap();
    assert!(
        settling(&found) > 2.0 * settling(&healthy) + 0.1,
        "{found:?} {healthy:?}"
    );
}

#[test]
fn a_skin_too_soft_for_the_depth_makes_the_force_limit_inconclusive() {
    let mut bench = SimBench::new(Vec::new());
    let found = bench.run_check("force_ceiling: {force: 6 N, depth: 1 mm, peak: {at_most: 7 N}}");
    assert_eq!(kinds(&found), [EvidenceKind::TooLittle]);
    let peak = found.values.iter().find(|v| v.metric == "peak").unwrap();
    assert!(peak.n < Some(peak.needs), "{peak:?}");
}

#[test]
fn nothing_goes_deeper_than_the_rig_file_allows() {
    let mut bench = SimBench::new(Vec::new());
    bench.rig.limits.max_depth_mm = 1.5;
    for text in [DEPTH, FORCE] {
        let found = bench.run_check(text);
        assert_eq!(kinds(&found), [EvidenceKind::Refused], "{found:?}");
        assert!(found.values.iter().all(|v| v.value.is_none()));
    }
    bench.rig.robot.sample_is_off = true;
    assert!(bench.run_check(DEPTH).not_applicable.is_some());
    bench.rig.limits.workspace.max_mm[2] = -12.0;
    let found = bench.run_check(REPEATABILITY);
    assert_eq!(kinds(&found), [EvidenceKind::Refused], "{found:?}");
}

#[test]
fn drills_run_only_where_they_are_permitted() {
    let mut bench = SimBench::new(Vec::new());
    bench.drills.clear();
    for text in [STOP, WATCHDOG] {
        let found = bench.run_check(text);
        assert!(found.not_applicable.unwrap().contains("hil"), "{text}");
        assert_eq!(found.values, []);
    }
    assert_eq!(bench.opened, 0);
    let mut bench = SimBench::new(Vec::new());
    for (braked_within_s, expected) in [(Some(0.3), Some(0.3)), (None, None)] {
        bench.drill_result = Some(DrillResult {
            braked_within_s,
            drop_mm: 2.0,
            note: None,
        });
        let found = bench.run_check(WATCHDOG);
        assert_eq!(value(&found, "braked_within"), expected);
        assert_eq!(value(&found, "drop"), Some(2.0));
    }
}

#[test]
fn a_stop_request_soon_leaves_a_braked_arm() {
    let mut bench = SimBench::new(Vec::new());
    bench.polls_until_stop.set(Some(400));
    let found = bench.run_check(REPEATABILITY);
    assert_eq!(kinds(&found), [EvidenceKind::Stopped], "{found:?}");
    assert_eq!(value(&found, "spread"), None);
    bench.polls_until_stop.set(None);
    assert!(is_braked(&mut bench));
}
