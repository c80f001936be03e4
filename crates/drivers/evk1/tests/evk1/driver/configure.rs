//! Settings: written completely or not at all, read back, and checked against the camera's limits.

use skinrig_device::{CameraSettings, DeviceError, EventCamera, NoiseFilter, Roi, SyncMode};
use skinrig_evk1::registers as r;
use skinrig_evk1::{Evk1, Evk1Config, TriggerOut};

use super::model::Bench;

const PULSES: TriggerOut = TriggerOut {
    period_us: 100_000,
    width_us: 50_000,
};

fn opened() -> (Bench, Evk1) {
    let bench = Bench::new();
    let camera = bench.open().unwrap();
    bench.trace();
    (bench, camera)
}

fn sync(sync: SyncMode, channels: &[u8]) -> CameraSettings {
    CameraSettings {
        sync,
        trigger_channels: channels.to_vec(),
        ..CameraSettings::default()
    }
}

#[test]
fn every_setting_is_reported_as_read_from_the_registers() {
    let (bench, mut camera) = opened();
    let settings = CameraSettings {
        sync: SyncMode::Master,
        noise_filter: Some(NoiseFilter {
            min_rate_ev_s: 25_000,
        }),
        biases: [
            ("bias_diff_on".to_owned(), 400),
            ("bias_pr".to_owned(), 1100),
        ]
        .into(),
        roi: Some(Roi {
            x: 100,
            y: 50,
            width: 300,
            height: 200,
        }),
        trigger_channels: vec![7, 0],
    };
    let read = camera.configure(&settings).unwrap();
    let lines: Vec<String> = read
        .iter()
        .map(|s| format!("{}: {} / {}", s.name, s.requested, s.read_back))
        .collect();
    insta::assert_snapshot!(lines.join("\n"), @r"
bias_diff: 299 / 299
bias_diff_off: 221 / 221
bias_diff_on: 400 / 400
bias_fo: 1477 / 1477
bias_hpf: 1499 / 1499
bias_pr: 1100 / 1100
bias_refr: 1500 / 1500
roi: 300 x 200 at (100, 50) / 300 x 200 at (100, 50)
trigger_channels: 0,7 / 0,7
sync: master / master
noise_filter: below 26 events in 1023 µs / below 26 events in 1023 µs
");
    insta::assert_snapshot!("configure", bench.trace());
}

#[test]
fn a_readback_mismatch_is_named() {
    let (bench, mut camera) = opened();
    bench.model().faults.stuck_at_zero = [(r::roi_x(3).address, 1 << 4)].into();
    let error = camera.configure(&CameraSettings::default()).unwrap_err();
    assert!(matches!(error, DeviceError::ReadBack { .. }));
    insta::assert_snapshot!(error, @r"
camera 1 00001621: td_roi_x (0x040c): expected 0xffffffff after writing, found 0xffffffef
");
}

#[test]
fn a_tolerated_readback_mismatch_passes_and_is_still_shown() {
    let bench = Bench::new();
    bench.model().faults.stuck_at_zero = [(r::roi_x(3).address, 1 << 4)].into();
    let refused = bench.open().err().expect("no exception, no camera");
    insta::assert_snapshot!(refused, @r"
td_roi_x (0x040c): expected 0xffffffff after writing, found 0xffffffef: power the camera off and on; if every camera of this model reads differently at this address, add it to `read_back_exceptions`
");
    let mut camera = bench
        .open_with(Evk1Config {
            read_back_exceptions: vec![r::roi_x(3).address],
            ..Evk1Config::default()
        })
        .unwrap();
    let read = camera.configure(&CameraSettings::default()).unwrap();
    let roi = read.iter().find(|s| s.name == "roi").unwrap();
    // An accepted deviation, not a difference that fails the preflight.
    assert!(!roi.was_requested(), "{roi:?}");
    let shown = "639 columns and 480 rows, not a rectangle (after writing all)";
    assert_eq!(roi.read_back, shown);
    // The exception applies to that register alone.
    let other = (r::EXT_TRIGGERS_ENABLE.address, 1 << 6);
    bench.model().faults.stuck_at_zero.extend([other]);
    let settings = sync(SyncMode::Standalone, &[6]);
    let error = camera.configure(&settings).unwrap_err();
    assert!(matches!(error, DeviceError::ReadBack { .. }));
}

#[test]
fn rejected_settings_write_nothing() {
    let (bench, mut camera) = opened();
    camera.set_trigger_out(Some(PULSES)).unwrap();
    bench.trace();
    let mut errors = Vec::new();
    for settings in [
        sync(SyncMode::Slave, &[0, 7]),
        sync(SyncMode::Master, &[0]),
        sync(SyncMode::Standalone, &[1]),
        CameraSettings {
            noise_filter: Some(NoiseFilter {
                min_rate_ev_s: 9_999,
            }),
            ..CameraSettings::default()
        },
        CameraSettings {
            biases: [("bias_diff_on".to_owned(), 373)].into(),
            ..CameraSettings::default()
        },
    ] {
        let error = camera.configure(&settings).unwrap_err();
        assert!(matches!(error, DeviceError::Refused { .. }), "{error}");
        errors.push(error.to_string());
    }
    assert_eq!(bench.writes(), []);
    insta::assert_snapshot!(errors.join("\n"), @r"
camera 1 00001621: refused: expected trigger channel 0 or 6 for a slave, whose sync clock comes on the line of channel 7, found channel 7
camera 1 00001621: refused: expected a master's trigger output off: its line carries the sync clock, found it on
camera 1 00001621: refused: expected trigger channel 0, 6 or 7, found 1
camera 1 00001621: refused: expected a noise filter threshold of 10000 to 10000000 events/s, found 9999
camera 1 00001621: refused: expected bias_diff_on >= bias_diff + 75 = 374 mV with bias_diff 299 mV and bias_fo 1477 mV (not below 1350), found 373 mV
");
}

#[test]
fn the_three_sync_modes_set_their_bits() {
    let (bench, mut camera) = opened();
    for (mode, bits) in [
        (SyncMode::Slave, (0, 1)),
        (SyncMode::Master, (1, 1)),
        (SyncMode::Standalone, (1, 0)),
    ] {
        camera.configure(&sync(mode, &[0])).unwrap();
        let model = bench.model();
        assert_eq!(
            (model.get(r::MASTER_MODE), model.get(r::USE_EXT_START)),
            bits
        );
    }
}

/// The auxiliary input is never enabled on a line that carries the sync clock.
#[test]
fn the_auxiliary_input_is_off_while_the_mode_changes() {
    let (bench, mut camera) = opened();
    camera.configure(&sync(SyncMode::Standalone, &[7])).unwrap();
    camera.configure(&sync(SyncMode::Slave, &[])).unwrap();
    camera.configure(&sync(SyncMode::Standalone, &[7])).unwrap();
    let (mut slave, mut enabled) = (false, false);
    for (address, word) in bench.writes() {
        if address == r::ATIS_CONTROL.address {
            slave = r::MASTER_MODE.of(word) == 0;
        } else if address == r::EXT_TRIGGERS_ENABLE.address {
            enabled = r::trigger_input(7).of(word) == 1;
        }
        assert!(!(slave && enabled));
    }
    assert!(enabled);
}

#[test]
fn trigger_output_pulses_unless_the_camera_is_master() {
    let (bench, mut camera) = opened();
    camera.set_trigger_out(Some(PULSES)).unwrap();
    let word = |register| bench.model().word(register);
    assert_eq!(word(r::EXT_SYNC_OUT_MODE), 1);
    assert_eq!(word(r::EXT_TRIGGERS_OUT_ENABLE), 1);
    assert_eq!(word(r::OUT_PULSE_PERIOD), 100_000);
    assert_eq!(word(r::OUT_PULSE_WIDTH), 50_000);
    camera.set_trigger_out(None).unwrap();
    assert_eq!(word(r::EXT_SYNC_OUT_MODE), 0);
    assert_eq!(word(r::EXT_TRIGGERS_OUT_ENABLE), 0);
    camera.configure(&sync(SyncMode::Master, &[])).unwrap();
    camera.set_trigger_out(Some(PULSES)).unwrap_err();
    for (period_us, width_us) in [(1, 1), (100, 0), (100, 100), (3_600_000_001, 1)] {
        let bad = TriggerOut {
            period_us,
            width_us,
        };
        bad.check().unwrap_err();
    }
}

/// Lowering `bias_fo` tightens the interlocks, raising it loosens them: no single write may violate one.
#[test]
fn interlocks_hold_after_every_single_write() {
    let (bench, mut camera) = opened();
    let set = |values: &[(&str, i64)]| CameraSettings {
        biases: values.iter().map(|&(n, v)| (n.to_owned(), v)).collect(),
        ..CameraSettings::default()
    };
    let near = set(&[("bias_diff_on", 374), ("bias_diff_off", 234)]);
    let fast = set(&[
        ("bias_fo", 1300),
        ("bias_diff_on", 394),
        ("bias_diff_off", 214),
    ]);
    let (on, off, fo) = (
        r::bias_generator(20).address,
        r::bias_generator(19).address,
        r::bias_generator(22).address,
    );
    camera.configure(&near).unwrap();
    bench.trace();
    let mut now = bench.model().registers.clone();
    for settings in [&fast, &near] {
        camera.configure(settings).unwrap();
        for (address, word) in bench.writes() {
            now.insert(address, word);
            // Codes of 1350, 394 and 214 mV.
            if now[&fo] >> 8 & 0x1fff > 91 {
                assert!(
                    now[&on] & 0xff >= 0x36 && now[&off] & 0xff <= 0x1d,
                    "{now:?}"
                );
            }
        }
    }
}

#[test]
fn an_active_pattern_is_switched_off_before_streaming() {
    let bench = Bench::new();
    bench
        .model()
        .registers
        .insert(r::TEST_PATTERN_CONTROL.address, 0x1001);
    let _camera = bench.open().unwrap();
    let found = bench.model().registers[&r::TEST_PATTERN_CONTROL.address];
    assert_eq!(found, 0x1000);
}
