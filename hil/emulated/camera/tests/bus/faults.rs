//! Tests of faults as libusb reports them.

use rusb::Error;
use skinrig_emulated_camera::config::Content;
use skinrig_emulated_camera::control::DeviceCommand;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_emulated_camera::{DeviceConfig, Evk1Config};

use crate::client::{Camera, StreamContent, devices};

const SERIAL: &str = "00001621";

fn bus() -> Vec<DeviceConfig> {
    let camera = Evk1Config {
        content: Content::Noise {
            events_per_s: 1e5,
            seed: 1,
        },
        ..Evk1Config::new(SERIAL)
    };
    vec![camera.into()]
}

fn running() -> Camera {
    let mut camera = Camera::open(0);
    camera.configure(1 << 12);
    camera.start();
    camera.transfer().expect("a packet");
    camera
}

#[test]
fn an_unplugged_cable_ends_all_transfers_and_a_new_one_restarts_the_device() {
    on_bus(
        "faults::an_unplugged_cable_ends_all_transfers_and_a_new_one_restarts_the_device",
        bus(),
        |remote| {
            let mut camera = running();
            remote.order(SERIAL, DeviceCommand::Unplug).unwrap();
            let end = loop {
                if let Err(e) = camera.transfer() {
                    break e;
                }
            };
            assert_eq!(end, Error::NoDevice);
            assert_eq!(camera.read(0x0020), Err(Error::NoDevice));
            assert!(devices().is_empty());
            remote.order(SERIAL, DeviceCommand::Plug).unwrap();
            let camera = Camera::open(0);
            assert_eq!(camera.read(0x0008), Ok(0x20), "after a power-up");
            drop(camera);
            drop(running());
        },
    );
}

#[test]
fn a_stall_lasts_until_it_is_cleared() {
    on_bus(
        "faults::a_stall_lasts_until_it_is_cleared",
        bus(),
        |remote| {
            let mut camera = running();
            remote.order(SERIAL, DeviceCommand::Stall).unwrap();
            assert_eq!(camera.transfer(), Err(Error::Pipe));
            assert_eq!(camera.transfer(), Err(Error::Pipe));
            camera.handle.clear_halt(0x81).unwrap();
            assert!(camera.transfer().unwrap() > 0);
        },
    );
}

#[test]
fn a_transfer_may_end_within_a_word_and_contain_garbage() {
    on_bus(
        "faults::a_transfer_may_end_within_a_word_and_contain_garbage",
        bus(),
        |remote| {
            let mut camera = running();
            let mut odd = 0;
            for cut in 1..=3 {
                remote.order(SERIAL, DeviceCommand::Cut(cut)).unwrap();
                for _ in 0..3 {
                    odd += usize::from(!camera.transfer().unwrap().is_multiple_of(4));
                }
            }
            assert!(odd >= 3, "{odd}");
            let garbage = vec![0x2000_0000, 0x7fff_ffff, 0xb000_0001];
            remote
                .order(SERIAL, DeviceCommand::Garbage(garbage.clone()))
                .unwrap();
            let found = |bytes: &[u8]| {
                let expected: Vec<u8> = garbage.iter().flat_map(|w| w.to_le_bytes()).collect();
                bytes.windows(expected.len()).any(|w| w == expected)
            };
            for _ in 0..1000 {
                camera.transfer().unwrap();
                if found(&camera.received) {
                    break;
                }
            }
            assert!(found(&camera.received));
            camera.stop();
            let observed = StreamContent::decode(&camera.received);
            assert!(observed.events.is_sorted_by_key(|e| e.t_us));
            let handed = remote.observe(SERIAL).unwrap().delivered;
            assert_eq!(handed.crc32, crc32fast::hash(&camera.received));
        },
    );
}

#[test]
fn a_register_may_ignore_writes_and_a_request_may_stay_unanswered() {
    on_bus(
        "faults::a_register_may_ignore_writes_and_a_request_may_stay_unanswered",
        bus(),
        |remote| {
            let camera = Camera::open(0);
            remote
                .order(SERIAL, DeviceCommand::IgnoreWrites(0x0354))
                .unwrap();
            camera.write(0x0354, 0x7900_0029).unwrap();
            assert_eq!(camera.read(0x0354), Ok(0));
            remote.order(SERIAL, DeviceCommand::Silence(true)).unwrap();
            assert_eq!(camera.read(0x0354), Err(Error::Timeout));
            remote.order(SERIAL, DeviceCommand::Silence(false)).unwrap();
            assert_eq!(camera.read(0x0204), Ok(0xb));
        },
    );
}

#[test]
fn a_full_buffer_loses_words_and_the_camera_counts_them() {
    on_bus(
        "faults::a_full_buffer_loses_words_and_the_camera_counts_them",
        bus(),
        |remote| {
            let mut camera = running();
            assert_eq!(camera.read(0x0018), Ok(0));
            remote.order(SERIAL, DeviceCommand::DropWords(10)).unwrap();
            while remote.observe(SERIAL).unwrap().counters.dropped_bytes < 400 {
                camera.transfer().unwrap();
            }
            assert!(camera.read(0x0018).unwrap() >= 100);
            remote.order(SERIAL, DeviceCommand::DropWords(0)).unwrap();
            camera.stop();
            let observed = remote.observe(SERIAL).unwrap().counters;
            assert_eq!(observed.dropped_bytes % 40, 0, "10 words of each packet");
        },
    );
}

#[test]
fn hot_pixels_fire_once_a_millisecond() {
    on_bus(
        "faults::hot_pixels_fire_once_a_millisecond",
        bus(),
        |remote| {
            let mut camera = Camera::open(0);
            camera.configure(1 << 12);
            remote.order(SERIAL, DeviceCommand::HotPixels(2)).unwrap();
            camera.start();
            let observed = camera.read_until(|s| s.last_us > 100_000);
            camera.stop();
            for (x, y) in [(0, 0), (211, 97)] {
                let count = observed
                    .events
                    .iter()
                    .filter(|e| (e.x, e.y) == (x, y))
                    .count() as u64;
                // Noise may add one.
                assert!(count.abs_diff(observed.last_us / 1_000) <= 2, "{count}");
            }
            assert!(observed.events.is_sorted_by_key(|e| e.t_us));
        },
    );
}
