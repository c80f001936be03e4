//! Configuration of one robot: plain data with units, defaults and their sources.

use std::path::PathBuf;
use std::time::Duration;

use crate::axes::Axes;

/// Complete configuration. The defaults are cautious; no value comes from the device.
#[derive(Debug, Clone, PartialEq)]
pub struct OmegaConfig {
    /// Path of the vendor's library. `None`: searched, see `search_paths` of `load`.
    pub library: Option<PathBuf>,
    /// Serial number of this bench's robot; any other is rejected. `None` accepts the only free robot.
    pub serial: Option<u16>,
    /// Type numbers to accept besides 33 (omega.3); legacy firmware reportedly returns 110.
    pub also_accept_types: Vec<i32>,
    /// Mounting of the robot and its effector.
    pub mount: Mount,
    /// Limits of position, speed and force.
    pub envelope: Envelope,
    /// Motion of the set point.
    pub motion: Motion,
    /// Gains of the vendor's position regulation.
    pub gains: Gains,
    /// Limits at which the driver stops the robot.
    pub trips: Trips,
    /// The device's watchdog.
    pub watchdog: Watchdog,
    /// Whether the robot may initialise itself, which moves the arm through its workspace.
    pub initialise: InitialiseRule,
    /// Requirement on the redundant encoders.
    pub redundant_encoders: RedundantEncoders,
    /// Process that brakes the arm if this one dies.
    pub supervisor: Option<SupervisorCommand>,
    /// Time limits of calls and procedures.
    pub timeouts: Timeouts,
}

impl Default for OmegaConfig {
    fn default() -> Self {
        Self {
            library: None,
            serial: None,
            also_accept_types: Vec::new(),
            mount: Mount::default(),
            envelope: Envelope::default(),
            motion: Motion::default(),
            gains: Gains::default(),
            trips: Trips::default(),
            watchdog: Watchdog::ArmMilliseconds(10.0),
            initialise: InitialiseRule::Never,
            redundant_encoders: RedundantEncoders::Reported,
            supervisor: None,
            timeouts: Timeouts::default(),
        }
    }
}

/// Mounting of the robot and its effector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// Rotation of the base about its inverted y axis, degrees: 0 upright, 90 with the plate lying flat. A wrong value makes gravity
    /// compensation push the arm away.
    pub device_angle_deg: f64,
    /// Mass at the end of the arm, kg. `None` keeps the device's value. Its default is not published; too large a value lifts the arm.
    pub effector_mass_kg: Option<f64>,
    /// Device axes of the robot frame.
    pub axes: Axes,
    /// +1 if the library reports the force of the motors on the tip, -1 if it reports the force of the tip on the motors. Public sources
    /// state the former; check it with a load cell.
    pub reported_force_sign: f64,
}

impl Default for Mount {
    fn default() -> Self {
        Self {
            device_angle_deg: 0.0,
            effector_mass_kg: None,
            axes: Axes::IDENTITY,
            reported_force_sign: 1.0,
        }
    }
}

/// Limits that hold whatever a run requests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Envelope {
    /// Smallest coordinates, robot frame, mm.
    pub min_mm: [f64; 3],
    /// Largest coordinates, robot frame, mm.
    pub max_mm: [f64; 3],
    /// Largest speed of the set point, mm/s.
    pub max_speed_mm_s: f64,
    /// Largest force, N; the maximum of an omega.3 is 12.
    pub max_force_n: f64,
    /// Tip force per unit of motor ratio, N. Nominally the full 12 N; the true factor depends on the pose. Measure force divided by ratio
    /// with a scale in several places and use the largest value.
    pub n_per_ratio: f64,
    /// Largest motor ratio, whatever force a run requests.
    pub max_ratio: f64,
    /// Share of the motor ratio that gravity compensation needs; 0 until measured.
    pub gravity_ratio: f64,
    /// Smallest motor ratio at which the motors still carry the arm; to be measured.
    pub least_ratio: f64,
}

impl Default for Envelope {
    /// The vendor's public examples stay within ±40 mm of (20, 0, 0) mm.
    fn default() -> Self {
        Self {
            min_mm: [-20.0, -40.0, -40.0],
            max_mm: [60.0, 40.0, 40.0],
            max_speed_mm_s: 50.0,
            max_force_n: 12.0,
            n_per_ratio: 12.0,
            max_ratio: 1.0,
            gravity_ratio: 0.0,
            least_ratio: 0.05,
        }
    }
}

