//! The ordered sequences, as golden traces and against the values that the public driver would write.

use skinrig_device::{CameraSettings, EventCamera};
use skinrig_evk1::access::Registers;
use skinrig_evk1::{registers as r, sequences};

use super::model::Bench;

#[test]
fn opening_follows_the_golden_trace() {
    let bench = Bench::new();
    let camera = bench.open().unwrap();
    insta::assert_snapshot!("open", bench.trace());
    assert_eq!(camera.identity().serial, "00001621");
    assert_eq!(camera.identity().firmware, "FPGA 3.0.0, FX3 1.3.2");
}

#[test]
fn start_stop_and_close_follow_the_golden_trace() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    bench.trace();
    camera.start().unwrap();
    camera.stop(&mut Vec::new()).unwrap();
    bench.model().left_over = 1500;
    camera.close().unwrap();
    insta::assert_snapshot!("start_stop_close", bench.trace());
}

#[test]
fn reading_the_temperature_takes_one_request() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    let sensor = r::EVK_EXT_TEMP_VALUE.address;
    bench.model().registers.insert(sensor, 0x0003_6c00);
    bench.trace();
    assert_eq!(camera.temperature_c().unwrap(), Some(54.75));
    insta::assert_snapshot!(bench.trace(), @"014c EVK_EXT_TEMP_VALUE is 00036c00");
}

/// The values that a device with the public defaults receives.
#[test]
fn the_fpga_receives_the_values_of_the_public_driver() {
    let mut bench = Bench::new();
    let other = bench.clone();
    sequences::init_fpga(&mut Registers::new(&mut bench, &[])).unwrap();
    let expected = [
        (0x0000, 0x0000_0000),
        (0x000a, 0x0),
        (0x000a, 0x1),
        (0x0000, 0x0000_0000), // TD_RSTN
        (0x0000, 0x0000_0000), // EM_RSTN
        (0x0000, 0x0000_0008),
        (0x0000, 0x0000_000a),
        (0x0000, 0x0000_000e),
        (0x0000, 0x0000_0006),
        (0x0000, 0x0000_1006), // MASTER_MODE
        (0x0000, 0x0000_1006), // USE_EXT_START
        (0x0008, 0x0000_0120),
        (0x0000, 0x0000_1016),
        (0x0000, 0x0000_1116),
        (0x0034, 0x0000_0280), // WIDTH
        (0x0034, 0x0000_0280), // ORIGIN
        (0x0036, 0x0000_01e0),
        (0x0008, 0x0000_0920),
        (0x074c, 0x0000_0002),
        (0x0000, 0x0000_1117),
        (0x0000, 0x0004_1117),
        (0x0000, 0x000c_1117),
        (0x0148, 0x0000_0004),
    ];
    assert_eq!(other.writes(), expected);
}

#[test]
fn the_sensor_receives_the_values_of_the_public_driver() {
    let mut bench = Bench::new();
    let other = bench.clone();
    sequences::init_sensor(&mut Registers::new(&mut bench, &[])).unwrap();
    let writes = other.writes();
    let last = |address: u32| writes.iter().rfind(|w| w.0 == address).map(|w| w.1);
    for (address, value) in [
        (0x0238, 0x1),
        (0x021c, 0x1000_0101),
        (0x0200, 0x1a),
        (0x0240, 0x0014_0501),
        (0x0300, 0x5900_00b0),
        (0x0304, 0x5900_00b0),
        (0x0208, 0x4002_03ff),
        (0x0244, 0x4002_03ff),
        (0x031c, 0x7900_00c0),
        (0x034c, 0x7900_001e),
        (0x0350, 0x7900_0035),
        (0x0354, 0x7900_0029),
        (0x0358, 0x7100_3d00),
        (0x0220, 0x1),
        (0x0450, 0),
        (0x053c, 0),
        (0x0204, 0x23),
    ] {
        assert_eq!(last(address), Some(value), "{address:#06x}");
    }
    // The contrast biases are in voltage mode at every moment.
    for (address, value) in writes {
        if (0x034c..=0x0354).contains(&address) {
            assert_eq!(value >> 27 & 1, 1, "{address:#06x} = {value:#010x}");
        }
    }
}

#[test]
fn start_and_stop_leave_the_values_of_the_public_driver() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    bench.trace();
    camera.start().unwrap();
    assert_eq!(bench.model().word(r::CCAM2_CONTROL), 0xb20);
    assert_eq!(bench.model().word(r::ROI_CTRL), 0x2b);
    assert_eq!(bench.model().word(r::NFL_THRESH), 0x0019_0032);
    assert_eq!(bench.model().word(r::NFL_CTRL), 0xc8);
    let swallowed: Vec<_> = bench
        .writes()
        .into_iter()
        .filter(|w| w.0 == 0x024c)
        .collect();
    assert_eq!(swallowed[1], (0x024c, 0x3fff | 0x0a << 14));
    camera.stop(&mut Vec::new()).unwrap();
    assert_eq!(bench.model().word(r::CCAM2_CONTROL), 0x920);
    assert_eq!(bench.model().word(r::ROI_CTRL), 0x23);
}

#[test]
fn inputs_are_enabled_again_before_each_start() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    let settings = CameraSettings {
        trigger_channels: vec![6, 0],
        ..CameraSettings::default()
    };
    camera.configure(&settings).unwrap();
    bench
        .model()
        .registers
        .insert(r::EXT_TRIGGERS_ENABLE.address, 0);
    camera.start().unwrap();
    assert_eq!(bench.model().word(r::EXT_TRIGGERS_ENABLE), 0x41);
}

#[test]
fn trigger_output_is_not_configured_on_an_fpga_without_one() {
    let bench = Bench::new();
    bench
        .model()
        .registers
        .insert(r::FPGA_VERSION.address, 0x0002_0900);
    let mut camera = bench.open().unwrap();
    let touched = [
        r::EXT_SYNC_OUT_MODE.address,
        r::EXT_TRIGGERS_OUT_ENABLE.address,
    ];
    assert!(bench.writes().iter().all(|w| !touched.contains(&w.0)));
    camera.set_trigger_out(None).unwrap();
    let pulses = skinrig_evk1::TriggerOut {
        period_us: 100_000,
        width_us: 50_000,
    };
    let error = camera.set_trigger_out(Some(pulses)).unwrap_err();
    insta::assert_snapshot!(error, @r"
expected FPGA version 3.0.0 or later for a trigger output, found FPGA 2.9.0, FX3 1.3.2
");
}
