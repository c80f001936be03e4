//! The pattern generator: registers as in the reference, events in the pattern's order and rate.

use skinrig_device::{CameraSettings, DeviceError, EventCamera, NoiseFilter, Roi, TestPattern};
use skinrig_emulated_camera::control::DeviceCommand;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_formats::{Decoder, Geometry};
use skinrig_model::{CdEvent, RawChunk, StreamFormat};

use crate::bus::bench::{FIRST, events, noise, open, until};

const PATTERN: Option<TestPattern> = Some(TestPattern { rate_ev_s: 1e6 });

/// All events, including those outside the sensor.
fn decoded(chunks: &[RawChunk]) -> Vec<CdEvent> {
    let mut decoder = Decoder::with_geometry(StreamFormat::Evt2, Geometry::ANY);
    let (mut all, mut triggers) = (Vec::new(), Vec::new());
    for chunk in chunks {
        decoder.push_cd(&chunk.bytes, &mut all, &mut triggers);
    }
    all
}

#[test]
fn pattern_events_are_complete_and_in_order_for_all_sensor_settings() {
    let test = "bus::pattern::pattern_events_are_complete_and_in_order_for_all_sensor_settings";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let value = |address| remote.register(FIRST, address).unwrap();
        let mut camera = open(FIRST);
        // Both settings belong to the sensor, which the pattern replaces.
        let settings = CameraSettings {
            roi: Some(Roi {
                x: 10,
                y: 10,
                width: 20,
                height: 20,
            }),
            noise_filter: Some(NoiseFilter {
                min_rate_ev_s: 5_000_000,
            }),
            ..CameraSettings::default()
        };
        camera.configure(&settings).unwrap();
        let scan = camera.test_pattern(PATTERN).unwrap().unwrap();
        assert_eq!((scan.columns, scan.rows), (512, 1024));
        assert_eq!(scan.rate_ev_s, 10.0 / 1024.0 * 100e6);
        assert_eq!(value(0x0740), 0x1001);
        assert_eq!(value(0x0744), 30_720 << 16 | 10);
        assert_eq!(value(0x0748), 30_720 << 16 | 10);
        assert_eq!(value(0x0008) >> 11 & 1, 0, "rows beyond the sensor pass");
        camera.start().unwrap();
        let mut chunks = Vec::new();
        // More than one round of the scan.
        until(&mut camera, &mut chunks, |c| {
            c.iter().map(|c| c.bytes.len()).sum::<usize>() > 3_500_000
        })
        .unwrap();
        camera.stop(&mut chunks).unwrap();
        let all = decoded(&chunks);
        assert!(all.len() > 512 * 1024, "{}", all.len());
        let place = |e: &CdEvent| u32::from(e.x) * 1024 + u32::from(e.y);
        let broken = all
            .windows(2)
            .position(|w| place(&w[1]) != (place(&w[0]) + 1) % (512 * 1024));
        assert_eq!(broken, None);
        let (first, last) = (all[0].t_us, all[all.len() - 1].t_us);
        let rate_ev_s = (all.len() - 1) as f64 / ((last - first) as f64 * 1e-6);
        assert!(
            (rate_ev_s / scan.rate_ev_s - 1.0).abs() < 1e-3,
            "{rate_ev_s}"
        );
        // The next settings restore the pixels.
        camera.configure(&CameraSettings::default()).unwrap();
        assert_eq!(value(0x0740) & 1, 0);
        assert_eq!(value(0x0008) >> 11 & 1, 1);
        camera.start().unwrap();
        chunks.clear();
        until(&mut camera, &mut chunks, |c| events(c) > 1_000).unwrap();
        camera.stop(&mut chunks).unwrap();
        assert!(
            decoded(&chunks).iter().any(|e| e.x >= 512),
            "noise is everywhere"
        );
    });
}

#[test]
fn rejected_generator_settings_are_reported_and_closing_switches_it_off() {
    let test = "bus::pattern::rejected_generator_settings_are_reported_and_closing_switches_it_off";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        remote
            .order(FIRST, DeviceCommand::IgnoreWrites(0x0744))
            .unwrap();
        let error = camera.test_pattern(PATTERN).unwrap_err();
        assert!(matches!(error, DeviceError::ReadBack { .. }), "{error}");
        let message = camera
            .test_pattern(Some(TestPattern { rate_ev_s: 1.0 }))
            .unwrap_err();
        assert!(matches!(message, DeviceError::Refused { .. }), "{message}");
        camera.close().unwrap();
        assert_eq!(remote.register(FIRST, 0x0740).unwrap() & 1, 0);
        assert_eq!(remote.register(FIRST, 0x0008).unwrap() >> 11 & 1, 1);
    });
}
