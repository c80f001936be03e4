//! Faults: every wait ends, every fault is named, and the data before it is delivered.

use skinrig_device::{CameraSettings, DeviceError, EventCamera, RealClock};
use skinrig_emulated_camera::control::DeviceCommand;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_evk1::{CameraState, Evk1, Evk1Config, enumerate};
use skinrig_model::CameraId;

use crate::bus::bench::{FIRST, events, noise, open, until};

#[test]
fn a_disconnected_cable_is_named_and_the_camera_can_be_reopened() {
    let test = "bus::faults::a_disconnected_cable_is_named_and_the_camera_can_be_reopened";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        camera.start().unwrap();
        let mut chunks = Vec::new();
        until(&mut camera, &mut chunks, |c| events(c) > 100).unwrap();
        remote.order(FIRST, DeviceCommand::Unplug).unwrap();
        let lost = until(&mut camera, &mut chunks, |_| false).unwrap_err();
        assert!(
            lost.to_string()
                .contains("the device is no longer on the bus"),
            "{lost}"
        );
        camera.stop(&mut chunks).unwrap_err();
        camera.stop(&mut chunks).unwrap();
        camera.start().unwrap_err();
        let delivered = remote.observe(FIRST).unwrap().delivered.bytes;
        let kept: usize = chunks.iter().map(|c| c.bytes.len()).sum();
        let lost: u64 = chunks.iter().map(|c| c.lost_before).sum();
        assert_eq!(kept as u64 + lost, delivered);
        drop(camera);
        remote.order(FIRST, DeviceCommand::Plug).unwrap();
        let mut camera = open(FIRST);
        camera.start().unwrap();
        until(&mut camera, &mut Vec::new(), |c| events(c) > 100).unwrap();
    });
}

#[test]
fn a_stall_ends_the_stream_and_the_next_start_clears_it() {
    let test = "bus::faults::a_stall_ends_the_stream_and_the_next_start_clears_it";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        camera.start().unwrap();
        let mut chunks = Vec::new();
        until(&mut camera, &mut chunks, |c| events(c) > 100).unwrap();
        remote.order(FIRST, DeviceCommand::Stall).unwrap();
        let lost = until(&mut camera, &mut chunks, |_| false).unwrap_err();
        assert!(lost.to_string().contains("the endpoint stalled"), "{lost}");
        camera.stop(&mut chunks).unwrap_err();
        camera.start().unwrap();
        let before = events(&chunks);
        until(&mut camera, &mut chunks, |c| events(c) > before + 100).unwrap();
        camera.stop(&mut chunks).unwrap();
    });
}

#[test]
fn a_register_that_rejects_a_value_is_named() {
    let test = "bus::faults::a_register_that_rejects_a_value_is_named";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        remote
            .order(FIRST, DeviceCommand::IgnoreWrites(0x0358))
            .unwrap();
        let settings = CameraSettings {
            biases: [("bias_fo".to_owned(), 1600)].into(),
            ..CameraSettings::default()
        };
        let error = camera.configure(&settings).unwrap_err();
        assert!(matches!(error, DeviceError::ReadBack { .. }));
        insta::assert_snapshot!(error, @r"
camera 1 00001621: bgen_22 (0x0358): expected 0x71002100 after writing, found 0x71003d00
");
    });
}

#[test]
fn an_unresponsive_camera_times_out() {
    let test = "bus::faults::an_unresponsive_camera_times_out";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        remote.order(FIRST, DeviceCommand::Silence(true)).unwrap();
        let lost = camera.start().unwrap_err();
        assert!(
            lost.to_string().contains("no reply within the time limit"),
            "{lost}"
        );
        drop(camera);
        let found = enumerate().unwrap();
        assert!(
            matches!(found[0].state, CameraState::Faulty(_)),
            "{found:?}"
        );
        remote.order(FIRST, DeviceCommand::Silence(false)).unwrap();
        remote.order(FIRST, DeviceCommand::FailReads(true)).unwrap();
        let (config, clock) = (Evk1Config::default(), RealClock::start());
        let error = Evk1::open_serial(FIRST, CameraId::One, config, clock)
            .err()
            .unwrap();
        assert!(
            error.to_string().contains("expected status 0x40"),
            "{error}"
        );
    });
}

/// Transfers are cancelled and freed no matter how the camera is released.
#[test]
fn a_streaming_camera_can_be_dropped() {
    let test = "bus::faults::a_streaming_camera_can_be_dropped";
    on_bus(test, vec![noise(FIRST).into()], |_| {
        for _ in 0..3 {
            let mut camera = open(FIRST);
            camera.start().unwrap();
            drop(camera);
        }
    });
}
