//! Configuration and faults of an emulated arm.

use serde::{Deserialize, Serialize};

/// An emulated arm. The defaults are plausible for an omega.3; only those marked as such are the vendor's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmConfig {
    /// SDK version that the library reports: major, minor, release.
    pub sdk: [i32; 3],
    /// All connected devices; only the one at `arm_index` has an arm.
    pub devices: Vec<DeviceConfig>,
    /// Index of the device with the arm.
    pub arm_index: usize,
    /// Whether the arm has been calibrated since power-up.
    pub initialised: bool,
    /// Duration of `drdAutoInit` after the arm has reached its reference position, s.
    pub auto_init_s: f64,
    /// Initial tip position, m.
    pub start_m: [f64; 3],
    /// Centre of the reachable sphere, m.
    pub reach_centre_m: [f64; 3],
    /// Radius of the reachable sphere, m, with end stops beyond. (Users report a z range of 165 mm.)
    pub reach_radius_m: f64,
    /// Moving mass felt by the motors, kg.
    pub inertia_kg: f64,
    /// Mass at the effector under gravity, kg.
    pub gravity_mass_kg: f64,
    /// Initial mass of the gravity compensation, kg.
    pub assumed_mass_kg: f64,
    /// True tilt of the base about the inverted y axis, degrees.
    pub tilt_deg: f64,
    /// Joint friction: constant part, N.
    pub dry_friction_n: f64,
    /// Joint friction: part proportional to speed, N per (m/s).
    pub viscous_friction_n_s_m: f64,
    /// Electromagnetic brake, N per (m/s).
    pub brake_n_s_m: f64,
    /// Largest motor force, N (12 N is the vendor's number).
    pub max_force_n: f64,
    /// Speed of one axis at which the controller switches the power off, m/s.
    pub velocity_trip_m_s: f64,
    /// Watchdog at power-up, units of 125 µs; 0 is off.
    pub watchdog: u8,
    /// Rate of the regulation loop, kHz, at most 4.
    pub loop_khz: f64,
    /// Resolution of the reported position, m.
    pub resolution_m: f64,
    /// Sample under the tip.
    pub contact: Option<Contact>,
    /// Whether true C++ `bool`s are returned as a byte other than 1.
    pub odd_bools: bool,
    /// Whether the journal includes calls that only read.
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

/// Identity of a device.
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

/// A flat elastic sample that pushes along its normal and never pulls.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// A point of the surface, robot frame, m.
    pub point_m: [f64; 3],
    /// Outward normal of any non-zero length.
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
    /// Watchdog, units of 125 µs.
    Watchdog,
}

/// A fault of the arm, or of the vendor's library. Faults of the arm that every rig knows have the names of `skinrig_model::RigFault`.
///
/// Faults last until [`EmulatedArm::clear_faults`](crate::EmulatedArm::clear_faults), except those marked as events.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Fault {
    /// Every open fails with this code.
    Open(i32),
    /// Another process has the arm open.
    Busy,
    /// The device reports another type.
    DeviceType(i32),
    /// The serial number is unreadable.
    NoSerial,
    /// The library has no regulation gains for the device.
    Unsupported,
    /// The controller's memory test fails.
    ControllerMemory,
    /// `drdAutoInit` fails with this code.
    AutoInitFails(i32),
    /// `drdAutoInit` never returns.
    AutoInitHangs,
    /// `drdStart` fails with this code.
    StartFails(i32),
    /// Event: the regulation thread ends and the library brakes.
    RegulationDies,
    /// The regulation thread is suspended: force commands stop without any error.
    RegulationHangs,
    /// The regulation loop runs at this rate, kHz.
    LoopRate(f64),
    /// USB is disconnected until the faults are cleared; the device must be reopened.
    Lost,
    /// Event: a power cycle; the arm must be reopened and calibrated.
    PowerLost,
    /// Event: the force button on the base is pressed. Pressing it again allows forces.
    Button,
    /// Event: the velocity trip.
    VelocityTrip,
    /// Event: a watchdog trip.
    WatchdogTrip,
    /// The arm is blocked at its position.
    Stalled,
    /// Additional viscous friction of the joints, N per (m/s).
    Friction(f64),
    /// `drdIsMoving` stays true; blocking moves never return.
    MovingForever,
    /// Every reported position is NaN.
    PositionNan,
    /// Offset of every reported position, m.
    PositionOffset([f64; 3]),
    /// Reported positions and the loop's counter freeze.
    PositionStale,
    /// Offset of every reported force, N.
    ForceOffset([f64; 3]),
    /// Reported forces drift along z, N/s.
    ForceDrift(f64),
    /// Standard deviation of noise on reported forces, N.
    ForceNoise(f64),
    /// Writing the setting reports success but has no effect.
    SettingIgnored(Setting),
    /// The next n calls of `drdStop` and of `dhdStop` fail.
    StopFails(u32),
    /// `drdStop` returns 0 without effect unless a regulation runs; the vendor's behaviour is not documented.
    StopNeedsRegulation,
    /// The next n calls of `drdClose` fail.
    CloseFails(u32),
    /// Number of words in the status vector.
    StatusLength(usize),
}

/// When a fault starts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum When {
    /// Immediately.
    Now,
    /// After this time, s.
    After(f64),
    /// This time after the next accepted move or tracked target, s.
    IntoMove(f64),
    /// When the tip is below this height, m.
    Below(f64),
    /// When the tip touches the sample.
    Contact,
}
