//! The `Indenter` trait: the robot that presses.

use skinrig_model::{DeviceIdentity, HostTime, Point3, Robot, Setting};

use crate::DeviceError;

/// Capabilities of an indenter.
#[derive(Debug, Clone, PartialEq)]
pub struct IndenterCapabilities {
    /// Smallest reachable coordinates, robot frame, mm.
    pub workspace_min_mm: [f64; 3],
    /// Largest reachable coordinates, robot frame, mm.
    pub workspace_max_mm: [f64; 3],
    /// Largest speed of a straight-line motion, mm/s.
    pub max_speed_mm_s: f64,
    /// Largest acceleration of its set point, mm/s².
    pub max_acceleration_mm_s2: f64,
    /// Largest force it can exert, N.
    pub max_force_n: f64,
    /// Rate of the pose stream, Hz of host time.
    pub pose_rate_hz: f64,
    /// Whether samples contain a force.
    pub reports_force: bool,
}

/// Limits that the device itself enforces for all commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Lowest allowed coordinates, robot frame, mm.
    pub min_mm: [f64; 3],
    /// Highest allowed coordinates, robot frame, mm.
    pub max_mm: [f64; 3],
    /// Largest speed, mm/s.
    pub max_speed_mm_s: f64,
    /// Largest acceleration of the set point, mm/s².
    pub max_acceleration_mm_s2: f64,
    /// Largest force, N.
    pub max_force_n: f64,
}

/// A sample of the pose stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotSample {
    /// Time of the measurement.
    pub t: HostTime,
    /// Set point at that time, mm.
    pub commanded: Point3<Robot>,
    /// Measured tip position, mm.
    pub measured: Point3<Robot>,
    /// Force along the robot's z axis, N; positive pushes the tip up; NaN if unknown.
    pub force_n: f64,
}

/// A robot that moves its tip along straight lines.
///
/// States: disarmed (brakes on) -> [`arm`](Self::arm) -> armed -> [`disarm`](Self::disarm) -> disarmed.
pub trait Indenter: Send {
    /// Model, serial number and firmware.
    fn identity(&self) -> DeviceIdentity;

    /// Capabilities.
    fn capabilities(&self) -> IndenterCapabilities;

    /// Writes limits and reads them back.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] for limits wider than the capabilities or not finite;
    /// [`DeviceError::ReadBack`] if they read back with other values.
    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError>;

    /// Powers the motors and holds the current position.
    ///
    /// # Errors
    /// [`DeviceError::State`] before [`configure`](Self::configure); [`DeviceError::Lost`].
    fn arm(&mut self) -> Result<(), DeviceError>;

    /// Starts a straight move to `target` at `speed_mm_s` and returns at once. Replaces a running move.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] outside the limits or not finite (the current motion continues unchanged);
    /// [`DeviceError::State`] when not armed; [`DeviceError::Lost`].
    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError>;

    /// Appends all samples since the last call, in time order and without duplicates.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] if the stream failed; samples already appended stay valid.
    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError>;

    /// Stops and holds the current position.
    ///
    /// # Errors
    /// [`DeviceError::Lost`].
    fn hold(&mut self) -> Result<(), DeviceError>;

    /// Switches the motors off and the brakes on. Allowed in every state, any number of times.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]; the device's watchdog then switches the motors off.
    fn disarm(&mut self) -> Result<(), DeviceError>;

    /// Appends notes for the operator that samples do not show, such as the force that carries the arm.
    fn take_notes(&mut self, _notes: &mut Vec<String>) {}
}

/// Allows passing an indenter on by mutable reference.
impl<T: Indenter + ?Sized> Indenter for &mut T {
    fn identity(&self) -> DeviceIdentity {
        (**self).identity()
    }

    fn capabilities(&self) -> IndenterCapabilities {
        (**self).capabilities()
    }

    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        (**self).configure(limits)
    }

    fn arm(&mut self) -> Result<(), DeviceError> {
        (**self).arm()
    }

    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        (**self).command(target, speed_mm_s)
    }

    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        (**self).poll(samples)
    }

    fn hold(&mut self) -> Result<(), DeviceError> {
        (**self).hold()
    }

    fn disarm(&mut self) -> Result<(), DeviceError> {
        (**self).disarm()
    }

    fn take_notes(&mut self, notes: &mut Vec<String>) {
        (**self).take_notes(notes);
    }
}
