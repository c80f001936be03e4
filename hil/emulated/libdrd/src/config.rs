//! What an emulated arm is, and what can go wrong with it.

use serde::{Deserialize, Serialize};

/// A simulated arm. The defaults are plausible for an omega.3; none is the vendor's number unless told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmConfig {
    /// Version of the SDK that the library claims: major, minor, release.
    pub sdk: [i32; 3],
    /// Every connected device; only the one at `arm_index` has an arm.
    pub devices: Vec<DeviceConfig>,
    /// Which of the devices is the arm.
    pub arm_index: usize,
    /// Whether the arm was calibrated since power-up.
    pub initialised: bool,
    /// Duration of `drdAutoInit`'s search once the arm has moved to its known position, s.
    pub auto_init_s: f64,
    /// Where the tip starts, m.
    pub start_m: [f64; 3],
    /// Centre of the reachable sphere, m.
    pub reach_centre_m: [f64; 3],
    /// Radius of the reachable sphere, m; end stops beyond. (The z range of 165 mm is that reported by users.)
    pub reach_radius_m: f64,
    /// Moving mass as the motors feel it, kg.
    pub inertia_kg: f64,
    /// Mass that gravity pulls at the effector, kg.
    pub gravity_mass_kg: f64,
    /// Mass that gravity compensation assumes until told otherwise, kg.
    pub assumed_mass_kg: f64,
    /// True tilt of the base about the inverted y axis, degrees.
    pub tilt_deg: f64,
    /// Friction of the joints: constant part, N.
    pub dry_friction_n: f64,
    /// Friction of the joints: part in proportion to speed, N per (m/s).
    pub viscous_friction_n_s_m: f64,
    /// Electromagnetic brake, N per (m/s).
    pub brake_n_s_m: f64,
    /// Largest force of the motors, N (12 N is the vendor's number).
    pub max_force_n: f64,
    /// Speed of one axis at which the controller takes the power off, m/s.
    pub velocity_trip_m_s: f64,
    /// Watchdog at power-up, units of 125 us; 0 is off.
    pub watchdog: u8,
    /// Rate of the regulation loop, kHz, at most 4.
    pub loop_khz: f64,
    /// Step of the reported position, m.
    pub resolution_m: f64,
    /// Sample under the tip.
    pub contact: Option<Contact>,
    /// A true C++ `bool` comes back as a byte other than 1.
    pub odd_bools: bool,
    /// The journal also holds calls that only read.
    pub journal_reads: bool,
}

impl Default for ArmConfig {
    fn default() -> Self {
        Self {
            sdk: [3, 17, 5],
            devices: vec![DeviceConfig::default()],
            arm_index: 0,
            initialised: true,
            auto_init_s: 0.2,
            start_m: [0.0125, 0.0, 0.02],
            reach_centre_m: [0.0125, 0.0, 0.0175],
            reach_radius_m: 0.0825,
            inertia_kg: 0.25,
            gravity_mass_kg: 0.12,
            assumed_mass_kg: 0.115,
            tilt_deg: 0.0,
            dry_friction_n: 0.03,
            viscous_friction_n_s_m: 1.0,
            brake_n_s_m: 200.0,
            max_force_n: 12.0,
            velocity_trip_m_s: 0.4,
            watchdog: 0,
            loop_khz: 4.0,
            resolution_m: 1e-5,
            contact: None,
            odd_bools: true,
            journal_reads: true,
        }
    }
}

/// How a device names itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DeviceConfig {
    /// Type number.
    pub device_type: i32,
    /// Serial number.
    pub serial: u16,
    /// Version of the controller's firmware.
    pub firmware: f64,
}

impl Default for DeviceConfig {
    fn default() -> Self {
        Self {
            device_type: skinrig_drd_abi::DEVICE_OMEGA3,
            serial: 1234,
            firmware: 3.0,
        }
    }
}

/// A flat elastic sample: pushes back along its normal, never pulls.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// A point of the surface, robot frame, m.
    pub point_m: [f64; 3],
    /// Normal out of the sample; any length but 0.
    pub normal: [f64; 3],
    /// N/m.
    pub stiffness_n_m: f64,
    /// N per (m/s).
    pub damping_n_s_m: f64,
}

impl Contact {
    /// A horizontal surface at the height `z_m` with the stiffness of a soft skin.
    #[must_use]
    pub fn horizontal(z_m: f64) -> Self {
        Self {
            point_m: [0.0, 0.0, z_m],
            normal: [0.0, 0.0, 1.0],
            stiffness_n_m: 1000.0,
            damping_n_s_m: 5.0,
        }
    }
}

