//! The robot of a bench.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;
use skinrig_settings::{
    Choice, Collector, Dimension, Field, Settings, Shape, ValueRange, whole_units,
};

use super::variables;

/// An omega.3 behind the vendor's library.
#[derive(Debug, Clone, PartialEq, Serialize, Settings)]
#[settings(
    name = "robot",
    check(Self::may_initialise, "auto_init", "sample_is_off"),
    check(Self::is_right_handed, "axes")
)]
pub struct RobotSetup {
    /// Which robot.
    #[setting(default = "omega3")]
    pub model: RobotKind,
    /// Its serial number, as `skinrig devices` shows it. The library reports 65535 for a robot without one; 65535 here selects the
    /// only connected robot.
    #[setting(example = "12345")]
    pub serial: u16,
    /// Expected firmware version; any other fails the preflight.
    pub firmware: Option<String>,
    /// Path of the vendor's libdrd, relative to this file; `${NAME}` stands for an environment variable. Absent: the standard locations.
    #[setting(read = variables::path)]
    pub library: Option<PathBuf>,
    /// Expected version of the library; any other fails the preflight.
    pub library_version: Option<String>,
    /// How the base is mounted: 0 deg upright, 90 deg lying flat. A wrong value makes the arm drift.
    #[setting(default = "0 deg", min = -180, max = 180)]
    pub device_angle_deg: f64,
    /// Device axes that form the robot frame's x, y and z: z points away from the sample. Right-handed.
    #[setting(default = "[+x, +y, +z]", value = [DeviceAxis::PlusX, DeviceAxis::PlusY, DeviceAxis::PlusZ])]
    pub axes: [DeviceAxis; 3],
    /// Mass for gravity compensation; absent: the device's own value. At most 1 kg: a larger mass would lift the arm.
    #[setting(above = 0, max = 1)]
    pub effector_mass_kg: Option<f64>,
    /// The controller releases the forces if no command arrives for this long; a multiple of 125 us.
    #[setting(key = "watchdog", default = "10 ms", value = 80, shape = WATCHDOG, read = watchdog)]
    pub watchdog_steps: u8,
    /// Expected velocity threshold in the device's own unit. Never written; any other fails the preflight.
    #[setting(min = 1, max = u32::MAX)]
    pub velocity_threshold: Option<u32>,
    /// Whether skinrig may initialise the arm. The arm then moves on its own: needs `sample_is_off`.
    #[setting(default = "false")]
    pub auto_init: bool,
    /// Your confirmation that sample, hands and tools are out of the arm's reach.
    #[setting(default = "false")]
    pub sample_is_off: bool,
    /// Required report about redundant encoders: the library reports 0 if their check failed, and also if there are none.
    #[setting(key = "redundant_encoders", default = "reported", through = EncoderRule)]
    pub needs_redundant_encoders: bool,
    /// How a cap on the motors' torque limits the force at the tip; measure it with a scale.
    #[serde(flatten)]
    #[setting(default)]
    pub motor_force: MotorForce,
    /// Integral gain of the regulation; 0: forces do not build up while the tip rests on something.
    #[setting(default = "0", max = 10)]
    pub integral_gain: f64,
    /// Proportional gain; absent: the library's.
    #[setting(max = 100)]
    pub proportional_gain: Option<f64>,
    /// Derivative gain; absent: the library's.
    #[setting(max = 100)]
    pub derivative_gain: Option<f64>,
    /// Largest acceleration of moves.
    #[setting(default = "200 mm/s2", above = 0, max = 10_000)]
    pub acceleration_mm_s2: f64,
    /// Largest jerk of moves.
    #[setting(default = "4000 mm/s3", above = 0, max = 1e6)]
    pub jerk_mm_s3: f64,
    /// Whether a second process brakes the arm if this one crashes.
    #[setting(default = "true")]
    pub supervisor: bool,
}

/// A robot that skinrig drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum RobotKind {
    /// Force Dimension omega.3.
    Omega3,
}

impl fmt::Display for RobotKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// A direction along an axis of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
pub enum DeviceAxis {
    /// Out of the base, towards the operator.
    #[serde(rename = "+x")]
    #[choice(word = "+x")]
    PlusX,
    /// Into the base.
    #[serde(rename = "-x")]
    #[choice(word = "-x")]
    MinusX,
    /// To the operator's right.
    #[serde(rename = "+y")]
    #[choice(word = "+y")]
    PlusY,
    /// To the operator's left.
    #[serde(rename = "-y")]
    #[choice(word = "-y")]
    MinusY,
    /// Up.
    #[serde(rename = "+z")]
    #[choice(word = "+z")]
    PlusZ,
    /// Down.
    #[serde(rename = "-z")]
    #[choice(word = "-z")]
    MinusZ,
}

impl DeviceAxis {
    /// Its unit vector in the device's frame.
    const fn vector(self) -> [f64; 3] {
        match self {
            Self::PlusX => [1.0, 0.0, 0.0],
            Self::MinusX => [-1.0, 0.0, 0.0],
            Self::PlusY => [0.0, 1.0, 0.0],
            Self::MinusY => [0.0, -1.0, 0.0],
            Self::PlusZ => [0.0, 0.0, 1.0],
            Self::MinusZ => [0.0, 0.0, -1.0],
        }
    }
}

