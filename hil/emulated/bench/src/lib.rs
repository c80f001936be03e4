//! A complete emulated bench in real time, with its devices connected like real ones by wires and light.
//!
//! ```text
//!  skinrig run --rig hil/rigs/emulated.yaml     (a child process: production drivers only)
//!    |dlopen                |libusb               |serial port
//!  libdrd stand-in        preload library       pseudo-terminal
//!    |                      |                     |
//!  firmware of the arm -- tip --> cameras <-- edges -- firmware of the trigger box on simavr
//! ```
//!
//! Everything recorded here is emulated.
#![cfg(target_os = "linux")]

mod connections;
mod faults;

use std::ffi::OsStr;
use std::io;
use std::process::Command;
use std::sync::Arc;

use drd::{ArmConfig, Contact, DeviceConfig as ArmDevice, EmulatedArm};
use skinrig_emulated_camera::config::{Content, SceneContent};
use skinrig_emulated_camera::{Bus, BusConfig, BusError, Evk1Config};
use skinrig_emulated_trigger_box::{BoardOptions, EmulatedBox, Unavailable};
use skinrig_model::{CameraId, Point3, RigidTransform, Robot, SimLevel, Skin};

pub use faults::InjectionError;

// Faults of single devices, with their sizes and times.
pub use drd::{Fault as ArmFault, When};
pub use skinrig_emulated_camera::control::DeviceCommand;

pub use connections::CAMERA_SERIALS;
use connections::{Connections, Wire};

/// Serial number of the arm, as in `hil/rigs/emulated.yaml`.
pub(crate) const ARM_SERIAL: u16 = 4711;
/// Serial number in the trigger box's EEPROM.
pub(crate) const BOX_SERIAL: &str = "emulated";
/// Environment variable with the path of the emulated libdrd, for rig files.
pub const LIBRARY_VARIABLE: &str = "SKINRIG_EMULATED_LIBDRD";
/// Environment variable with the port of the trigger box, for rig files.
pub(crate) const BOX_VARIABLE: &str = "SKINRIG_EMULATED_TRIGGER_BOX";

/// Environment variable, for rig files, with the path of a file that exists while the lamps are off.
pub(crate) const LAMPS_VARIABLE: &str = "SKINRIG_EMULATED_LAMPS_OFF";

/// Configuration of the bench.
#[derive(Debug, Clone)]
pub struct BenchConfig {
    /// Seed of the cameras' true geometry and of their noise.
    pub seed: u64,
    /// Pixel model: `geometric` or `optical`.
    pub level: SimLevel,
    /// Pose of the skin; the same as in the rig file.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// Rate deviations of the camera clocks, ppm.
    pub camera_ppm: [f64; 2],
    /// Camera times at the start, µs.
    pub camera_origin_us: [u64; 2],
    /// Rate deviation of the trigger box's clock, ppm.
    pub box_ppm: f64,
    /// Stiffness of the skin, N/m.
    pub skin_n_m: f64,
    /// Probability that a contact produces no events in a camera, 0 to 1.
    pub dead_share: f64,
}

impl Default for BenchConfig {
    /// A bench with realistic crystals, tens of ppm apart. Box and camera 1 differ by 25 ppm, so
    /// that trains every 100 ms alternate between only two phases of the camera's microseconds.
    fn default() -> Self {
        Self {
            seed: 1,
            level: SimLevel::Geometric,
            robot_from_skin: RigidTransform::translation(-10.0, -2.0, -20.0),
            camera_ppm: [23.0, -31.0],
            camera_origin_us: [0, 7_000_000],
            box_ppm: 48.0,
            skin_n_m: 500.0,
            // Without dead contacts, a missing press always indicates a fault.
            dead_share: 0.0,
        }
    }
}

/// The bench could not be set up.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The arm.
    #[error("emulated arm: {0}")]
    Arm(#[source] io::Error),
    /// The cameras.
    #[error(transparent)]
    Cameras(#[from] BusError),
    /// Tools for the trigger box are missing on this computer.
    #[error("emulated trigger box: {0}")]
    Box(#[from] Unavailable),
    /// The connections between the devices.
    #[error("emulated bench: {0}")]
    Connections(#[source] io::Error),
}

/// A running bench. Dropping it ends everything on it.
pub struct EmulatedBench {
    // Declared first, so that the threads end before the devices that they use.
    connections: Connections,
    arm: Arc<EmulatedArm>,
    bus: Arc<Bus>,
    trigger_box: EmulatedBox,
}

impl EmulatedBench {
    /// Starts and connects arm, cameras and trigger box.
    ///
    /// # Errors
    /// When a device cannot be started; [`BenchError::Box`] on a computer without avr-gcc or simavr.
    pub fn start(config: &BenchConfig) -> Result<Self, BenchError> {
        let trigger_box = EmulatedBox::start(&BoardOptions {
            ppm: config.box_ppm,
            serial: Some(BOX_SERIAL.to_owned()),
            ..BoardOptions::default()
        })?;
        let surface = config.robot_from_skin.apply(Point3::new(0.0, 0.0, 0.0));
        let arm = EmulatedArm::spawn(&ArmConfig {
            devices: vec![ArmDevice {
                serial: ARM_SERIAL,
                ..ArmDevice::default()
            }],
            journal_reads: false,
            contact: Some(Contact {
                stiffness_n_m: config.skin_n_m,
                ..Contact::horizontal(surface.z_mm * 1e-3)
            }),
            ..ArmConfig::default()
        });
        let arm = Arc::new(arm.map_err(BenchError::Arm)?);
        let devices = CameraId::ALL.map(|camera| camera_config(config, camera).into());
        let bus = Arc::new(Bus::start(&BusConfig {
            devices: devices.into(),
        })?);
        let connections =
            Connections::start(&arm, &bus, &trigger_box).map_err(BenchError::Connections)?;
        Ok(Self {
            connections,
            arm,
            bus,
            trigger_box,
        })
    }

    /// A command with access to this bench: its USB bus, libdrd, serial port and lamps.
    ///
    /// # Errors
    /// [`BenchError::Cameras`] if the preload library was not built.
    pub fn command(&self, program: impl AsRef<OsStr>) -> Result<Command, BenchError> {
        let mut command = self.bus.command(program)?;
        command
            .env(LIBRARY_VARIABLE, self.arm.library())
            .env(BOX_VARIABLE, self.trigger_box.port())
            .env(LAMPS_VARIABLE, self.bus.world().lamps_off());
        Ok(command)
    }

    /// The arm: its true state, and faults.
    #[must_use]
    pub fn arm(&self) -> &EmulatedArm {
        &self.arm
    }

    /// The cameras' bus, for faults.
    #[must_use]
    pub fn bus(&self) -> &Bus {
        &self.bus
    }
}

fn camera_config(config: &BenchConfig, camera: CameraId) -> Evk1Config {
    let i = camera.index();
    Evk1Config {
        drift_ppm: config.camera_ppm[i],
        origin_us: config.camera_origin_us[i],
        content: Content::Scene(Box::new(SceneContent {
            camera,
            seed: config.seed,
            level: config.level,
            robot_from_skin: Some(config.robot_from_skin),
            dead_share: Some(config.dead_share),
        })),
        ..Evk1Config::new(CAMERA_SERIALS[i])
    }
}
