//! A rig file: which device plays which role on a bench, where the skin lies, and what the bench bears.

mod build;
mod camera;
mod date;
mod fit;
mod frame;
mod hil;
pub(crate) mod keys;
mod robot;

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;
use skinrig_model::{CameraModel, HostDuration, Point3, RigidTransform, Robot, Skin};

pub use date::Date;
pub use hil::{Drill, HilSetup, Lamps};

use crate::surface::Surface;
use skinrig_settings::Diagnostics;

/// The value of an environment variable.
pub type Environment<'a> = &'a dyn Fn(&str) -> Option<String>;

/// A rig file that was read and checked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RigFile {
    /// The file's name as given to [`RigFile::parse`].
    pub file_name: String,
    /// The text as the user wrote it, byte for byte.
    pub text: String,
    /// Lower-case hex SHA-256 of the text.
    pub sha256: String,
    /// Name of the bench.
    pub name: String,
    /// Whether hardware stands behind the drivers.
    pub kind: RigKind,
    /// Anything worth keeping.
    pub description: Option<String>,
    /// Where the skin lies.
    pub frame: Frame,
    /// What the robot presses with.
    pub tip: Tip,
    /// What the bench bears.
    pub limits: BenchLimits,
    /// The robot.
    pub robot: RobotSetup,
    /// Camera 1 and camera 2.
    pub cameras: [CameraSetup; 2],
    /// The trigger box, when there is one.
    pub trigger_box: Option<BoxSetup>,
    /// What must hold before anything is armed.
    pub preflight: PreflightLimits,
    /// How presses find the surface, when the protocol does not say.
    pub surface: Option<Surface>,
    /// What a suite of checks may do.
    pub hil: HilSetup,
}

/// Whether hardware stands behind the drivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RigKind {
    /// Hardware.
    Bench,
    /// Stand-ins for hardware.
    Emulated,
}

impl RigKind {
    /// `bench` or `emulated`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bench => "bench",
            Self::Emulated => "emulated",
        }
    }
}

/// Where the skin lies in the robot's frame, and how that is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Frame {
    /// The transform.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// When it was measured.
    pub date: Date,
    /// The touched points that it was fitted to; `None` when it was given.
    pub touch_off: Option<TouchOff>,
}

/// Touched points and how well they fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TouchOff {
    /// At least three.
    pub points: Vec<TouchedPoint>,
    /// Root mean square of the points' distances from the fit, mm.
    pub rms_mm: f64,
    /// Largest of them, mm.
    pub worst_mm: f64,
    /// Largest that is allowed, mm.
    pub max_residual_mm: f64,
}

/// A touched point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TouchedPoint {
    /// For messages.
    pub name: String,
    /// Where it is on the skin.
    pub skin: Point3<Skin>,
    /// Where the tip was.
    pub robot: Point3<Robot>,
    /// Distance of the tip from where the fit puts the point, mm.
    pub residual_mm: f64,
}

/// The indenter's tip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tip {
    /// `cube`, `sphere` or `cylinder`.
    pub shape: &'static str,
    /// Side of a cube, diameter of the others, mm.
    pub size_mm: f64,
    /// With its holder, kg.
    pub mass_kg: Option<f64>,
}

/// What a bench bears.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BenchLimits {
    /// Lowest allowed coordinates, robot frame, mm.
    pub workspace_min_mm: [f64; 3],
    /// Highest allowed coordinates, robot frame, mm.
    pub workspace_max_mm: [f64; 3],
    /// mm/s.
    pub max_speed_mm_s: f64,
    /// N.
    pub max_force_n: f64,
    /// How far the target may run ahead of the tip, mm.
    pub max_lead_mm: f64,
    /// Below the frame's surface, mm, positive.
    pub max_depth_mm: f64,
}

/// The robot of a bench.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RobotSetup {
    /// `omega3`.
    pub model: &'static str,
    /// Serial number.
    pub serial: u16,
    /// Expected firmware version.
    pub firmware: Option<String>,
    /// The vendor's library; `None`: the usual places.
    pub library: Option<PathBuf>,
    /// Its expected version.
    pub library_version: Option<String>,
    /// How the base is mounted, degrees.
    pub device_angle_deg: f64,
    /// Mass that gravity compensation carries, kg; `None`: the device's own value.
    pub effector_mass_kg: Option<f64>,
    /// Watchdog of the controller, steps of 125 µs, 1 to 255.
    pub watchdog_steps: u8,
    /// Expected velocity threshold, the device's own unit.
    pub velocity_threshold: Option<u32>,
    /// The arm may initialise itself: the file says so, and that the sample is off.
    pub auto_init: bool,
    /// The sample is off.
    pub sample_is_off: bool,
    /// The robot must report redundant encoders that agree.
    pub needs_redundant_encoders: bool,
    /// Which axes of the device the robot frame's axes are: `+x` to `-z`, right-handed.
    pub axes: [&'static str; 3],
    /// Tip force per share of the motors' torque, N.
    pub force_per_ratio_n: f64,
    /// Share that carries the arm.
    pub gravity_ratio: f64,
    /// Smallest share with which the arm does not sink.
    pub least_ratio: f64,
    /// The library tells the force with which the tip is pushed back, instead of that of the motors.
    pub reports_sample_force: bool,
    /// Integral gain of the regulation.
    pub integral_gain: f64,
    /// Proportional gain; `None`: the library's.
    pub proportional_gain: Option<f64>,
    /// Derivative gain; `None`: the library's.
    pub derivative_gain: Option<f64>,
    /// mm/s².
    pub acceleration_mm_s2: f64,
    /// mm/s³.
    pub jerk_mm_s3: f64,
    /// Whether a second process brakes the arm when this one dies.
    pub supervisor: bool,
}

