//! Lamps switched while a camera runs.

use std::fs;

use skinrig_emulated_camera::Evk1Config;
use skinrig_emulated_camera::config::{Content, SceneContent};
use skinrig_emulated_camera::harness::on_bus;
use skinrig_model::{CameraId, SimLevel};

use crate::client::{Camera, StreamContent};

const SERIAL: &str = "00001621";
/// About 0.4 s of a quiet stream.
const BYTES: usize = 100_000;

#[test]
fn noise_falls_when_the_lamps_are_off_and_comes_back() {
    let scene = SceneContent {
        camera: CameraId::One,
        seed: 1,
        level: SimLevel::Geometric,
        robot_from_skin: None,
        dead_share: None,
    };
    let camera = Evk1Config {
        content: Content::Scene(Box::new(scene)),
        ..Evk1Config::new(SERIAL)
    };
    on_bus(
        "light::noise_falls_when_the_lamps_are_off_and_comes_back",
        vec![camera.into()],
        |remote| {
            let lamps_off = remote.root().join("lamps-off");
            let mut camera = Camera::open(0);
            camera.configure(1 << 12);
            camera.start();
            let mut rates = Vec::new();
            for dark in [false, true, false] {
                if dark {
                    fs::write(&lamps_off, "").unwrap();
                } else if lamps_off.exists() {
                    fs::remove_file(&lamps_off).unwrap();
                }
                // Skip packets generated before the lamps were switched.
                let created = remote.observe(SERIAL).unwrap().counters.made_bytes as usize;
                let from_us = read_until(&mut camera, created + 2_000).last_us;
                let observed = read_until(&mut camera, created + 2_000 + BYTES);
                let events = observed.events.iter().filter(|e| e.t_us >= from_us).count();
                rates.push(events as f64 / (observed.last_us - from_us) as f64 * 1e6);
            }
            camera.stop();
            // 1,800 events/s of background, a third of which remain in the dark, and 612 of hot pixels.
            let [lit, dark, relit] = rates[..] else {
                panic!("{rates:?}")
            };
            assert!(dark > 800.0 && dark < 1_600.0, "{rates:?}");
            assert!(lit > 1_900.0 && relit > 1_900.0, "{rates:?}");
        },
    );
}

/// Receives this many bytes in total and returns their content.
fn read_until(camera: &mut Camera, bytes: usize) -> StreamContent {
    while camera.received.len() < bytes {
        camera.transfer().expect("bytes");
    }
    StreamContent::decode(&camera.received)
}
