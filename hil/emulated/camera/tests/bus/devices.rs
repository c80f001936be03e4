//! Devices on the bus, and access to them.

use rusb::{Error, Speed};
use skinrig_emulated_camera::config::Access;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_emulated_camera::{DeviceConfig, Evk1Config};

use crate::client::{Camera, SECOND, devices};

fn with(serial: &str, access: Access) -> DeviceConfig {
    Evk1Config {
        access,
        ..Evk1Config::new(serial)
    }
    .into()
}

#[test]
fn every_kind_of_device_is_visible_as_expected() {
    let bus = vec![
        with("00001621", Access::Free),
        with("00001622", Access::Busy),
        with("00001623", Access::NotPermitted),
        DeviceConfig::Treuzell {
            serial: "evk3".into(),
        },
    ];
    on_bus(
        "devices::every_kind_of_device_is_visible_as_expected",
        bus,
        |remote| {
            let found = devices();
            assert_eq!(found.len(), 4);
            let mut subclasses = Vec::new();
            for device in &found {
                let about = device.device_descriptor().unwrap();
                assert_eq!((about.vendor_id(), about.product_id()), (0x04b4, 0x00f4));
                assert_eq!(device.speed(), Speed::Super);
                let configuration = device.active_config_descriptor().unwrap();
                let interface = configuration.interfaces().next().unwrap();
                let setting = interface.descriptors().next().unwrap();
                assert_eq!(setting.class_code(), 0xff);
                subclasses.push(setting.sub_class_code());
            }
            assert_eq!(subclasses, [0, 0, 0, 0x19]);
            let open = |n: usize| found[n].open();
            assert_eq!(open(0).unwrap().claim_interface(0), Ok(()));
            let busy = open(1).unwrap();
            assert_eq!(busy.claim_interface(0), Err(Error::Busy));
            assert_eq!(open(2).unwrap_err(), Error::Access);
            assert_eq!(remote.journal("evk3").unwrap(), []);
            let stranger = open(3).unwrap();
            let mut answer = [0; 4];
            let refused = stranger.read_control(0xc0, 0x70, 0, 0, &mut answer, SECOND);
            assert_eq!(refused, Err(Error::Pipe));
            assert_eq!(remote.journal("evk3").unwrap().len(), 1);
        },
    );
}

#[test]
fn an_interface_belongs_to_one_program_at_a_time() {
    let bus = vec![with("00001621", Access::Free)];
    on_bus(
        "devices::an_interface_belongs_to_one_program_at_a_time",
        bus,
        |_| {
            let device = &devices()[0];
            let (first, second) = (device.open().unwrap(), device.open().unwrap());
            assert_eq!(first.claim_interface(0), Ok(()));
            assert_eq!(second.claim_interface(0), Err(Error::Busy));
            drop(first);
            assert_eq!(second.claim_interface(0), Ok(()));
        },
    );
}

#[test]
fn registers_keep_their_values_and_unknown_requests_are_rejected() {
    let bus = vec![with("00001621", Access::Free)];
    on_bus(
        "devices::registers_keep_their_values_and_unknown_requests_are_rejected",
        bus,
        |remote| {
            let camera = Camera::open(0);
            let mut b = [0; 4];
            for (request, expected) in [(0x70, 2), (0x71, 1), (0x72, 0x1c)] {
                let n = camera
                    .handle
                    .read_control(0xc0, request, 0, 0, &mut b, SECOND);
                assert_eq!((n, b), (Ok(4), [0, 0, expected, 0]), "{request:#x}");
            }
            assert_eq!(camera.read(0x0020), Ok(0x1621));
            assert_eq!(camera.read(0x0804), Ok(0x0003_0000));
            assert_eq!(camera.read(0x0204), Ok(0xb));
            camera.write(0x0354, 0x7900_0029).unwrap();
            assert_eq!(camera.read(0x0354), Ok(0x7900_0029));
            assert_eq!(camera.read(0x0003), Err(Error::Pipe));
            assert_eq!(camera.write(0x0368 + 4, 1), Err(Error::Pipe));
            // Flash reads and a second register bank, which no driver may use.
            let flash = camera.handle.read_control(0xc0, 0xc2, 0, 0, &mut b, SECOND);
            assert_eq!(flash, Err(Error::Pipe));
            let counters = remote.observe("00001621").unwrap().counters;
            assert_eq!(
                (counters.unknown_registers, counters.refused_requests),
                (2, 3)
            );
            let journal = remote.journal("00001621").unwrap();
            let write = journal
                .iter()
                .find_map(|r| Some((r.register(), r.written_value()?)));
            assert_eq!(write, Some((0x0354, 0x7900_0029)));
        },
    );
}
