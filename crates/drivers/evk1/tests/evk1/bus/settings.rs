//! Register writes of the driver, checked by a camera model built without the driver's tables.

use skinrig_device::{CameraSettings, DeviceError, EventCamera, NoiseFilter, Roi, SyncMode};
use skinrig_emulated_camera::control::DeviceCommand;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_formats::Decoder;
use skinrig_model::StreamFormat;

use crate::bus::bench::{FIRST, bytes, events, noise, open, until};

/// Power on, standalone, clocked, host interface on: the last value of each register in the EVK1 reference, section 2.6.
const INITIALISED: [(u32, u32); 8] = [
    (0x0000, 0x000c_1117),
    (0x0008, 0x0000_0920),
    (0x0034, 0x0000_0280),
    (0x0036, 0x0000_01e0),
    (0x0148, 0x0000_0004),
    (0x0238, 0x0000_0001),
    (0x0240, 0x0014_0501),
    (0x074c, 0x0000_0002),
];

/// The stock biases, and two registers of the initialisation that are not biases (sections 2.6 and 2.9).
const BIASES: [(u32, u32); 8] = [
    (0x0300, 0x5900_00b0),
    (0x034c, 0x7900_001e),
    (0x0350, 0x7900_0035),
    (0x0358, 0x7100_3d00),
    (0x035c, 0x5103_4f00),
    (0x0360, 0x5100_4f00),
    (0x0364, 0x5100_0100),
    (0x0368, 0x6101_3100),
];

#[test]
fn registers_match_the_reference_at_every_stage() {
    let test = "bus::settings::registers_match_the_reference_at_every_stage";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let value = |address| remote.register(FIRST, address).unwrap();
        let expect = |stage: &str, values: &[(u32, u32)]| {
            for &(address, expected) in values {
                let found = value(address);
                assert_eq!(found, expected, "{stage}: {address:#06x} is {found:#010x}");
            }
        };
        let mut camera = open(FIRST);
        let settings = CameraSettings {
            trigger_channels: vec![0, 7],
            ..CameraSettings::default()
        };
        camera.configure(&settings).unwrap();
        expect("configured", &INITIALISED);
        expect("configured", &BIASES);
        let columns = (0..20).map(|n| (0x0400 + 4 * n, u32::MAX));
        let rows = (0..15).map(|n| (0x0500 + 4 * n, u32::MAX));
        expect("configured", &columns.chain(rows).collect::<Vec<_>>());
        expect(
            "configured",
            &[(0x0450, 0), (0x053c, 0), (0x01a0, 1 | 1 << 7)],
        );
        assert_eq!(value(0x0204) & 0b1010, 0b0010, "pixels in reset");
        camera.start().unwrap();
        expect(
            "started",
            &[(0x0008, 0x0b20), (0x0248, 0xc8), (0x024c, 0x0019_0032)],
        );
        assert_eq!(value(0x0204) & 0b1010, 0b1010, "pixels released");
        camera.stop(&mut Vec::new()).unwrap();
        expect("stopped", &[(0x0008, 0x0920)]);
        assert_eq!(value(0x0204) & 0b1000, 0, "pixels in reset");
        camera.close().unwrap();
        assert_eq!(value(0x0000) & 0b1111, 0, "powered down");
        expect("closed", &[(0x0238, 0), (0x074c, 0)]);
    });
}

#[test]
fn region_biases_and_filter_reach_the_registers_and_the_stream() {
    let test = "bus::settings::region_biases_and_filter_reach_the_registers_and_the_stream";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let value = |address| remote.register(FIRST, address).unwrap();
        let mut camera = open(FIRST);
        let settings = CameraSettings {
            noise_filter: Some(NoiseFilter {
                min_rate_ev_s: 10_000,
            }),
            // Without a contrast threshold for OFF there are no OFF events (seen on a real EVK1, section 2.9).
            biases: [("bias_diff_off".to_owned(), 0)].into(),
            roi: Some(Roi {
                x: 100,
                y: 50,
                width: 300,
                height: 200,
            }),
            ..CameraSettings::default()
        };
        camera.configure(&settings).unwrap();
        // Columns 100..=399 are bit 4 of word 3 to bit 15 of word 12; rows 50..=249 bit 18 of word 1 to bit 25 of word 7.
        assert_eq!([value(0x0408), value(0x040c)], [0, 0xffff_fff0]);
        assert_eq!([value(0x0430), value(0x0434)], [0x0000_ffff, 0]);
        assert_eq!([value(0x0500), value(0x0504)], [0, 0xfffc_0000]);
        assert_eq!([value(0x051c), value(0x0520)], [0x03ff_ffff, 0]);
        assert_eq!(value(0x034c), 0x7900_0000);
        camera.start().unwrap();
        assert_eq!(value(0x0248) & 1, 1, "the filter is on");
        let mut chunks = Vec::new();
        until(&mut camera, &mut chunks, |c| events(c) > 1_000).unwrap();
        let (mut observed, mut edges) = (Vec::new(), Vec::new());
        Decoder::new(StreamFormat::Evt2).push_cd(&bytes(&chunks), &mut observed, &mut edges);
        let inside = |x: u16, y: u16| (100..400).contains(&x) && (50..250).contains(&y);
        assert!(observed.iter().all(|e| inside(e.x, e.y)));
        let on: u64 = chunks.iter().map(|c| c.facts.on_events).sum();
        assert_eq!(on, events(&chunks));
    });
}

#[test]
fn a_register_that_cannot_be_read_has_no_value() {
    let test = "bus::settings::a_register_that_cannot_be_read_has_no_value";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        remote.order(FIRST, DeviceCommand::FailReads(true)).unwrap();
        let settings = CameraSettings {
            sync: SyncMode::Master,
            ..CameraSettings::default()
        };
        match camera.configure(&settings) {
            Err(DeviceError::Lost { serial, detail, .. }) => {
                assert_eq!(serial, FIRST);
                assert!(detail.contains("0x40"), "{detail}");
            }
            other => panic!("{other:?}"),
        }
    });
}

#[test]
fn temperature_is_readable_in_every_state() {
    let test = "bus::settings::temperature_is_readable_in_every_state";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        assert_eq!(camera.temperature_c().unwrap(), Some(25.0));
        camera.start().unwrap();
        // Bits beyond the field are not part of it.
        let steps = 61 << 12 | 1 << 10;
        remote
            .order(FIRST, DeviceCommand::Temperature(1 << 30 | steps))
            .unwrap();
        assert_eq!(camera.temperature_c().unwrap(), Some(61.25));
        camera.stop(&mut Vec::new()).unwrap();
        remote.order(FIRST, DeviceCommand::FailReads(true)).unwrap();
        let lost = camera.temperature_c().unwrap_err();
        assert!(lost.to_string().contains("EVK_EXT_TEMP_VALUE"), "{lost}");
        remote
            .order(FIRST, DeviceCommand::FailReads(false))
            .unwrap();
    });
}
