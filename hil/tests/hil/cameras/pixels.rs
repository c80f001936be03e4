//! Checks `idle`, `test_pattern` and `noise_*`.

use skinrig_device::DeviceError;
use skinrig_model::{CameraId, DeviceRole, HostTime, RigFault, SimLevel};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::Light;
use skinrig_sim::faults::{STORM_PER_MS, STORM_PIXELS};
use skinrig_sim::{Fault, FaultTrigger};

use crate::cameras::bench::{SimBench, kinds_and_subjects, number, value};

const IDLE: &str = "idle: {duration: 2 s, gaps: {at_most: 0}}";
const PATTERN: &str = "test_pattern: {duration: 1 s, rate: 1 Mev/s, received: {at_least: 99 %}}";
const LIT: &str = "noise_lit: {duration: 4 s, hot_above: 20 ev/s, rate: {at_most: 1 Mev/s}}";
const DARK: &str = "noise_dark: {duration: 1 s, hot_above: 20 ev/s, rate: {at_most: 1 Mev/s}}";
const CAMERAS: [&str; 2] = ["camera1", "camera2"];

/// A fault of camera 2.
fn fault(kind: fn(CameraId) -> RigFault, seconds: f64) -> Fault {
    let when = FaultTrigger::At(HostTime::from_secs_f64(seconds));
    Fault::new(kind(CameraId::Two), when).unwrap()
}

/// A bench whose camera 2 loses 1,000 bytes at each of these times.
fn lossy(seconds: &[f64]) -> SimBench {
    let drops = seconds.iter().map(|s| fault(RigFault::CameraDrops, *s));
    let mut bench = SimBench::new(SimLevel::Kinematic, drops.collect());
    bench.config.fault_sizes.lost_words = 250;
    bench
}

#[test]
fn a_quiet_stream_has_its_rate_and_no_gap() {
    // The stream has only its time base: one word of 4 bytes every 16 µs.
    let found = SimBench::new(SimLevel::Kinematic, Vec::new()).run_check(IDLE);
    assert_eq!(found.evidence, []);
    for camera in CAMERAS {
        let rate = number(&found, camera, "data_rate");
        assert!((rate / 250e3 - 1.0).abs() < 0.01, "{rate}");
        assert_eq!(number(&found, camera, "lost"), 0.0);
        assert_eq!(number(&found, camera, "gaps"), 0.0);
    }
}

#[test]
fn lost_bytes_are_counted_on_their_camera() {
    let found = lossy(&[1.0, 0.2]).run_check(IDLE);
    assert_eq!(number(&found, "camera1", "lost"), 0.0);
    // Losses before counting starts do not count.
    assert_eq!(number(&found, "camera2", "lost"), 1000.0);
    assert_eq!(number(&found, "camera2", "gaps"), 1.0);
    assert_eq!(
        kinds_and_subjects(&found),
        [(EvidenceKind::DataLost, "camera2")]
    );
}

#[test]
fn a_stalled_camera_ends_the_wait() {
    // So late that only the end of the check can detect it.
    let stalled = fault(RigFault::CameraStalled, 2.3);
    for (check, metric) in [(IDLE, "gaps"), (PATTERN, "received"), (LIT, "rate")] {
        let mut faults = vec![stalled];
        if check == PATTERN {
            faults = vec![fault(RigFault::CameraStalled, 1.4)];
        }
        let found = SimBench::new(SimLevel::Kinematic, faults).run_check(check);
        assert_eq!(
            kinds_and_subjects(&found),
            [(EvidenceKind::DeviceLost, "camera2")],
            "{check}"
        );
        assert_eq!(value(&found, "camera2", metric).value, None);
        assert!(value(&found, "camera1", metric).value.is_some());
    }
}

#[test]
fn the_pattern_arrives_completely_and_is_switched_off_afterwards() {
    let mut bench = SimBench::new(SimLevel::Kinematic, Vec::new());
    let found = bench.run_check(PATTERN);
    assert_eq!(found.evidence, []);
    for camera in CAMERAS {
        let received = number(&found, camera, "received");
        assert!((received - 100.0).abs() < 0.2, "{received}");
        assert_eq!(number(&found, camera, "gaps"), 0.0);
    }
    let after = bench.run_check(LIT);
    assert_eq!(
        number(&after, "camera1", "rate"),
        0.0,
        "a kinematic camera has no pixels"
    );
}

