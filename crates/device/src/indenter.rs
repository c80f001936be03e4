//! The robot that presses.

use skinrig_model::{DeviceIdentity, HostTime, Point3, Robot, Setting};

use crate::DeviceError;

/// What an indenter can do.
#[derive(Debug, Clone, PartialEq)]
pub struct IndenterCapabilities {
    /// Smallest reachable coordinates, robot frame, mm.
    pub workspace_min_mm: [f64; 3],
    /// Largest reachable coordinates, robot frame, mm.
    pub workspace_max_mm: [f64; 3],
    /// Fastest straight-line motion, mm/s.
    pub max_speed_mm_s: f64,
    /// Largest acceleration of its set point, mm/s².
    pub max_acceleration_mm_s2: f64,
    /// Largest force it can exert, N.
    pub max_force_n: f64,
    /// Rate of the pose stream, Hz of host time.
    pub pose_rate_hz: f64,
    /// Whether samples carry a force.
    pub reports_force: bool,
}

/// Limits that the device itself enforces from now on, whatever it is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Lowest allowed coordinates, robot frame, mm.
    pub min_mm: [f64; 3],
    /// Highest allowed coordinates, robot frame, mm.
    pub max_mm: [f64; 3],
    /// mm/s.
    pub max_speed_mm_s: f64,
    /// mm/s², of the set point.
    pub max_acceleration_mm_s2: f64,
    /// N.
    pub max_force_n: f64,
}

/// One sample of the device's pose stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotSample {
    /// When it was measured.
    pub t: HostTime,
    /// The set point at that time, mm.
    pub commanded: Point3<Robot>,
    /// The measured tip, mm.
    pub measured: Point3<Robot>,
    /// Force along the robot's z axis, N, positive pushing the tip up; NaN when unknown.
    pub force_n: f64,
}

/// A robot that moves a tip along straight lines.
///
/// States: disarmed (brakes on) -> [`arm`](Self::arm) -> armed -> [`disarm`](Self::disarm) -> disarmed.
pub trait Indenter: Send {
    /// Who it is.
    fn identity(&self) -> DeviceIdentity;

    /// What it can do.
    fn capabilities(&self) -> IndenterCapabilities;

    /// Sets limits and reads them back.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] for limits wider than the capabilities or not finite;
    /// [`DeviceError::ReadBack`] when they did not take.
    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError>;

    /// Powers the motors and holds the present position.
    ///
    /// # Errors
    /// [`DeviceError::State`] before [`configure`](Self::configure); [`DeviceError::Lost`].
    fn arm(&mut self) -> Result<(), DeviceError>;

    /// Starts a straight move to `target` at `speed_mm_s` and returns at once; replaces a running move.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] outside the limits or not finite (the present motion goes on unchanged);
    /// [`DeviceError::State`] when not armed; [`DeviceError::Lost`].
    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError>;

    /// Appends every sample since the last call, in time order without duplicates, up to the present.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] when the stream broke; samples already appended stay valid.
    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError>;

    /// Stops where it is and holds.
    ///
    /// # Errors
    /// [`DeviceError::Lost`].
    fn hold(&mut self) -> Result<(), DeviceError>;

    /// Motors off, brakes on. Allowed in every state, any number of times.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]; the motors are then off by the device's own watchdog.
    fn disarm(&mut self) -> Result<(), DeviceError>;

    /// Appends what the operator should know and no sample says, such as the force that carries the arm.
    fn take_notes(&mut self, _notes: &mut Vec<String>) {}
}

/// Whoever holds one for a while may lend it on.
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