/// One camera of a bench.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraSetup {
    /// `evk1`, `evk4`, `evk3_hd` or `silky_vga`.
    pub model: &'static str,
    /// Serial number.
    pub serial: String,
    /// Expected FPGA version.
    pub fpga: Option<String>,
    /// Bias values by name, the device's own unit.
    pub biases: BTreeMap<String, i64>,
    /// A `.bias` file whose values hold where `biases` has none.
    pub bias_file: Option<PathBuf>,
    /// Pixels that stay on: first column, first row, columns, rows.
    pub roi: Option<[u16; 4]>,
    /// Addresses of registers whose writes need not read back.
    pub read_back_exceptions: Vec<u32>,
    /// Longest step of the time base that is no loss, µs; `None`: steps are only noted.
    pub max_time_high_gap_us: Option<u64>,
    /// Whether a step of the camera's overflow counter is a loss; otherwise it is only noted.
    pub overflow_is_loss: bool,
    /// Status bytes of register reads with which the value counts, besides 0x40.
    pub read_status: Vec<u8>,
    /// Whether a reset on the bus may fail.
    pub failed_reset_is_accepted: bool,
    /// Whether a transfer that fails is a loss; otherwise it ends the run.
    pub failed_transfer_is_loss: bool,
    /// Everything of the kind is let pass and told. No key of a rig file: the command line's `--tolerant`.
    pub tolerant: bool,
    /// Threshold of the sensor's activity gate, events per second.
    pub noise_filter_ev_s: Option<u32>,
    /// Whose time base it follows.
    pub sync: SyncRole,
    /// The trigger input that the box is wired to.
    pub trigger_channel: u8,
    /// How long after an edge there the camera stamps it, whole µs.
    pub trigger_delay_us: u16,
    /// Where it stands, as drawn or measured.
    pub geometry: CameraModel,
}

impl CameraSetup {
    /// Whether the camera's driver offers a trigger input.
    #[must_use]
    pub fn has_trigger(&self) -> bool {
        !matches!(self.model, "evk3_hd" | "silky_vga")
    }
}

/// Whose time base a camera follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SyncRole {
    /// Its own.
    Standalone,
    /// Its own, given to the other.
    Master,
    /// The other's.
    Slave,
}

/// The trigger box of a bench.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoxSetup {
    /// Serial port.
    pub port: String,
    /// Its own serial number; `None`: any.
    pub serial: Option<String>,
    /// Expected firmware version.
    pub firmware: Option<String>,
    /// What outputs 1, 2 and 3 go to: `camera1`, `camera2`, `other` or `none`.
    pub outputs: [&'static str; 3],
    /// What the input comes from: `contact`, `optical`, `other` or `none`.
    pub input: &'static str,
    /// From one sync train to the next, ms.
    pub sync_period_ms: u16,
    /// How fast or slow its clock may be, ppm.
    pub max_drift_ppm: f64,
}

/// What must hold before anything is armed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PreflightLimits {
    /// A frame older than this fails.
    pub touch_off_max_age: HostDuration,
    /// Expected bytes per second of both cameras together.
    pub data_rate_b_s: f64,
    /// Free space that must be left after the session, bytes.
    pub min_free_disk_b: f64,
    /// A mark must be seen by both cameras within this time.
    pub loopback_within: HostDuration,
    /// Both cameras' clocks must be seen to advance within this time.
    pub clocks_within: HostDuration,
}

impl RigFile {
    /// Reads a rig file from the bytes of a file named `name`. Paths in it are relative to its folder; `${NAME}` in
    /// a path or port is looked up in `environment`.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse(
        name: &str,
        bytes: &[u8],
        environment: Environment<'_>,
    ) -> Result<Self, Diagnostics> {
        build::rig(name, bytes, environment)
    }
}
