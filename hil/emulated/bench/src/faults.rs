//! Faults of the emulated bench: how its devices show each fault of the shared vocabulary.

use std::io;

use drd::{Fault as ArmFault, Setting, When};
use skinrig_emulated_camera::control::DeviceCommand;
use skinrig_emulated_trigger_box::NoisePerMillion;
use skinrig_model::{CameraId, RigFault, UnsupportedFault};

use crate::{CAMERA_SERIALS, EmulatedBench, Wire};

/// Words that a camera loses in every packet.
const DROPPED_WORDS: usize = 10;
/// Pixels of an event storm, with an event per millisecond each.
const HOT_PIXELS: u16 = 40;
/// Register of the bias `bias_diff_on`.
const BIAS_REGISTER: u32 = 0x0350;
/// Seed of the noise on the serial line.
const NOISE_SEED: u32 = 1;
/// Bytes with a flipped bit on a noisy serial line, per million.
const FLIPPED_PER_MILLION: u32 = 30_000;
/// Additional friction of a slow arm, N per (m/s).
const FRICTION_N_S_M: f64 = 800.0;
/// Error of the reported height, m.
const Z_ERROR_M: f64 = 5e-4;

/// A fault was not injected.
#[derive(Debug, thiserror::Error)]
pub enum InjectionError {
    /// The emulated bench does not support it.
    #[error(transparent)]
    Unsupported(UnsupportedFault),
    /// The device does not answer.
    #[error("injecting a fault: {0}")]
    Device(#[from] io::Error),
}

/// Effect of a fault on a device of the bench.
#[derive(Debug, Clone, PartialEq)]
enum Effect {
    Camera(CameraId, DeviceCommand),
    Wire(CameraId, Wire),
    BoxUnplugged,
    BoxNoise(NoisePerMillion),
    Arm(ArmFault),
}

fn effect(fault: RigFault) -> Result<Effect, UnsupportedFault> {
    use RigFault as F;
    let z_offset = |by_m| Effect::Arm(ArmFault::PositionOffset([0.0, 0.0, by_m]));
    Ok(match fault {
        F::CameraUnplugged(camera) => Effect::Camera(camera, DeviceCommand::Unplug),
        F::CameraStalled(camera) => Effect::Camera(camera, DeviceCommand::Stall),
        F::CameraDrops(camera) => Effect::Camera(camera, DeviceCommand::DropWords(DROPPED_WORDS)),
        F::CameraStorm(camera) => Effect::Camera(camera, DeviceCommand::HotPixels(HOT_PIXELS)),
        F::CameraSettingIgnored(camera) => {
            Effect::Camera(camera, DeviceCommand::IgnoreWrites(BIAS_REGISTER))
        }
        F::LineCut(camera) => Effect::Wire(camera, Wire::Cut),
        F::LineNoisy(camera) => Effect::Wire(camera, Wire::Noisy),
        F::BoxSilent => Effect::BoxUnplugged,
        F::BoxNoisy => Effect::BoxNoise(NoisePerMillion {
            flip: FLIPPED_PER_MILLION,
            ..NoisePerMillion::default()
        }),
        F::RobotLost => Effect::Arm(ArmFault::Lost),
        F::RobotPowerLost => Effect::Arm(ArmFault::PowerLost),
        F::RobotStalled => Effect::Arm(ArmFault::Stalled),
        F::RobotSlow => Effect::Arm(ArmFault::Friction(FRICTION_N_S_M)),
        F::RobotZHigh => z_offset(Z_ERROR_M),
        F::RobotZLow => z_offset(-Z_ERROR_M),
        F::RobotStale => Effect::Arm(ArmFault::PositionStale),
        F::RobotSettingIgnored => Effect::Arm(ArmFault::SettingIgnored(Setting::MotorRatio)),
        F::CameraClockStep(_)
        | F::CameraHot(_)
        | F::TriggerLost
        | F::TriggerDoubled
        | F::TriggerDelayed
        | F::RobotForceSpike
        | F::RecorderSlow
        | F::DiskFull
        | F::Killed => {
            return Err(UnsupportedFault {
                fault,
                rig: "the emulated bench",
            });
        }
    })
}

impl EmulatedBench {
    /// Injects a fault now.
    ///
    /// # Errors
    /// [`InjectionError::Unsupported`] for a step of a camera's clock, a hot camera, lost, doubled and delayed marks, a
    /// spike of the force, and faults of the computer.
    pub fn inject(&mut self, fault: RigFault) -> Result<(), InjectionError> {
        match effect(fault).map_err(InjectionError::Unsupported)? {
            Effect::Camera(camera, order) => {
                let remote = self.bus.remote()?;
                remote.order(CAMERA_SERIALS[camera.index()], order)?;
            }
            Effect::Wire(camera, wire) => self.connections.wire(camera, wire),
            Effect::BoxUnplugged => {
                self.trigger_box.unplug()?;
            }
            Effect::BoxNoise(noise) => {
                self.trigger_box.noise(NOISE_SEED, noise)?;
            }
            Effect::Arm(fault) => self.arm.inject(When::Now, fault)?,
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fault_has_an_effect_of_its_own_or_is_refused() {
        let mut effects: Vec<Effect> = Vec::new();
        let mut refused = Vec::new();
        for (name, fault) in RigFault::NAMES {
            match effect(fault) {
                Ok(effect) => {
                    assert!(!effects.contains(&effect), "{name}: {effect:?}");
                    effects.push(effect);
                }
                Err(error) => {
                    assert!(error.to_string().contains(name), "{error}");
                    refused.push(name);
                }
            }
        }
        assert_eq!(
            refused,
            [
                "camera1-clock-step",
                "camera2-clock-step",
                "camera1-hot",
                "camera2-hot",
                "trigger-lost",
                "trigger-doubled",
                "trigger-delayed",
                "robot-force-spike",
                "recorder-slow",
                "disk-full",
                "killed",
            ]
        );
    }
}
