//! Mismatches of a camera: rejected, accepted by a key of the rig file, or only reported when everything is tolerated.

use skinrig_device::{CameraSettings, EventCamera};
use skinrig_evk1::registers as r;
use skinrig_evk1::{Evk1Config, Tolerance};

use crate::driver::model::{Bench, Faults};

fn config(tolerance: Tolerance) -> Evk1Config {
    Evk1Config {
        tolerance,
        ..Evk1Config::default()
    }
}

fn everything() -> Evk1Config {
    config(Tolerance {
        everything: true,
        ..Tolerance::default()
    })
}

/// Rejected by default; opened without a note with the key that accepts it; opened with a note on that key when everything is
/// tolerated.
fn accepted_by(faults: &Faults, accepting: Evk1Config, key: &str) {
    let bench = |faults: &Faults| {
        let bench = Bench::new();
        bench.model().faults = faults.clone();
        bench
    };
    assert!(bench(faults).open().is_err(), "{key}");
    let mut opened = bench(faults).open_with(accepting).unwrap();
    assert_eq!(opened.mismatches(), [], "{key}");
    opened.configure(&CameraSettings::default()).unwrap();
    let mut opened = bench(faults).open_with(everything()).unwrap();
    let keys: Vec<String> = opened
        .mismatches()
        .into_iter()
        .map(|m| m.key.to_string())
        .collect();
    assert_eq!(keys, [key]);
    // It is part of the device's facts in the session.
    let settings = opened.configure(&CameraSettings::default()).unwrap();
    let named = settings
        .iter()
        .filter(|s| s.name == format!("tolerated: {key}"));
    assert_eq!(named.count(), 1, "{settings:?}");
}

#[test]
fn each_mismatch_is_rejected_until_its_own_key_accepts_it() {
    let status = Faults {
        read_status: Some(0),
        ..Faults::default()
    };
    let accepting = config(Tolerance {
        read_status: vec![0],
        ..Tolerance::default()
    });
    accepted_by(&status, accepting, "read_status: [\"0x00\"]");
    let reset = Faults {
        reset_fails: true,
        ..Faults::default()
    };
    let accepting = config(Tolerance {
        failed_reset: true,
        ..Tolerance::default()
    });
    accepted_by(&reset, accepting, "failed_reset: accepted");
    let stuck = Faults {
        stuck_at_zero: [(r::SPARE_CTRL.address, 1)].into(),
        ..Faults::default()
    };
    let accepting = Evk1Config {
        read_back_exceptions: vec![r::SPARE_CTRL.address],
        ..Evk1Config::default()
    };
    accepted_by(&stuck, accepting, "read_back_exceptions: [\"0x021c\"]");
}

/// The sensor is shut down before it is powered up, and may not reply until then.
#[test]
fn an_unpowered_sensor_need_not_reply() {
    let bench = Bench::new();
    bench.model().faults.mute_without_power = true;
    bench.model().registers.insert(r::ATIS_CONTROL.address, 0);
    let mut opened = bench.open().unwrap();
    opened.configure(&CameraSettings::default()).unwrap();
    assert_eq!(opened.mismatches(), []);
    opened.start().unwrap();
}

/// A camera without mismatches gives no notes.
#[test]
fn tolerance_alone_gives_no_notes() {
    let opened = Bench::new().open_with(everything()).unwrap();
    assert_eq!(opened.mismatches(), []);
}
