//! The contract of an event camera.

use skinrig_device::{CameraSettings, EventCamera, NoiseFilter, Roi, SyncMode};

use super::model::Bench;

fn make(sync_clock: bool) -> (Box<dyn EventCamera>, Box<dyn skinrig_device::Clock>) {
    let bench = Bench::new();
    bench.model().sync_clock = sync_clock;
    (Box::new(bench.open().unwrap()), Box::new(bench))
}

#[test]
fn a_standalone_camera_keeps_the_contract() {
    let settings = CameraSettings {
        biases: [("bias_fo".to_owned(), 1500)].into(),
        roi: Some(Roi {
            x: 64,
            y: 32,
            width: 500,
            height: 400,
        }),
        trigger_channels: vec![0, 7],
        ..CameraSettings::default()
    };
    skinrig_device::contract::event_camera(&mut || make(false), &settings);
}

#[test]
fn a_slave_keeps_the_contract() {
    let settings = CameraSettings {
        sync: SyncMode::Slave,
        trigger_channels: vec![0],
        noise_filter: Some(NoiseFilter {
            min_rate_ev_s: 50_000,
        }),
        ..CameraSettings::default()
    };
    skinrig_device::contract::event_camera(&mut || make(true), &settings);
}
