//! The `Sdk` trait: the library's calls as safe methods with typed errors.
//!
//! [`crate::library::Library`] implements it with a loaded libdrd; tests use a scripted implementation.

use std::fmt;

use skinrig_drd_abi::{DeviceId, ErrorCode, SdkVersion, StatusVector};

/// A failed library call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CallError {
    /// Name of the function.
    pub call: &'static str,
    /// Error code that the library keeps for the calling thread.
    pub code: ErrorCode,
    /// The library's message.
    pub text: String,
}

impl fmt::Display for CallError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} failed: {}", self.call, self.code)?;
        if self.text.is_empty() {
            return Ok(());
        }
        write!(f, ", library message \"{}\"", self.text)
    }
}

impl std::error::Error for CallError {}

/// Result of a call.
pub type CallResult<T> = Result<T, CallError>;

/// A position reported by the library.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// On the device's axes, m.
    pub position_m: [f64; 3],
    /// Whether the library repeats an earlier reading because it was called again too soon.
    pub cached: bool,
}

/// A quantity that can be written and read back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Tilt of the base, degrees.
    DeviceAngleDeg,
    /// Mass at the end of the arm, kg.
    EffectorMassKg,
    /// Limit of the haptic force calls, N. Optional; it is not documented whether regulation respects it.
    MaxForceN,
    /// Proportional gain.
    GainP,
    /// Integral gain.
    GainI,
    /// Derivative gain.
    GainD,
    /// Share of each joint's torque available to regulation.
    MotorRatio,
}

impl Quantity {
    /// Name in settings and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DeviceAngleDeg => "device_angle_deg",
            Self::EffectorMassKg => "effector_mass_kg",
            Self::MaxForceN => "haptic_max_force_n",
            Self::GainP => "gain_p",
            Self::GainI => "gain_i",
            Self::GainD => "gain_d",
            Self::MotorRatio => "motor_ratio_max",
        }
    }
}

/// A trajectory generator of the library.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Generator {
    /// For moves. The driver never uses it but limits it anyway.
    Move,
    /// For tracked targets.
    Track,
}

impl Generator {
    /// Name in settings and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Move => "move_parameters",
            Self::Track => "track_parameters",
        }
    }
}

/// Limits of a trajectory generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeneratorLimits {
    /// m/s².
    pub acceleration_m_s2: f64,
    /// m/s.
    pub speed_m_s: f64,
    /// m/s³.
    pub jerk_m_s3: f64,
}

impl fmt::Display for GeneratorLimits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} m/s2, {} m/s, {} m/s3",
            self.acceleration_m_s2, self.speed_m_s, self.jerk_m_s3
        )
    }
}

/// Library calls. Each failure contains the error code of the calling thread, read immediately.
///
/// `None` from an optional function: not available in this version of the library.
pub trait Sdk: Send + Sync {
    /// Version of the library.
    fn version(&self) -> SdkVersion;
    /// Number of connected devices, including those in use by other processes.
    fn device_count(&self) -> CallResult<i8>;
    /// Opens the device with this index in the enumeration.
    fn open(&self, index: i8) -> CallResult<DeviceId>;
    /// Closes a device.
    fn close(&self, id: DeviceId) -> CallResult<()>;

    /// Type number.
    fn system_type(&self, id: DeviceId) -> CallResult<i32>;
    /// Name of the model.
    fn system_name(&self, id: DeviceId) -> Option<String>;
    /// Serial number.
    fn serial(&self, id: DeviceId) -> CallResult<u16>;
    /// Firmware version of the controller.
    fn firmware(&self, id: DeviceId) -> CallResult<f64>;
    /// Communication mode.
    fn com_mode(&self, id: DeviceId) -> CallResult<i32>;
    /// Tests the controller's memory.
    fn check_memory(&self, id: DeviceId) -> Option<CallResult<()>>;
    /// The status vector.
    fn status(&self, id: DeviceId) -> CallResult<StatusVector>;
    /// Whether the library can regulate this model.
    fn is_supported(&self, id: DeviceId) -> bool;
    /// Whether the device has been calibrated since power-up.
    fn is_initialized(&self, id: DeviceId) -> bool;
    /// Calibrates the device. Moves the arm and blocks.
    fn auto_init(&self, id: DeviceId) -> CallResult<()>;

    /// Writes a quantity.
    fn set(&self, id: DeviceId, quantity: Quantity, value: f64) -> Option<CallResult<()>>;
    /// Reads a quantity.
    fn get(&self, id: DeviceId, quantity: Quantity) -> Option<CallResult<f64>>;
    /// Switches gravity compensation on.
    fn compensate_gravity(&self, id: DeviceId) -> CallResult<()>;
    /// Enables expert mode, which is needed for the watchdog.
    fn enable_expert_mode(&self) -> CallResult<()>;
    /// Watchdog timeout in units of 125 µs; 0 means off.
    fn watchdog(&self, id: DeviceId) -> CallResult<u8>;
    /// Sets the watchdog timeout.
    fn set_watchdog(&self, id: DeviceId, units: u8) -> CallResult<()>;
    /// Velocity threshold in device units.
    fn velocity_threshold(&self, id: DeviceId) -> CallResult<u32>;

    /// Starts the regulation.
    fn start(&self, id: DeviceId) -> CallResult<()>;
    /// Stops the regulation and brakes.
    fn stop(&self, id: DeviceId) -> CallResult<()>;
    /// Whether the regulation is running.
    fn is_running(&self, id: DeviceId) -> bool;
    /// Mean rate of the regulation since the last call, kHz.
    fn control_khz(&self, id: DeviceId) -> CallResult<f64>;
    /// Switches position regulation on.
    fn regulate_position(&self, id: DeviceId) -> CallResult<()>;
    /// Switches the filter of tracked targets on.
    fn enable_filter(&self, id: DeviceId) -> CallResult<()>;
    /// Whether that filter is on.
    fn is_filtering(&self, id: DeviceId) -> bool;
    /// Sets the limits of a trajectory generator.
    fn set_generator_limits(
        &self,
        id: DeviceId,
        generator: Generator,
        limits: GeneratorLimits,
    ) -> CallResult<()>;
    /// Reads the limits of a trajectory generator.
    fn generator_limits(&self, id: DeviceId, generator: Generator) -> CallResult<GeneratorLimits>;
    /// Sends a target to the regulation, m.
    fn track(&self, id: DeviceId, target_m: [f64; 3]) -> CallResult<()>;

    /// Position in the regulation's buffer.
    fn regulated_position(&self, id: DeviceId) -> CallResult<Reading>;
    /// Position read from the device.
    fn position(&self, id: DeviceId) -> CallResult<Reading>;
    /// Commanded motor force without gravity compensation, N.
    fn force(&self, id: DeviceId) -> CallResult<[f64; 3]>;

    /// Motors off, brake on.
    fn emergency_stop(&self, id: DeviceId) -> CallResult<()>;
    /// Motor power off.
    fn force_off(&self, id: DeviceId) -> CallResult<()>;
}
