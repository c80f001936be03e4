//! Configuration of the bus: devices, their content and their clocks.
//!
//! The same values as JSON are the input of `emulated-cameras`; all keys except `kind` and `serial` have defaults.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use skinrig_model::{CameraId, RigidTransform, Robot, SimLevel, Skin};

/// A bus with its devices in the order of their ports.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BusConfig {
    /// The devices.
    pub devices: Vec<DeviceConfig>,
}

/// A device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum DeviceConfig {
    /// A Prophesee EVK1 Gen3.1.
    Evk1(Box<Evk1Config>),
    /// A camera with another protocol but the same vendor and product ID (EVK3). It records vendor requests, none of which may reach it.
    Treuzell {
        /// Name on this bus.
        serial: String,
    },
}

impl DeviceConfig {
    /// Name of the device in control requests.
    #[must_use]
    pub fn serial(&self) -> &str {
        match self {
            Self::Evk1(config) => &config.serial,
            Self::Treuzell { serial } => serial,
        }
    }
}

impl From<Evk1Config> for DeviceConfig {
    fn from(config: Evk1Config) -> Self {
        Self::Evk1(Box::new(config))
    }
}

/// Access to a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Access {
    /// Free.
    #[default]
    Free,
    /// Another program has claimed its interface (claim fails with EBUSY).
    Busy,
    /// The user has no permission, as without a udev rule (open fails with EACCES).
    NotPermitted,
}

/// Timing of the byte stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pacing {
    /// In real time. A slow host loses events, as with a real camera.
    #[default]
    RealTime,
    /// At the speed of the host: the camera's time waits, and nothing is lost.
    HostTime,
}

/// Content of the pixel events.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Content {
    /// No events.
    #[default]
    Silence,
    /// Events at random pixels and times.
    Noise {
        /// Mean rate of the sensor, events/s; up to a few million.
        events_per_s: f64,
        /// Seed.
        seed: u64,
    },
    /// A fixed pattern at a fixed rate, cheap to generate: for the sensor's maximum of 50 Mev/s and more.
    Dense {
        /// Rate, 10^6 events/s.
        mev_per_s: f64,
    },
    /// Events of an EVT2 RAW file, shifted so that the first one occurs at the start; none after the last.
    File {
        /// The file.
        path: PathBuf,
    },
    /// A camera of the simulated bench, which sees the tip reported through [`world`](crate::world).
    Scene(Box<SceneContent>),
}

/// A camera of the simulated bench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneContent {
    /// Camera 1 or 2.
    pub camera: CameraId,
    /// Seed of the bench: true geometry, noise and hot pixels.
    pub seed: u64,
    /// `geometric` or `optical`.
    pub level: SimLevel,
    /// Pose of the skin in the robot frame; default: as in the simulated bench.
    #[serde(default)]
    pub robot_from_skin: Option<RigidTransform<Robot, Skin>>,
    /// Probability that a contact produces no events, 0 to 1; default: as in the simulated bench. Only for `geometric`.
    #[serde(default)]
    pub dead_share: Option<f64>,
}

/// An EVK1. Defaults marked *assumed* are not public.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Evk1Config {
    /// Eight hexadecimal digits, as the software prints register 0x0020.
    pub serial: String,
    /// USB product number: 0x00f4, and 0x00f1 or 0x00bc on other boards.
    pub product_id: u16,
    /// Speed of the connection, Mbit/s: 5000, or 480 on a USB 2 port.
    pub speed_mbit: u32,
    /// Access to it.
    pub access: Access,
    /// Reply to request 0x70: 2 for an EVK1, 3 for a CX3 board.
    pub board_version: u16,
    /// Reply to request 0x72: 0x1c for Gen3.1, 0x11 for the rescue image.
    pub system_id: u16,
    /// Register 0x0804: major << 16, minor << 8, micro.
    pub fpga_version: u32,
    /// Register 0x0218. The value of a sensor without exposure measurement is not public; the default is that of the register map.
    pub chip_id: u32,
    /// Boot time of the FPGA after plugging, ms.
    pub boot_ms: u64,
    /// Rate deviation of its clock, ppm; positive is fast.
    pub drift_ppm: f64,
    /// Its time at the first start, µs.
    pub origin_us: u64,
    /// Whether its time restarts at every start or continues (not public; both are supported).
    pub time_restarts: bool,
    /// Minimum delay of trigger edges, ns (assumed 0).
    pub trigger_delay_ns: u32,
    /// Maximum additional, uniformly distributed delay, ns (assumed 0).
    pub trigger_jitter_ns: u32,
    /// Capacity of its buffer while no transfer waits, bytes (assumed 512 KiB).
    pub fifo_bytes: usize,
    /// Words of an earlier session left in its buffers.
    pub stale_words: usize,
    /// Timing of the byte stream.
    pub pacing: Pacing,
    /// Content of the pixel events.
    pub content: Content,
}

impl Default for Evk1Config {
    fn default() -> Self {
        Self {
            serial: "00001621".to_owned(),
            product_id: 0x00f4,
            speed_mbit: 5000,
            access: Access::Free,
            board_version: 2,
            system_id: 0x1c,
            fpga_version: 0x0003_0000,
            chip_id: 0x9020_0c03,
            boot_ms: 0,
            drift_ppm: 0.0,
            origin_us: 0,
            time_restarts: true,
            trigger_delay_ns: 0,
            trigger_jitter_ns: 0,
            fifo_bytes: 512 << 10,
            stale_words: 0,
            pacing: Pacing::RealTime,
            content: Content::Silence,
        }
    }
}

impl Evk1Config {
    /// A camera with this serial number and default values.
    #[must_use]
    pub fn new(serial: &str) -> Self {
        Self {
            serial: serial.to_owned(),
            ..Self::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_names_what_differs_from_the_defaults() {
        let text = r#"{"devices": [
            {"kind": "evk1", "serial": "00001621", "drift_ppm": 12.5,
             "content": {"kind": "scene", "camera": "camera2", "seed": 7, "level": "geometric"}},
            {"kind": "treuzell", "serial": "evk3"}]}"#;
        let bus: BusConfig = serde_json::from_str(text).unwrap();
        let DeviceConfig::Evk1(camera) = &bus.devices[0] else {
            panic!("{bus:?}")
        };
        assert_eq!(camera.drift_ppm, 12.5);
        assert_eq!(camera.fifo_bytes, Evk1Config::default().fifo_bytes);
        let Content::Scene(scene) = &camera.content else {
            panic!("{camera:?}")
        };
        assert_eq!(scene.camera, CameraId::ALL[1]);
        let restored: BusConfig =
            serde_json::from_str(&serde_json::to_string(&bus).unwrap()).unwrap();
        assert_eq!(restored, bus);
        let wrong = text.replace("drift_ppm", "drift");
        let error = serde_json::from_str::<BusConfig>(&wrong).unwrap_err();
        assert!(error.to_string().contains("drift"), "{error}");
    }
}
