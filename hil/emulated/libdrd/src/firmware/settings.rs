//! Parameters of the library: validated when set, read back unchanged.

use skinrig_drd_abi::ErrorCode;

use super::trajectory::Limits;
use crate::config::{ArmConfig, Setting};

/// Every parameter.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Degrees.
    pub device_angle: f64,
    /// Degrees.
    pub base_angle_x: f64,
    /// Degrees.
    pub base_angle_z: f64,
    /// kg.
    pub effector_mass: f64,
    /// Gravity compensation.
    pub gravity: bool,
    /// N.
    pub max_force: f64,
    /// Of moves.
    pub moves: Limits,
    /// Of tracking.
    pub tracking: Limits,
    /// 0 to 1.
    pub motor_ratio: f64,
    /// Proportional, integral, derivative.
    pub gains: [f64; 3],
    /// Filter of tracked targets.
    pub filter: bool,
    /// Translations, rotations, gripper.
    pub regulate: [bool; 3],
    /// Of the calling and of the regulation thread.
    pub priorities: [f64; 2],
    /// Units of 125 us.
    pub watchdog: u8,
}

/// The vendor's initial values.
const START: Limits = Limits {
    amax: 1.0,
    vmax: 1.0,
    jerk: 1.0,
};

impl Settings {
    /// State after an open.
    pub fn new(config: &ArmConfig) -> Self {
        Self {
            device_angle: 0.0,
            base_angle_x: 0.0,
            base_angle_z: 0.0,
            effector_mass: config.assumed_mass_kg,
            gravity: true,
            max_force: -1.0,
            moves: START,
            tracking: START,
            motor_ratio: 1.0,
            gains: [4.0, 1.0, 1.0],
            filter: false,
            regulate: [true; 3],
            priorities: [0.0; 2],
            watchdog: config.watchdog,
        }
    }

    /// Sets one parameter.
    ///
    /// # Errors
    /// [`ErrorCode::INVALID`] for a value out of range; the parameter is unchanged.
    pub fn set(&mut self, setting: Setting, values: &[f64]) -> Result<(), ErrorCode> {
        if values.iter().any(|v| !v.is_finite()) {
            return Err(ErrorCode::INVALID);
        }
        match (setting, values) {
            (Setting::DeviceAngle, &[deg]) => self.device_angle = deg,
            (Setting::BaseAngleX, &[deg]) => self.base_angle_x = deg,
            (Setting::BaseAngleZ, &[deg]) => self.base_angle_z = deg,
            (Setting::EffectorMass, &[kg]) if kg >= 0.0 => self.effector_mass = kg,
            (Setting::Gravity, &[on]) => self.gravity = on != 0.0,
            (Setting::MaxForce, &[n]) => self.max_force = n,
            (Setting::MoveParam, &[amax, vmax, jerk]) => self.moves = limits(amax, vmax, jerk)?,
            (Setting::TrackParam, &[amax, vmax, jerk]) => self.tracking = limits(amax, vmax, jerk)?,
            (Setting::MotorRatio, &[ratio]) if (0.0..=1.0).contains(&ratio) => {
                self.motor_ratio = ratio;
            }
            (Setting::GainP, &[gain]) if gain >= 0.0 => self.gains[0] = gain,
            (Setting::GainI, &[gain]) if gain >= 0.0 => self.gains[1] = gain,
            (Setting::GainD, &[gain]) if gain >= 0.0 => self.gains[2] = gain,
            (Setting::Filter, &[on]) => self.filter = on != 0.0,
            (Setting::RegulatePos, &[on]) => self.regulate[0] = on != 0.0,
            (Setting::RegulateRot, &[on]) => self.regulate[1] = on != 0.0,
            (Setting::RegulateGrip, &[on]) => self.regulate[2] = on != 0.0,
            (Setting::Priorities, &[calling, regulation]) => {
                self.priorities = [calling, regulation];
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "in range by the guard"
            )]
            (Setting::Watchdog, &[units]) if (0.0..=255.0).contains(&units) => {
                self.watchdog = units as u8;
            }
            _ => return Err(ErrorCode::INVALID),
        }
        Ok(())
    }

    /// Reads one parameter.
    pub fn get(&self, setting: Setting) -> Vec<f64> {
        let flag = |on: bool| vec![f64::from(u8::from(on))];
        match setting {
            Setting::DeviceAngle => vec![self.device_angle],
            Setting::BaseAngleX => vec![self.base_angle_x],
            Setting::BaseAngleZ => vec![self.base_angle_z],
            Setting::EffectorMass => vec![self.effector_mass],
            Setting::Gravity => flag(self.gravity),
            Setting::MaxForce => vec![self.max_force],
            Setting::MoveParam => vec![self.moves.amax, self.moves.vmax, self.moves.jerk],
            Setting::TrackParam => vec![self.tracking.amax, self.tracking.vmax, self.tracking.jerk],
            Setting::MotorRatio => vec![self.motor_ratio],
            Setting::GainP => vec![self.gains[0]],
            Setting::GainI => vec![self.gains[1]],
            Setting::GainD => vec![self.gains[2]],
            Setting::Filter => flag(self.filter),
            Setting::RegulatePos => flag(self.regulate[0]),
            Setting::RegulateRot => flag(self.regulate[1]),
            Setting::RegulateGrip => flag(self.regulate[2]),
            Setting::Priorities => self.priorities.to_vec(),
            Setting::Watchdog => vec![f64::from(self.watchdog)],
        }
    }
}

/// Limits of a motion; each must be positive (what a negative jerk means is not documented).
fn limits(amax: f64, vmax: f64, jerk: f64) -> Result<Limits, ErrorCode> {
    if amax > 0.0 && vmax > 0.0 && jerk > 0.0 {
        Ok(Limits { amax, vmax, jerk })
    } else {
        Err(ErrorCode::INVALID)
    }
}
