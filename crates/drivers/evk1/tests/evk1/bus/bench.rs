//! Cameras of the tests, opened and read through the driver.

use std::time::{Duration, Instant};

use skinrig_device::{DeviceError, EventCamera, RealClock};
use skinrig_emulated_camera::Evk1Config as Emulated;
use skinrig_emulated_camera::config::Content;
use skinrig_evk1::{Evk1, Evk1Config};
use skinrig_model::{CameraId, RawChunk, TriggerEdge};

pub const FIRST: &str = "00001621";
pub const SECOND: &str = "00001753";

/// Time limit after which a hanging test fails.
const PATIENCE: Duration = Duration::from_secs(60);

pub fn noise(serial: &str) -> Emulated {
    Emulated {
        content: Content::Noise {
            events_per_s: 1e5,
            seed: 1,
        },
        ..Emulated::new(serial)
    }
}

pub fn open(serial: &str) -> Evk1 {
    let camera = if serial == FIRST {
        CameraId::One
    } else {
        CameraId::Two
    };
    Evk1::open_serial(serial, camera, Evk1Config::default(), RealClock::start()).unwrap()
}

/// Flushes until `enough` accepts the received chunks, or until an error.
pub fn until(
    camera: &mut Evk1,
    chunks: &mut Vec<RawChunk>,
    mut enough: impl FnMut(&[RawChunk]) -> bool,
) -> Result<(), DeviceError> {
    let deadline = Instant::now() + PATIENCE;
    while !enough(chunks) {
        assert!(Instant::now() < deadline, "it was never enough");
        camera.flush(chunks)?;
        std::thread::yield_now();
    }
    Ok(())
}

pub fn bytes(chunks: &[RawChunk]) -> Vec<u8> {
    chunks
        .iter()
        .flat_map(|c| c.bytes.iter().copied())
        .collect()
}

pub fn events(chunks: &[RawChunk]) -> u64 {
    chunks.iter().map(|c| c.facts.cd_events).sum()
}

pub fn edges(chunks: &[RawChunk]) -> Vec<TriggerEdge> {
    chunks
        .iter()
        .flat_map(|c| c.triggers.iter().copied())
        .collect()
}