#[test]
fn losses_in_the_pattern_show_in_every_metric() {
    let found = lossy(&[1.0]).run_check(PATTERN);
    assert_eq!(number(&found, "camera2", "lost"), 1000.0);
    assert!(number(&found, "camera2", "gaps") >= 1.0);
    assert!(number(&found, "camera2", "received") < 99.99);
    assert_eq!(
        kinds_and_subjects(&found),
        [(EvidenceKind::DataLost, "camera2")]
    );
}

#[test]
fn noise_and_hot_pixels_are_those_of_the_scene() {
    let mut bench = SimBench::new(SimLevel::Geometric, Vec::new());
    let g = bench.config.geometric.clone();
    let found = bench.run_check(LIT);
    assert_eq!(found.evidence, []);
    for camera in CAMERAS {
        let hot = number(&found, camera, "hot_pixels");
        assert!(hot >= 1.0 && hot <= g.hot_pixels as f64, "{hot}");
        let hottest = number(&found, camera, "hottest");
        assert!(
            (hottest / g.hottest_hz - 1.0).abs() < 0.3,
            "hottest pixel: {hottest} ev/s, expected about {}",
            g.hottest_hz
        );
        let rate = value(&found, camera, "rate");
        assert!(
            rate.note.is_some(),
            "the lamps could not be switched: {rate:?}"
        );
    }
}

#[test]
fn a_storm_of_hot_pixels_is_counted_pixel_by_pixel() {
    let storm = fault(RigFault::CameraStorm, 2.0);
    let found = SimBench::new(SimLevel::Kinematic, vec![storm]).run_check(LIT);
    assert_eq!(number(&found, "camera1", "hot_pixels"), 0.0);
    assert_eq!(
        number(&found, "camera2", "hot_pixels"),
        f64::from(STORM_PIXELS)
    );
    // 300 ms of the storm within 4 s.
    let hottest = number(&found, "camera2", "hottest");
    let expected = STORM_PER_MS as f64 * 300.0 / 4.0;
    assert!(
        (hottest / expected - 1.0).abs() < 0.05,
        "{hottest}, {expected}"
    );
}

#[test]
fn noise_in_the_dark_needs_working_lamps_and_switches_them_on_again() {
    let mut bench = SimBench::new(SimLevel::Kinematic, Vec::new());
    let found = bench.run_check(DARK);
    assert!(
        found
            .not_applicable
            .is_some_and(|why| why.contains("hil.light"))
    );
    bench.lamps = Ok(true);
    bench.switched.clear();
    let found = bench.run_check(DARK);
    assert_eq!(number(&found, "camera1", "rate"), 0.0);
    assert_eq!(value(&found, "camera1", "rate").note, None);
    assert_eq!(bench.switched, [Light::Dark, Light::Lit]);
    let refused = Evidence::new(EvidenceKind::State, "computer", "the program failed");
    bench.lamps = Err(Box::new(refused));
    let found = bench.run_check(DARK);
    assert_eq!(
        kinds_and_subjects(&found),
        [(EvidenceKind::State, "computer")]
    );
    assert_eq!(value(&found, "camera2", "hot_pixels").value, None);
}

#[test]
fn a_camera_that_cannot_be_opened_does_not_affect_the_other_one() {
    let mut bench = SimBench::new(SimLevel::Kinematic, Vec::new());
    bench.run_check(IDLE);
    let lost = DeviceError::Lost {
        role: DeviceRole::Camera1,
        serial: "00000001".to_owned(),
        detail: "unplugged".to_owned(),
    };
    bench.devices.as_mut().unwrap().cameras[0] =
        Err(skinrig_hil::device_evidence::from_error(&lost));
    for (check, metric) in [(IDLE, "lost"), (PATTERN, "received"), (LIT, "rate")] {
        let found = bench.run_check(check);
        assert_eq!(
            kinds_and_subjects(&found),
            [(EvidenceKind::DeviceLost, "camera1")],
            "{check}"
        );
        assert_eq!(value(&found, "camera1", metric).value, None);
        assert!(value(&found, "camera2", metric).value.is_some());
    }
}