#[derive(Clone, Copy, Choice)]
enum EncoderRule {
    /// Any report; it is recorded, and a 0 is noted.
    Reported,
    /// A passed check (1): for a robot that is known to have redundant encoders.
    Required,
}

impl From<EncoderRule> for bool {
    fn from(rule: EncoderRule) -> Self {
        matches!(rule, EncoderRule::Required)
    }
}

/// Force at the tip = per_ratio (ratio - gravity_ratio), with ratio the share of the motors' torque that may be used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Settings)]
#[settings(name = "motor_force")]
pub struct MotorForce {
    /// Largest force over all poses measured on a scale, per ratio. The default is the device's nominal force; the true one
    /// depends on the pose.
    #[serde(rename = "force_per_ratio_n")]
    #[setting(default = "12 N", above = 0, max = 50)]
    pub per_ratio_n: f64,
    /// Share that supports the arm itself.
    #[setting(default = "0", max = 0.9)]
    pub gravity_ratio: f64,
    /// Smallest share that keeps the arm from sinking.
    #[setting(default = "0.05", max = 1)]
    pub least_ratio: f64,
    /// Force that the library reports; determine it with a load cell.
    #[setting(key = "reported", default = "by_motors", through = ReportedForce)]
    pub reports_sample_force: bool,
}

#[derive(Clone, Copy, Choice)]
enum ReportedForce {
    /// The force with which the motors push the tip.
    ByMotors,
    /// The force with which the tip is pushed back.
    BySample,
}

impl From<ReportedForce> for bool {
    fn from(reported: ReportedForce) -> Self {
        matches!(reported, ReportedForce::BySample)
    }
}

/// One step of the controller's watchdog, µs.
const WATCHDOG_STEP_US: i64 = 125;
/// 1 to 255 steps.
const WATCHDOG: Shape = Shape::Quantity(
    &[Dimension::Time],
    ValueRange::between(0.000_125, 0.031_875),
);

fn watchdog(f: &Field, out: &mut Collector) -> Option<u8> {
    let us = whole_units(f, "us", 1e6, out)?;
    if us % WATCHDOG_STEP_US != 0 {
        let below = (us / WATCHDOG_STEP_US * WATCHDOG_STEP_US).max(WATCHDOG_STEP_US);
        let above = us / WATCHDOG_STEP_US * WATCHDOG_STEP_US + WATCHDOG_STEP_US;
        out.error(f.span, f.path.as_str(), "between two steps of the watchdog")
            .expected("a multiple of 125 us")
            .found(format!("{us} us"))
            .help(format!("write `{below} us` or `{above} us`"));
        return None;
    }
    u8::try_from(us / WATCHDOG_STEP_US).ok()
}

impl RobotSetup {
    fn may_initialise(auto_init: &bool, is_off: &bool, field: &Field, out: &mut Collector) {
        if *auto_init && !is_off {
            let at = field.at("auto_init");
            let message = "the arm could hit the sample";
            out.error(at.span, at.path.as_str(), message)
                .expected("`sample_is_off: true` beside it")
                .found("`sample_is_off: false`")
                .help("remove the sample and set `sample_is_off: true`, or initialise the arm by hand and set `auto_init: false`");
        }
    }

    /// Three different axes, right-handed.
    fn is_right_handed(axes: &[DeviceAxis; 3], field: &Field, out: &mut Collector) {
        let [a, b, c] = axes.map(DeviceAxis::vector);
        let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        if determinant < 0.5 {
            let at = field.at("axes");
            out.error(at.span, at.path.as_str(), "the axes are not right-handed")
                .expected(
                    "three different axes, z = x cross y, such as `[+x, +y, +z]` or `[+y, -x, +z]`",
                )
                .found(format!("[{}]", axes.map(Choice::word).join(", ")));
        }
    }
}

impl MotorForce {
    /// Checks that a cap on the motors' torque can set a force limit; `field` is the mapping of `self`.
    pub(super) fn check_limit(&self, limit_n: f64, field: &Field, out: &mut Collector) {
        let strongest = (1.0 - self.gravity_ratio) * self.per_ratio_n;
        let (expected, found) =
            if self.gravity_ratio + limit_n / self.per_ratio_n < self.least_ratio {
                let least = (self.least_ratio - self.gravity_ratio) * self.per_ratio_n;
                (
                    format!("a limit of more than {least:.3} N: below, the arm sinks"),
                    format!("{limit_n} N, `limits.max_force`"),
                )
            } else if strongest < limit_n {
                (
                    format!("at least {limit_n} N, `limits.max_force`"),
                    format!("{strongest:.3} N with all of the motors' torque"),
                )
            } else {
                return;
            };
        let message = "the force limit cannot be set";
        out.error(field.span, field.path.as_str(), message)
            .expected(expected)
            .found(found);
    }
}
