//! Checks `trigger_loopback` and `clocks`.

use skinrig_model::{CameraId, HostTime, RigFault, SimLevel};
use skinrig_nightly::EvidenceKind;
use skinrig_sim::{Fault, FaultTrigger, LineNoise};

use crate::cameras::bench::{SimBench, kinds_and_subjects, number, value};

const LOOPBACK: &str = "trigger_loopback: {trains: 20, lost_pulses: {at_most: 0}}";
const CLOCKS: &str = "clocks: {duration: 10 s, drift: {at_least: -1 ppm, at_most: 1 ppm}}";
const CAMERAS: [&str; 2] = ["camera1", "camera2"];

fn bench(faults: Vec<Fault>) -> SimBench {
    SimBench::new(SimLevel::Kinematic, faults)
}

fn fault(kind: RigFault, seconds: f64) -> Fault {
    let when = FaultTrigger::At(HostTime::from_secs_f64(seconds));
    Fault::new(kind, when).unwrap()
}

#[test]
fn a_good_line_has_no_lost_or_extra_pulses_and_the_jitter_of_its_input() {
    let found = bench(Vec::new()).run_check(LOOPBACK);
    assert_eq!(found.evidence, []);
    for camera in CAMERAS {
        for metric in ["lost_pulses", "extra_pulses", "unread_trains"] {
            assert_eq!(number(&found, camera, metric), 0.0, "{camera} {metric}");
        }
        // Uniform delay of 0 to 2.5 µs, and two clocks with a resolution of 1 µs.
        let jitter = value(&found, camera, "jitter");
        let expected_s = 1e-6 * (2.5f64.powi(2) / 12.0 + 1.0 / 12.0).sqrt();
        let [low, high] = jitter.interval.unwrap();
        assert!(
            low < expected_s && expected_s < high,
            "{jitter:?}, {expected_s}"
        );
    }
}

#[test]
fn lost_pulses_are_counted_on_the_camera_that_lost_them() {
    let lost = |train, pulse| Fault::PulseLost {
        camera: CameraId::Two,
        train,
        pulse,
    };
    // Two data pulses, and a start pulse without which the train cannot be decoded.
    let found = bench(vec![lost(3, 8), lost(11, 31), lost(15, 0)]).run_check(LOOPBACK);
    assert_eq!(number(&found, "camera1", "lost_pulses"), 0.0);
    assert_eq!(number(&found, "camera2", "lost_pulses"), 3.0);
    assert_eq!(number(&found, "camera2", "unread_trains"), 1.0);
    assert_eq!(number(&found, "camera2", "extra_pulses"), 0.0);
    assert_eq!(
        kinds_and_subjects(&found),
        [(EvidenceKind::TriggerFault, "camera2")]
    );
}

#[test]
fn a_noisy_line_shows_lost_and_extra_pulses() {
    let mut bench = bench(vec![fault(RigFault::LineNoisy(CameraId::One), 0.0)]);
    bench.config.fault_sizes.line_noise = LineNoise {
        lost_percent: 3,
        doubled_percent: 2,
        spurious_percent: 3,
    };
    let found = bench.run_check(LOOPBACK);
    // 1280 edges plus sync trains: 3 % lost over nearly as many pulses, and 5 % extra.
    let (lost, extra) = (
        number(&found, "camera1", "lost_pulses"),
        number(&found, "camera1", "extra_pulses"),
    );
    assert!((15.0..75.0).contains(&lost), "{lost}");
    assert!((35.0..110.0).contains(&extra), "{extra}");
    assert_eq!(number(&found, "camera2", "lost_pulses"), 0.0);
    assert_eq!(
        kinds_and_subjects(&found),
        [(EvidenceKind::TriggerFault, "camera1")]
    );
}

#[test]
fn a_mark_that_is_not_sent_counts_as_lost_and_a_doubled_one_as_extra() {
    let found = bench(vec![fault(RigFault::TriggerLost, 0.5)]).run_check(LOOPBACK);
    for camera in CAMERAS {
        assert_eq!(number(&found, camera, "lost_pulses"), 32.0);
        assert_eq!(number(&found, camera, "unread_trains"), 1.0);
    }
    let found = bench(vec![fault(RigFault::TriggerDoubled, 0.5)]).run_check(LOOPBACK);
    for camera in CAMERAS {
        assert_eq!(number(&found, camera, "lost_pulses"), 0.0);
        assert_eq!(number(&found, camera, "extra_pulses"), 64.0);
    }
}