impl Envelope {
    /// Motor ratio that limits the tip force to `force_n`: `gravity_ratio + force_n / n_per_ratio`, at most `max_ratio`.
    #[must_use]
    pub(crate) fn ratio_of(&self, force_n: f64) -> f64 {
        (self.gravity_ratio + force_n / self.n_per_ratio).min(self.max_ratio)
    }
}

/// Motion of the set point along straight lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Largest acceleration, mm/s².
    pub acceleration_mm_s2: f64,
    /// Largest change of acceleration, mm/s³.
    pub jerk_mm_s3: f64,
    /// Set points and samples per second. The device's loop runs at about 4 kHz. The driver promises samples at half this rate, because
    /// cycles can be late without a real-time operating system.
    pub cycle_hz: f64,
    /// Samples per second while the arm is braked; each costs a USB transfer.
    pub parked_hz: f64,
    /// Largest step of the set point, mm.
    pub max_step_mm: f64,
    /// Largest distance between set point and measured tip, mm. This lead times the stiffness is the force.
    pub max_lead_mm: f64,
    /// Rate at which a resting set point is corrected until the tip arrives, 1/s. With 0 the tip stops short by force divided by stiffness.
    /// Must be slow compared with the regulation.
    pub correction_per_s: f64,
    /// Limits of the regulation's own filter as a multiple of ours, so that it smooths without delay. The library's defaults allow 1 m/s
    /// and are never used.
    pub filter_headroom: f64,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            acceleration_mm_s2: 200.0,
            jerk_mm_s3: 4000.0,
            cycle_hz: 2000.0,
            parked_hz: 200.0,
            max_step_mm: 0.1,
            max_lead_mm: 2.0,
            correction_per_s: 5.0,
            filter_headroom: 2.0,
        }
    }
}

/// Gains of the regulation in encoder space. Units and defaults are not published.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// Proportional gain; `None` keeps the library's value.
    pub p: Option<f64>,
    /// Integral gain. With 0, a blocked tip is held by proportional force instead of a growing force.
    pub i: Option<f64>,
    /// Derivative gain; `None` keeps the library's value.
    pub d: Option<f64>,
}

impl Default for Gains {
    fn default() -> Self {
        Self {
            p: None,
            i: Some(0.0),
            d: None,
        }
    }
}

/// Limits at which the driver brakes the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trips {
    /// Brake at this multiple of the run's force limit. At the limit itself the tip stops and may only rise.
    pub hard_force_factor: f64,
    /// Largest force at rest when arming, N. A larger force means that the arm touches something.
    pub max_tare_n: f64,
    /// Averaging time of the force at rest, which is subtracted from later readings.
    pub tare: Duration,
    /// Largest spread of the force per axis in that time, N. A larger spread means that the arm still moves.
    pub max_tare_spread_n: f64,
    /// Largest credible speed of the tip between two samples, mm/s.
    pub max_tip_speed_mm_s: f64,
    /// Largest credible jump between two samples in addition to that, mm.
    pub max_jump_mm: f64,
    /// Distance between tip and set point that brakes the arm, mm; above [`Motion::max_lead_mm`].
    pub max_deviation_mm: f64,
    /// Longest time without a new reading.
    pub max_silence: Duration,
    /// Smallest rate of the regulation loop, kHz.
    pub min_control_khz: f64,
    /// Tolerated distance of the tip outside the run's box, mm.
    pub box_margin_mm: f64,
    /// Longest time without a poll or a command while the motors are live: the controlling program may hang while the regulation keeps
    /// pushing. 2 s is far above the milliseconds between two polls, and limits how long the skin is pressed unsupervised.
    pub max_unwatched: Duration,
}

impl Default for Trips {
    fn default() -> Self {
        Self {
            hard_force_factor: 1.5,
            max_tare_n: 1.5,
            tare: Duration::from_millis(300),
            max_tare_spread_n: 0.5,
            max_tip_speed_mm_s: 1000.0,
            max_jump_mm: 2.0,
            max_deviation_mm: 5.0,
            max_silence: Duration::from_millis(200),
            min_control_khz: 1.0,
            box_margin_mm: 2.0,
            max_unwatched: Duration::from_secs(2),
        }
    }
}