/// A parameter that can be set and read back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Setting {
    /// Tilt of the base about the inverted y axis, degrees.
    DeviceAngle,
    /// Rotation of the base about x, degrees. Without effect on the simulated arm.
    BaseAngleX,
    /// Rotation of the base about z, degrees. Without effect on the simulated arm.
    BaseAngleZ,
    /// Mass that gravity compensation assumes, kg.
    EffectorMass,
    /// Gravity compensation, 1 or 0.
    Gravity,
    /// Largest force of the haptic calls, N. Without effect on regulation.
    MaxForce,
    /// Acceleration, speed, jerk of moves.
    MoveParam,
    /// Acceleration, speed, jerk of tracking.
    TrackParam,
    /// Largest fraction of motor torque.
    MotorRatio,
    /// Proportional gain.
    GainP,
    /// Integral gain.
    GainI,
    /// Derivative gain.
    GainD,
    /// Filter of tracked targets, 1 or 0.
    Filter,
    /// Regulation of the translations, 1 or 0.
    RegulatePos,
    /// Regulation of the rotations, 1 or 0. Without effect: the arm has none.
    RegulateRot,
    /// Regulation of the gripper, 1 or 0. Without effect: the arm has none.
    RegulateGrip,
    /// Priorities of the calling and of the regulation thread. Without effect.
    Priorities,
    /// Watchdog, units of 125 us.
    Watchdog,
}

/// Something that goes wrong. Faults stay until [`EmulatedArm::clear_faults`](crate::EmulatedArm::clear_faults)
/// unless they are events.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Fault {
    /// Every open fails with this code.
    Open(i32),
    /// Another process holds the arm.
    Busy,
    /// The device claims another type.
    DeviceType(i32),
    /// The serial number cannot be read.
    NoSerial,
    /// The library has no gains for the device.
    Unsupported,
    /// The test of the controller's memory fails.
    ControllerMemory,
    /// `drdAutoInit` fails with this code.
    AutoInitFails(i32),
    /// `drdAutoInit` never comes back.
    AutoInitHangs,
    /// `drdStart` fails with this code.
    StartFails(i32),
    /// Event: the regulation thread ends and the library brakes.
    RegulationDies,
    /// The regulation thread is suspended altogether: no more force commands, nobody notices.
    RegulationHangs,
    /// The regulation loop runs at this rate, kHz.
    LoopRate(f64),
    /// USB is unplugged until the faults are cleared; the library needs a new open.
    Unplug,
    /// Event: the mains went off and on; the arm needs a new open and calibration.
    PowerLoss,
    /// Event: someone pressed the force button on the base. The next press allows forces again.
    Button,
    /// Event: the velocity trip.
    VelocityTrip,
    /// Event: the watchdog's trip.
    WatchdogTrip,
    /// Something blocks the arm where it is.
    Jammed,
    /// The joints rub: this much more viscous friction, N per (m/s).
    Friction(f64),
    /// `drdIsMoving` never becomes false; blocking moves never come back.
    MovingForever,
    /// Every reported position is NaN.
    PositionNan,
    /// Every reported position is off by this, m.
    PositionJump([f64; 3]),
    /// Reported positions no longer change, and neither does the loop's counter.
    PositionFrozen,
    /// Every reported force is off by this, N.
    ForceOffset([f64; 3]),
    /// Reported forces drift along z, N/s.
    ForceDrift(f64),
    /// Reported forces are noisy with this standard deviation, N.
    ForceNoise(f64),
    /// The setting reports success and keeps its value.
    Ignore(Setting),
    /// The next n calls of `drdStop` and of `dhdStop` fail.
    StopFails(u32),
    /// `drdStop` answers 0 and does nothing unless a regulation runs: what the vendor's does then is not documented.
    StopNeedsRegulation,
    /// The next n calls of `drdClose` fail.
    CloseFails(u32),
    /// The status vector has only this many words.
    StatusLength(usize),
}

/// When a fault sets in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum When {
    /// At once.
    Now,
    /// After this time, s.
    After(f64),
    /// This time after the next move or tracked target is accepted, s.
    IntoMove(f64),
    /// When the tip is below this height, m.
    Below(f64),
    /// When the tip touches the sample.
    Contact,
}
