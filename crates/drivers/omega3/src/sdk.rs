//! What the driver asks of the vendor's library: one method per call, safe, each failure with its cause.
//!
//! This is the driver's lower seam. [`crate::library::Library`] implements it over a loaded libdrd; tests script it.

use std::fmt;

use skinrig_drd_abi::{DeviceId, ErrorCode, SdkVersion, StatusVector};

/// A call failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CallError {
    /// The function.
    pub call: &'static str,
    /// The code that the library kept for the calling thread.
    pub code: ErrorCode,
    /// The library's own words.
    pub text: String,
}

impl fmt::Display for CallError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} failed: {}", self.call, self.code)?;
        if self.text.is_empty() {
            return Ok(());
        }
        write!(f, ", the library says \"{}\"", self.text)
    }
}

impl std::error::Error for CallError {}

/// The answer to a call.
pub type Answer<T> = Result<T, CallError>;

/// A position as the library gave it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// On the device's axes, m.
    pub position_m: [f64; 3],
    /// True when the library repeats an earlier reading because it was asked again too soon.
    pub cached: bool,
}

/// A quantity that can be set and read back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Tilt of the base, degrees.
    DeviceAngleDeg,
    /// Mass at the end of the arm, kg.
    EffectorMassKg,
    /// Ceiling of the haptic force calls, N. Optional; whether regulation obeys it is not documented.
    MaxForceN,
    /// Proportional gain.
    GainP,
    /// Integral gain.
    GainI,
    /// Derivative gain.
    GainD,
    /// Share of each joint's torque that regulation may use.
    MotorRatio,
}

impl Quantity {
    /// Name for settings and messages.
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

/// Which trajectory generator of the library.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Generator {
    /// Of moves; we never move by it, and limit it all the same.
    Move,
    /// Of tracked targets.
    Track,
}

impl Generator {
    /// Name for settings and messages.
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
pub struct Pace {
    /// m/s².
    pub acceleration_m_s2: f64,
    /// m/s.
    pub speed_m_s: f64,
    /// m/s³.
    pub jerk_m_s3: f64,
}

impl fmt::Display for Pace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} m/s2, {} m/s, {} m/s3",
            self.acceleration_m_s2, self.speed_m_s, self.jerk_m_s3
        )
    }
}

/// The calls. Each failure carries the code of the calling thread, read at once.
///
/// `None` from an optional function: this version of the library lacks it.
pub trait Sdk: Send + Sync {
    /// Version of the library.
    fn version(&self) -> SdkVersion;
    /// Connected devices, also those that other processes hold.
    fn device_count(&self) -> Answer<i8>;
    /// Opens the device at this place of the enumeration.
    fn open(&self, index: i8) -> Answer<DeviceId>;
    /// Closes a device.
    fn close(&self, id: DeviceId) -> Answer<()>;

    /// Type number.
    fn system_type(&self, id: DeviceId) -> Answer<i32>;
    /// Name of the model.
    fn system_name(&self, id: DeviceId) -> Option<String>;
    /// Serial number.
    fn serial(&self, id: DeviceId) -> Answer<u16>;
    /// Version of the controller's firmware.
    fn firmware(&self, id: DeviceId) -> Answer<f64>;
    /// How the library speaks to the device.
    fn com_mode(&self, id: DeviceId) -> Answer<i32>;
    /// Tests the controller's memory.
    fn check_memory(&self, id: DeviceId) -> Option<Answer<()>>;
    /// The status vector.
    fn status(&self, id: DeviceId) -> Answer<StatusVector>;
    /// Whether the library can regulate this model.
    fn is_supported(&self, id: DeviceId) -> bool;
    /// Whether the device is calibrated since power-up.
    fn is_initialized(&self, id: DeviceId) -> bool;
    /// Calibrates: moves the arm, blocks.
    fn auto_init(&self, id: DeviceId) -> Answer<()>;

    /// Sets a quantity.
    fn set(&self, id: DeviceId, quantity: Quantity, value: f64) -> Option<Answer<()>>;
    /// Reads a quantity.
    fn get(&self, id: DeviceId, quantity: Quantity) -> Option<Answer<f64>>;
    /// Gravity compensation on.
    fn compensate_gravity(&self, id: DeviceId) -> Answer<()>;
    /// Allows the watchdog to be set.
    fn enable_expert_mode(&self) -> Answer<()>;
    /// Watchdog time in units of 125 us, 0 for off.
    fn watchdog(&self, id: DeviceId) -> Answer<u8>;
    /// Sets the watchdog time.
    fn set_watchdog(&self, id: DeviceId, units: u8) -> Answer<()>;
    /// Velocity threshold in units of the device.
    fn velocity_threshold(&self, id: DeviceId) -> Answer<u32>;

    /// Starts the regulation.
    fn start(&self, id: DeviceId) -> Answer<()>;
    /// Stops the regulation and brakes.
    fn stop(&self, id: DeviceId) -> Answer<()>;
    /// Whether the regulation lives.
    fn is_running(&self, id: DeviceId) -> bool;
    /// Mean rate of the regulation since the last call, kHz.
    fn control_khz(&self, id: DeviceId) -> Answer<f64>;
    /// Regulates the translations.
    fn regulate_position(&self, id: DeviceId) -> Answer<()>;
    /// Turns the filter of tracked targets on.
    fn enable_filter(&self, id: DeviceId) -> Answer<()>;
    /// Whether that filter is on.
    fn is_filtering(&self, id: DeviceId) -> bool;
    /// Sets the limits of a trajectory generator.
    fn set_pace(&self, id: DeviceId, generator: Generator, pace: Pace) -> Answer<()>;
    /// Reads the limits of a trajectory generator.
    fn pace(&self, id: DeviceId, generator: Generator) -> Answer<Pace>;
    /// Sends the regulation a target, m.
    fn track(&self, id: DeviceId, target_m: [f64; 3]) -> Answer<()>;

    /// Position in the regulation's buffer.
    fn regulated_position(&self, id: DeviceId) -> Answer<Reading>;
    /// Position, asked from the device.
    fn position(&self, id: DeviceId) -> Answer<Reading>;
    /// Commanded motor force without gravity, N.
    fn force(&self, id: DeviceId) -> Answer<[f64; 3]>;

    /// Motors off, brake on.
    fn emergency_stop(&self, id: DeviceId) -> Answer<()>;
    /// Motor power off.
    fn force_off(&self, id: DeviceId) -> Answer<()>;
}
