//! Tests of a running camera's stream.

use skinrig_emulated_camera::Evk1Config;
use skinrig_emulated_camera::config::{Content, Pacing};
use skinrig_emulated_camera::harness::on_bus;

use crate::client::Camera;

const SERIAL: &str = "00001621";

fn camera(content: Content) -> Evk1Config {
    Evk1Config {
        content,
        ..Evk1Config::new(SERIAL)
    }
}

fn words(bytes: &[u8]) -> impl Iterator<Item = u32> {
    let (words, rest) = bytes.as_chunks::<4>();
    assert!(rest.is_empty());
    words.iter().map(|w| u32::from_le_bytes(*w))
}

#[test]
fn an_idle_camera_sends_its_time_every_16_us_in_packets_of_1024_us() {
    on_bus(
        "stream::an_idle_camera_sends_its_time_every_16_us_in_packets_of_1024_us",
        vec![camera(Content::Silence).into()],
        |remote| {
            let mut camera = Camera::open(0);
            camera.configure(1 << 12);
            camera.start();
            let mut packets = Vec::new();
            while packets.len() < 50 {
                packets.push(camera.transfer().unwrap());
            }
            // A slow reader gets several whole packets at a time; the first also contains the word of t = 0.
            assert_eq!(packets[0] % 256, 4, "{packets:?}");
            assert!(packets[1..].iter().all(|n| n % 256 == 0), "{packets:?}");
            for (n, word) in words(&camera.received).enumerate() {
                assert_eq!(word, 0x8000_0000 | (n as u32 * 16) >> 6, "word {n}");
            }
            camera.stop();
            let found = remote.observe(SERIAL).unwrap();
            assert_eq!(found.counters.dropped_bytes, 0);
            assert_eq!(found.delivered.bytes, camera.received.len() as u64);
        },
    );
}

#[test]
fn received_data_equal_sent_data_and_time_is_monotonic() {
    let noise = Content::Noise {
        events_per_s: 2e5,
        seed: 3,
    };
    on_bus(
        "stream::received_data_equal_sent_data_and_time_is_monotonic",
        vec![camera(noise).into()],
        |remote| {
            let mut camera = Camera::open(0);
            camera.configure(1 << 12);
            camera.start();
            let found = camera.read_until(|s| s.last_us > 200_000);
            camera.stop();
            let rate = found.events.len() as f64 / (found.last_us as f64 * 1e-6);
            assert!((1.9e5..2.1e5).contains(&rate), "{rate}");
            assert!(found.events.is_sorted_by_key(|e| e.t_us));
            let handed = remote.observe(SERIAL).unwrap().delivered;
            assert_eq!(handed.bytes, camera.received.len() as u64);
            assert_eq!(handed.crc32, crc32fast::hash(&camera.received));
        },
    );
}

#[test]
fn pixels_send_only_when_powered_released_and_in_the_region() {
    let noise = Content::Noise {
        events_per_s: 1e5,
        seed: 3,
    };
    on_bus(
        "stream::pixels_send_only_when_powered_released_and_in_the_region",
        vec![camera(noise).into()],
        |_| {
            let mut camera = Camera::open(0);
            camera.configure(1 << 12);
            let end = |camera: &mut Camera, by_us| {
                camera.received.clear();
                let mut first = None;
                camera.read_until(|s| s.last_us > *first.get_or_insert(s.last_us) + by_us)
            };
            // Region: columns 32..64 of rows 0..32.
            camera.write(0x0400, 0).unwrap();
            for n in 2..20 {
                camera.write(0x0400 + 4 * n, 0).unwrap();
            }
            for n in 1..15 {
                camera.write(0x0500 + 4 * n, 0).unwrap();
            }
            camera.start();
            let whole = end(&mut camera, 50_000);
            assert!(whole.events.iter().any(|e| e.x >= 64 && e.y >= 32));
            camera.write(0x0204, 0x2b).unwrap();
            end(&mut camera, 50_000);
            let region = end(&mut camera, 400_000);
            assert!(!region.events.is_empty());
            assert!(
                region
                    .events
                    .iter()
                    .all(|e| (32..64).contains(&e.x) && e.y < 32)
            );
            camera.write(0x0204, 0x23).unwrap();
            end(&mut camera, 50_000);
            assert!(
                end(&mut camera, 50_000).events.is_empty(),
                "pixels in reset"
            );
            camera.write(0x0204, 0x2b).unwrap();
            camera.write(0x024c, 0x0a << 14 | 0x3fff).unwrap();
            camera.write(0x0248, 0xc9).unwrap();
            end(&mut camera, 50_000);
            assert!(end(&mut camera, 50_000).events.is_empty(), "filter shut");
            camera.write(0x0248, 0xc8).unwrap();
            assert!(!end(&mut camera, 400_000).events.is_empty(), "filter off");
        },
    );
}

#[test]
fn a_slow_host_loses_events_that_are_counted() {
    let dense = Evk1Config {
        fifo_bytes: 64 << 10,
        ..camera(Content::Dense { mev_per_s: 20.0 })
    };
    on_bus(
        "stream::a_slow_host_loses_events_that_are_counted",
        vec![dense.into()],
        |remote| {
            let mut camera = Camera::open(0);
            camera.configure(1 << 12);
            camera.start();
            let mut counters = Default::default();
            for _ in 0..20_000 {
                counters = remote.observe(SERIAL).unwrap().counters;
                if counters.dropped_bytes > 1_000_000 {
                    break;
                }
            }
            camera.stop();
            assert!(counters.dropped_bytes > 1_000_000, "{counters:?}");
            assert_eq!(camera.read(0x0018), Ok(0xffff));
            // The remaining data is the capacity of the buffer.
            camera.transfer().unwrap();
            let found = remote.observe(SERIAL).unwrap();
            assert_eq!(found.delivered.bytes, 64 << 10);
            assert_eq!(
                found.counters.made_bytes - found.counters.dropped_bytes,
                64 << 10
            );
        },
    );
}

#[test]
fn a_camera_that_waits_for_its_host_loses_nothing_at_the_highest_rate() {
    let dense = Evk1Config {
        pacing: Pacing::HostTime,
        ..camera(Content::Dense { mev_per_s: 50.0 })
    };
    on_bus(
        "stream::a_camera_that_waits_for_its_host_loses_nothing_at_the_highest_rate",
        vec![dense.into()],
        |remote| {
            let mut camera = Camera::open(0);
            camera.configure(1 << 12);
            camera.start();
            while camera.received.len() < 20_000_000 {
                camera.transfer().unwrap();
            }
            camera.stop();
            let found = crate::client::StreamContent::decode(&camera.received);
            let rate = found.events.len() as f64 / found.last_us as f64;
            assert!((49.9..50.1).contains(&rate), "{rate} Mev/s of its own time");
            let highs = words(&camera.received).filter(|w| w >> 28 == 8);
            let mut last = 0;
            for high in highs {
                assert!(high & 0x0fff_ffff <= last + 1, "a gap");
                last = high & 0x0fff_ffff;
            }
            let observed = remote.observe(SERIAL).unwrap();
            assert_eq!(observed.counters.dropped_bytes, 0);
            assert_eq!(observed.delivered.crc32, crc32fast::hash(&camera.received));
        },
    );
}