/// The device's watchdog: without a command for this long it switches its motors off and brakes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Watchdog {
    /// Timeout, ms: at most 31.875, in steps of 0.125.
    ArmMilliseconds(f64),
    /// Off. Allowed only with a supervisor.
    Off,
}

/// Whether the robot may initialise itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InitialiseRule {
    /// Never: a robot that is not initialised is rejected.
    Never,
    /// Allowed: the sample and tools are off the bench and hands are clear, because the arm may move through its whole workspace.
    SampleIsOff,
}

/// Requirement on redundant encoders (word 13 of the status vector). According to public sources, 0 means that their check failed *or
/// that there are none*; some devices report -1 for none. No source states that an omega.3 has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RedundantEncoders {
    /// Accept and record any value; 0 also becomes a remark.
    Reported,
    /// Require 1, for a robot that is known to have them.
    Required,
}

/// Command that runs [`crate::supervisor::supervise`] on its standard input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SupervisorCommand {
    /// Program, usually this one.
    pub program: PathBuf,
    /// Its arguments.
    pub arguments: Vec<String>,
}

/// Time limits of calls and procedures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timeouts {
    /// Reply of the thread that owns the library.
    pub reply: Duration,
    /// Opening without initialisation.
    pub open: Duration,
    /// Initialisation; its usual duration is not published.
    pub initialise: Duration,
    /// From starting the regulation until its loop runs at full rate.
    pub regulation: Duration,
    /// Pause between attempts to brake.
    pub brake_retry: Duration,
    /// Maximum number of attempts to brake.
    pub brake_attempts: u32,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self {
            reply: Duration::from_secs(2),
            open: Duration::from_secs(10),
            initialise: Duration::from_secs(60),
            regulation: Duration::from_secs(3),
            brake_retry: Duration::from_millis(100),
            brake_attempts: 20,
        }
    }
}

impl OmegaConfig {
    /// Validates all values.
    ///
    /// # Errors
    /// The first invalid value: name, expected and found.
    pub fn check(&self) -> Result<(), BadValue> {
        let positive = |name, value: f64| {
            let good = value > 0.0 && value.is_finite();
            bad_unless(good, name, "above 0 and finite", value)
        };
        let e = &self.envelope;
        for axis in 0..3 {
            let (min, max) = (e.min_mm[axis], e.max_mm[axis]);
            let good = min < max && min.is_finite() && max.is_finite();
            bad_unless(good, "envelope.min_mm", "finite and below max_mm", min)?;
        }
        let m = &self.motion;
        let t = &self.trips;
        for (name, value) in [
            ("envelope.max_speed_mm_s", e.max_speed_mm_s),
            ("envelope.max_force_n", e.max_force_n),
            ("envelope.n_per_ratio", e.n_per_ratio),
            ("motion.acceleration_mm_s2", m.acceleration_mm_s2),
            ("motion.jerk_mm_s3", m.jerk_mm_s3),
            ("motion.max_step_mm", m.max_step_mm),
            ("motion.max_lead_mm", m.max_lead_mm),
            ("trips.max_tare_n", t.max_tare_n),
            ("trips.max_tare_spread_n", t.max_tare_spread_n),
            ("trips.max_tip_speed_mm_s", t.max_tip_speed_mm_s),
            ("trips.max_jump_mm", t.max_jump_mm),
            ("trips.min_control_khz", t.min_control_khz),
            ("trips.box_margin_mm", t.box_margin_mm),
        ] {
            positive(name, value)?;
        }
        for (name, time) in [
            ("trips.max_silence", t.max_silence),
            ("trips.max_unwatched", t.max_unwatched),
        ] {
            positive(name, time.as_secs_f64())?;
        }
        let within = |name, value: f64, low: f64, high: f64| {
            let words = format!("{low} to {high}");
            bad_unless((low..=high).contains(&value), name, &words, value)
        };
        within("envelope.max_force_n", e.max_force_n, 0.0, DEVICE_MAX_N)?;
        within("envelope.gravity_ratio", e.gravity_ratio, 0.0, 0.9)?;
        within("envelope.max_ratio", e.max_ratio, 0.0, 1.0)?;
        within("envelope.least_ratio", e.least_ratio, 0.0, e.max_ratio)?;
        within("motion.cycle_hz", m.cycle_hz, 1000.0, 4000.0)?;
        within("motion.parked_hz", m.parked_hz, 20.0, 1000.0)?;
        within("motion.correction_per_s", m.correction_per_s, 0.0, 50.0)?;
        within("motion.filter_headroom", m.filter_headroom, 1.0, 10.0)?;
        within("trips.hard_force_factor", t.hard_force_factor, 1.0, 3.0)?;
        let angle = self.mount.device_angle_deg;
        within("mount.device_angle_deg", angle, -180.0, 180.0)?;
        if let Some(mass) = self.mount.effector_mass_kg {
            within("mount.effector_mass_kg", mass, 0.0, 1.0)?;
        }
        let sign = self.mount.reported_force_sign;
        bad_unless(
            sign.abs() == 1.0,
            "mount.reported_force_sign",
            "1 or -1",
            sign,
        )?;
        // The step limit must hold at full speed even if a cycle takes twice as long.
        let fastest = m.max_step_mm * m.cycle_hz / 2.0;
        within("envelope.max_speed_mm_s", e.max_speed_mm_s, 0.0, fastest)?;
        let lead = m.max_lead_mm;
        let good = t.max_deviation_mm > lead && t.max_deviation_mm.is_finite();
        bad_unless(
            good,
            "trips.max_deviation_mm",
            &format!("above motion.max_lead_mm = {lead}"),
            t.max_deviation_mm,
        )?;
        for gain in [self.gains.p, self.gains.i, self.gains.d]
            .into_iter()
            .flatten()
        {
            bad_unless(
                gain >= 0.0 && gain.is_finite(),
                "gains",
                "0 or more and finite",
                gain,
            )?;
        }
        match self.watchdog {
            Watchdog::ArmMilliseconds(ms) => {
                within("watchdog", ms, 0.125, 31.875)?;
            }
            Watchdog::Off => bad_unless(
                self.supervisor.is_some(),
                "watchdog",
                "armed, or a supervisor process as a substitute",
                f64::NAN,
            )?,
        }
        Ok(())
    }
}

