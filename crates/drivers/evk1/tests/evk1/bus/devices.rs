//! Listing of the connected devices and access to them.

use skinrig_device::{CameraSettings, EventCamera, RealClock, Roi};
use skinrig_emulated_camera::config::Access;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_emulated_camera::{DeviceConfig, Evk1Config as Emulated};
use skinrig_evk1::{Evk1, Evk1Config, Evk1Error, UsbError, enumerate};
use skinrig_model::CameraId;

use crate::bus::bench::{FIRST, SECOND, noise, open};

fn with(serial: &str, change: impl FnOnce(&mut Emulated)) -> DeviceConfig {
    let mut camera = Emulated::new(serial);
    change(&mut camera);
    camera.into()
}

fn all_kinds() -> Vec<DeviceConfig> {
    vec![
        with(FIRST, |_| {}),
        with("00000002", |c| c.access = Access::Busy),
        with("00000003", |c| c.access = Access::NotPermitted),
        DeviceConfig::Treuzell {
            serial: "evk3".to_owned(),
        },
        with("00000005", |c| c.system_id = 0x11),
        with("00000006", |c| c.board_version = 3),
        with(SECOND, |c| (c.product_id, c.speed_mbit) = (0x00f1, 480)),
    ]
}

#[test]
fn each_kind_of_device_is_listed_with_its_next_step() {
    let test = "bus::devices::each_kind_of_device_is_listed_with_its_next_step";
    on_bus(test, all_kinds(), |remote| {
        let lines: Vec<String> = enumerate()
            .unwrap()
            .iter()
            .map(ToString::to_string)
            .collect();
        insta::assert_snapshot!("listed", lines.join("\n"));
        assert_eq!(
            remote.journal("evk3").unwrap(),
            [],
            "never ask a Treuzell camera"
        );
        for device in all_kinds() {
            let requested = remote.journal(device.serial()).unwrap();
            assert!(requested.iter().all(|r| r.is_in), "listing must not write");
        }
    });
}

#[test]
fn a_camera_is_opened_by_serial_number_without_touching_others() {
    let test = "bus::devices::a_camera_is_opened_by_serial_number_without_touching_others";
    on_bus(test, all_kinds(), |remote| {
        let camera = open(SECOND);
        assert_eq!(camera.identity().serial, SECOND);
        let others = remote.journal(FIRST).unwrap();
        assert!(others.iter().all(|r| r.is_in));
        assert_eq!(remote.journal("evk3").unwrap(), []);
        // It is open now, and reported as busy to the next caller.
        let (config, clock) = (Evk1Config::default(), RealClock::start());
        let Err(error) = Evk1::open_serial(SECOND, CameraId::One, config, clock) else {
            panic!("opened twice");
        };
        insta::assert_snapshot!("not_found", error.to_string().replace("; ", "\n"));
        drop(camera);
        drop(open(SECOND));
    });
}

#[test]
fn an_empty_bus_is_reported_with_the_next_step() {
    on_bus(
        "bus::devices::an_empty_bus_is_reported_with_the_next_step",
        Vec::new(),
        |_| {
            assert_eq!(enumerate().unwrap(), []);
            let (config, clock) = (Evk1Config::default(), RealClock::start());
            let error = Evk1::open_serial(FIRST, CameraId::One, config, clock)
                .err()
                .unwrap();
            assert!(
                error.to_string().ends_with("check cable and power"),
                "{error}"
            );
        },
    );
}

/// On the real machine, with or without USB: a list or an error, never a panic.
#[test]
fn missing_usb_is_reported() {
    match enumerate() {
        Ok(_) => {}
        Err(error) => assert!(matches!(error, UsbError::NoUsb(_)), "{error}"),
    }
}

#[test]
fn driver_waits_for_a_slow_start() {
    let slow = with(FIRST, |c| c.boot_ms = 300);
    on_bus(
        "bus::devices::driver_waits_for_a_slow_start",
        vec![slow],
        |_| {
            assert_eq!(
                open(FIRST).identity().firmware.split(',').next(),
                Some("FPGA 3.0.0")
            );
        },
    );
}

#[test]
fn the_driver_fulfils_the_contract() {
    // It is not published whether a camera's time restarts at every start; here it continues.
    let camera = Emulated {
        time_restarts: false,
        ..noise(FIRST)
    };
    let test = "bus::devices::the_driver_fulfils_the_contract";
    on_bus(test, vec![camera.into()], |_| {
        let settings = CameraSettings {
            roi: Some(Roi {
                x: 0,
                y: 0,
                width: 320,
                height: 480,
            }),
            trigger_channels: vec![0, 6],
            ..CameraSettings::default()
        };
        let mut make = || {
            let clock = RealClock::start();
            let config = Evk1Config::default();
            let camera: Result<Evk1, Evk1Error> =
                Evk1::open_serial(FIRST, CameraId::One, config, clock);
            let camera: Box<dyn EventCamera> = Box::new(camera.unwrap());
            let clock: Box<dyn skinrig_device::Clock> = Box::new(clock);
            (camera, clock)
        };
        skinrig_device::contract::event_camera(&mut make, &settings);
    });
}

/// Only requests of the public driver, in the order in which the camera model received them.
#[test]
fn only_known_registers_and_requests_are_used() {
    let test = "bus::devices::only_known_registers_and_requests_are_used";
    on_bus(test, vec![noise(FIRST).into()], |remote| {
        let mut camera = open(FIRST);
        camera.configure(&CameraSettings::default()).unwrap();
        camera.start().unwrap();
        camera.stop(&mut Vec::new()).unwrap();
        camera.close().unwrap();
        let counters = remote.observe(FIRST).unwrap().counters;
        assert_eq!(
            (counters.unknown_registers, counters.refused_requests),
            (0, 0)
        );
        assert_eq!(counters.starts, 1);
        // Powered down at the end.
        assert_eq!(remote.register(FIRST, 0x0000).unwrap() & 0x7, 0);
    });
}