#[test]
fn a_line_that_is_not_connected_loses_everything() {
    let mut bench = bench(Vec::new());
    for camera in &mut bench.rig.cameras {
        camera.trigger_channel = 7; // not connected
    }
    let found = bench.run_check(LOOPBACK);
    for camera in CAMERAS {
        assert_eq!(number(&found, camera, "lost_pulses"), 640.0);
        assert_eq!(number(&found, camera, "unread_trains"), 20.0);
        assert_eq!(value(&found, camera, "jitter").value, None);
    }
    let kind = EvidenceKind::TriggerFault;
    assert_eq!(
        kinds_and_subjects(&found),
        [(kind, "camera1"), (kind, "camera2")]
    );
}

#[test]
fn without_a_box_the_checks_do_not_apply_and_a_lost_box_is_reported() {
    let mut without = bench(Vec::new());
    without.rig.trigger_box = None;
    for check in [LOOPBACK, CLOCKS] {
        let found = without.run_check(check);
        assert!(
            found.not_applicable.is_some() && found.values.is_empty(),
            "{found:?}"
        );
        for seconds in [0.0, 0.8] {
            let lost = bench(vec![fault(RigFault::BoxSilent, seconds)]).run_check(check);
            assert_eq!(
                kinds_and_subjects(&lost),
                [(EvidenceKind::DeviceLost, "trigger box")]
            );
            // The box's own trains give the offset between the cameras.
            let of_cameras = lost.values.iter().filter(|v| v.metric != "offset");
            assert!(of_cameras.clone().all(|v| v.value.is_none()), "{lost:?}");
            assert!(of_cameras.count() >= 4, "{lost:?}");
        }
    }
}

#[test]
fn drifts_are_those_of_the_clocks_within_the_stated_interval() {
    let mut bench = bench(Vec::new());
    let found = bench.run_check(CLOCKS);
    assert_eq!(found.evidence, []);
    for (camera, id) in CAMERAS.into_iter().zip(CameraId::ALL) {
        let drift = value(&found, camera, "drift");
        let truth = bench.drift_ppm(id);
        let [low, high] = drift.interval.unwrap();
        assert!(
            low < truth && truth < high && high - low < 0.5,
            "{drift:?}, {truth}"
        );
        assert!(drift.n >= Some(50), "{drift:?}");
        // Each edge has a uniform delay of 0 to 2.5 µs, and both clocks tick in microseconds.
        let residual = number(&found, camera, "residual");
        assert!((0.4e-6..1.5e-6).contains(&residual), "{residual}");
    }
    // Origins of up to 100 s.
    assert!(number(&found, "camera1", "offset").abs() < 100.0);
}

#[test]
fn a_clock_that_jumps_leaves_a_residual() {
    let mut bench = bench(vec![fault(RigFault::CameraClockStep(CameraId::Two), 5.0)]);
    bench.config.fault_sizes.clock_step_us = 700;
    let found = bench.run_check(CLOCKS);
    assert!(number(&found, "camera1", "residual") < 2e-6);
    let residual = value(&found, "camera2", "residual");
    assert!(residual.value > Some(100e-6), "{residual:?}");
}

#[test]
fn a_silent_or_unplugged_camera_does_not_affect_the_other_one() {
    for kind in [RigFault::CameraStalled, RigFault::CameraUnplugged] {
        let mut bench = bench(vec![fault(kind(CameraId::One), 1.0)]);
        let found = bench.run_check(CLOCKS);
        assert_eq!(
            kinds_and_subjects(&found),
            [(EvidenceKind::DeviceLost, "camera1")]
        );
        assert_eq!(value(&found, "camera1", "drift").value, None);
        assert_eq!(value(&found, "camera1", "residual").value, None);
        assert!(number(&found, "camera2", "residual") < 2e-6);
        // The lost camera must be reopened.
        assert!(bench.devices.unwrap().cameras[0].is_err());
    }
}

#[test]
fn a_check_returns_soon_after_a_stop_request() {
    use skinrig_hil::Bench as _;
    let mut bench = bench(Vec::new());
    bench.stop = true;
    for check in [
        "clocks: {duration: 1 h, drift: {at_least: -1 ppm, at_most: 1 ppm}}",
        "trigger_loopback: {trains: 10000, jitter: {at_most: 1 us}}",
        "idle: {duration: 1 h, gaps: {at_most: 0}}",
    ] {
        bench.run_check(check);
    }
    let now = bench.devices().clock.now();
    assert!(now < HostTime::from_secs_f64(10.0), "{now}");
}