/// Largest force of an omega.3, N (used by chai3d and the ROS 2 driver, both public).
const DEVICE_MAX_N: f64 = 12.0;

/// An invalid configuration value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("omega.3 configuration: {name}: expected {expected}, found {found}")]
pub struct BadValue {
    /// Name of the value.
    pub name: &'static str,
    /// Allowed values.
    pub expected: String,
    /// Configured value.
    pub found: String,
}

fn bad_unless(good: bool, name: &'static str, expected: &str, found: f64) -> Result<(), BadValue> {
    if good {
        return Ok(());
    }
    Err(BadValue {
        name,
        expected: expected.to_owned(),
        found: found.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_invalid_values_are_named() {
        assert_eq!(OmegaConfig::default().check(), Ok(()));
        type Change = fn(&mut OmegaConfig);
        let spoilt: [(&str, Change); 11] = [
            ("envelope.least_ratio", |c| c.envelope.max_ratio = 0.01),
            ("envelope.min_mm", |c| c.envelope.min_mm[2] = f64::NAN),
            ("envelope.max_force_n", |c| c.envelope.max_force_n = 13.0),
            ("envelope.max_speed_mm_s", |c| {
                c.envelope.max_speed_mm_s = 150.0;
            }),
            ("motion.cycle_hz", |c| c.motion.cycle_hz = 100.0),
            ("trips.max_deviation_mm", |c| c.motion.max_lead_mm = 9.0),
            ("trips.max_unwatched", |c| {
                c.trips.max_unwatched = Duration::ZERO;
            }),
            ("gains", |c| c.gains.p = Some(-1.0)),
            ("watchdog", |c| c.watchdog = Watchdog::Off),
            ("watchdog", |c| {
                c.watchdog = Watchdog::ArmMilliseconds(40.0);
            }),
            ("mount.reported_force_sign", |c| {
                c.mount.reported_force_sign = 0.0;
            }),
        ];
        for (name, spoil) in spoilt {
            let mut config = OmegaConfig::default();
            spoil(&mut config);
            assert_eq!(config.check().unwrap_err().name, name);
        }
    }

    #[test]
    fn the_motor_ratio_limits_the_force() {
        let envelope = Envelope {
            n_per_ratio: 10.0,
            gravity_ratio: 0.1,
            ..Envelope::default()
        };
        assert!((envelope.ratio_of(2.0) - 0.3).abs() < 1e-12);
        assert!((envelope.ratio_of(12.0) - 1.0).abs() < 1e-12);
    }
}
