//! Coded trains and clocks.

use skinrig_model::{CameraId, HostTime, SimLevel};
use skinrig_nightly::EvidenceKind;
use skinrig_sim::{Fault, MarkFate, When};

use crate::bench::{SimBench, number, seen, value};

const LOOPBACK: &str = "trigger_loopback: {trains: 20, lost_pulses: {at_most: 0}}";
const CLOCKS: &str = "clocks: {duration: 10 s, drift: {at_most: 1 ppm}}";
const CAMERAS: [&str; 2] = ["camera1", "camera2"];

fn bench(faults: Vec<Fault>) -> SimBench {
    SimBench::new(SimLevel::Kinematic, faults)
}

fn at(seconds: f64) -> When {
    When::At(HostTime::from_secs_f64(seconds))
}

#[test]
fn a_sound_line_loses_and_invents_nothing_and_its_jitter_is_the_inputs() {
    let found = bench(Vec::new()).make(LOOPBACK);
    assert_eq!(found.evidence, []);
    for camera in CAMERAS {
        for metric in ["lost_pulses", "extra_pulses", "unread_trains"] {
            assert_eq!(number(&found, camera, metric), 0.0, "{camera} {metric}");
        }
        // Late by 0 to 2.5 µs evenly, and two clocks that show whole µs.
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
    // Two pulses of bits, and a start pulse, without which a train cannot be read.
    let found = bench(vec![lost(3, 8), lost(11, 31), lost(15, 0)]).make(LOOPBACK);
    assert_eq!(number(&found, "camera1", "lost_pulses"), 0.0);
    assert_eq!(number(&found, "camera2", "lost_pulses"), 3.0);
    assert_eq!(number(&found, "camera2", "unread_trains"), 1.0);
    assert_eq!(number(&found, "camera2", "extra_pulses"), 0.0);
    assert_eq!(seen(&found), [(EvidenceKind::TriggerFault, "camera2")]);
}

#[test]
fn a_noisy_line_shows_lost_and_extra_pulses() {
    let noisy = Fault::NoisyLine {
        camera: CameraId::One,
        lost_percent: 3,
        doubled_percent: 2,
        spurious_percent: 3,
    };
    let found = bench(vec![noisy]).make(LOOPBACK);
    // Of 1280 edges and those of sync trains: 3 % lost, on nearly as many pulses, and 5 % too many.
    let (lost, extra) = (
        number(&found, "camera1", "lost_pulses"),
        number(&found, "camera1", "extra_pulses"),
    );
    assert!((15.0..75.0).contains(&lost), "{lost}");
    assert!((35.0..110.0).contains(&extra), "{extra}");
    assert_eq!(number(&found, "camera2", "lost_pulses"), 0.0);
    assert_eq!(seen(&found), [(EvidenceKind::TriggerFault, "camera1")]);
}

#[test]
fn a_mark_that_reaches_nobody_is_lost_and_one_that_comes_twice_is_too_many() {
    let fate = |fate, s| Fault::Mark { fate, when: at(s) };
    let found = bench(vec![fate(MarkFate::Lost, 0.5)]).make(LOOPBACK);
    for camera in CAMERAS {
        assert_eq!(number(&found, camera, "lost_pulses"), 32.0);
        assert_eq!(number(&found, camera, "unread_trains"), 1.0);
    }
    let found = bench(vec![fate(MarkFate::Doubled, 0.5)]).make(LOOPBACK);
    for camera in CAMERAS {
        assert_eq!(number(&found, camera, "lost_pulses"), 0.0);
        assert_eq!(number(&found, camera, "extra_pulses"), 64.0);
    }
}

#[test]
fn a_line_that_is_not_connected_loses_everything() {
    let mut bench = bench(Vec::new());
    for camera in &mut bench.rig.cameras {
        camera.trigger_channel = 7; // nothing is wired to it
    }
    let found = bench.make(LOOPBACK);
    for camera in CAMERAS {
        assert_eq!(number(&found, camera, "lost_pulses"), 640.0);
        assert_eq!(number(&found, camera, "unread_trains"), 20.0);
        assert_eq!(value(&found, camera, "jitter").value, None);
    }
    let kind = EvidenceKind::TriggerFault;
    assert_eq!(seen(&found), [(kind, "camera1"), (kind, "camera2")]);
}

#[test]
fn without_a_box_there_is_nothing_to_check_and_a_lost_one_is_told() {
    let mut without = bench(Vec::new());
    without.rig.trigger_box = None;
    for check in [LOOPBACK, CLOCKS] {
        let found = without.make(check);
        assert!(
            found.not_here.is_some() && found.values.is_empty(),
            "{found:?}"
        );
        for when in [at(0.0), at(0.8)] {
            let lost = bench(vec![Fault::TriggerBoxLost(when)]).make(check);
            assert_eq!(seen(&lost), [(EvidenceKind::DeviceLost, "trigger box")]);
            // When the cameras started against each other is known from the box's own trains.
            let of_cameras = lost.values.iter().filter(|v| v.metric != "offset");
            assert!(of_cameras.clone().all(|v| v.value.is_none()), "{lost:?}");
            assert!(of_cameras.count() >= 4, "{lost:?}");
        }
    }
}

#[test]
fn drifts_are_those_of_the_clocks_within_the_stated_interval() {
    let mut bench = bench(Vec::new());
    let found = bench.make(CLOCKS);
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
        // One edge, late by 0 to 2.5 µs evenly, in whole µs, over whole µs of the box.
        let residual = number(&found, camera, "residual");
        assert!((0.4e-6..1.5e-6).contains(&residual), "{residual}");
    }
    // Origins of up to 100 s.
    assert!(number(&found, "camera1", "offset").abs() < 100.0);
}

#[test]
fn a_clock_that_jumps_leaves_a_residual() {
    let step = Fault::ClockStep {
        camera: CameraId::Two,
        when: at(5.0),
        by_us: 700,
    };
    let found = bench(vec![step]).make(CLOCKS);
    assert!(number(&found, "camera1", "residual") < 2e-6);
    let residual = value(&found, "camera2", "residual");
    assert!(residual.value > Some(100e-6), "{residual:?}");
}

#[test]
fn a_camera_that_falls_silent_or_is_unplugged_leaves_the_other_measured() {
    let camera = CameraId::One;
    for fault in [
        Fault::CameraStalled {
            camera,
            when: at(1.0),
        },
        Fault::CameraUnplugged {
            camera,
            when: at(1.0),
        },
    ] {
        let mut bench = bench(vec![fault]);
        let found = bench.make(CLOCKS);
        assert_eq!(seen(&found), [(EvidenceKind::DeviceLost, "camera1")]);
        assert_eq!(value(&found, "camera1", "drift").value, None);
        assert_eq!(value(&found, "camera1", "residual").value, None);
        assert!(number(&found, "camera2", "residual") < 2e-6);
        // It is to be opened again.
        assert!(bench.devices.unwrap().cameras[0].is_err());
    }
}

#[test]
fn a_check_comes_back_when_everything_is_to_end() {
    use skinrig_hil::Bench as _;
    let mut bench = bench(Vec::new());
    bench.ends = true;
    for check in [
        "clocks: {duration: 1 h, drift: {at_most: 1 ppm}}",
        "trigger_loopback: {trains: 10000, jitter: {at_most: 1 us}}",
        "idle: {duration: 1 h, gaps: {at_most: 0}}",
    ] {
        bench.make(check);
    }
    let now = bench.devices().clock.now();
    assert!(now < HostTime::from_secs_f64(10.0), "{now}");
}
