//! Opens the devices of a rig file and assembles them into a rig.

use std::path::Path;
use std::time::Duration;

use skinrig_controller::ControllerSettings;
use skinrig_device::{
    CameraSettings, DetachedBox, DetachedCamera, DeviceError, EventCamera, Indenter, NoiseFilter,
    RealClock, Rig, Roi, SyncMode, Timeouts, TriggerBox,
};
use skinrig_evk1::biases::parse_bias_file;
use skinrig_evk1::{Evk1, Evk1Config, Evk1Error, Tolerance};
use skinrig_model::{CameraId, HostDuration, RigGeometry, SkinOutline, StereoGeometry};
use skinrig_omega3::axes::{Axes, Axis};
use skinrig_omega3::config::{InitialiseRule, RedundantEncoders, SupervisorCommand, Watchdog};
use skinrig_omega3::enumerate::SERIAL_UNKNOWN;
use skinrig_omega3::{Omega, OmegaConfig, OmegaError};
use skinrig_protocol::Protocol;
use skinrig_protocol::rig::{
    BoxSetup, CameraKind, CameraSetup, DeviceAxis, RigFile, RigKind, SyncRole,
};
use skinrig_trigger_box::{SerialTriggerBox, TriggerBoxConfig};

use super::tolerated::ToleratedMismatches;
use super::{evt3_camera, requests};
use crate::exit::Failure;

/// Reads the rig file at `path`.
///
/// # Errors
/// [`Failure::input`] when it cannot be read; every finding in it at once.
pub fn load(path: &Path) -> Result<RigFile, Failure> {
    let bytes = skinrig_formats::regular::read_text(path)
        .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?;
    let environment = |name: &str| std::env::var(name).ok();
    RigFile::parse(&path.display().to_string(), &bytes, &environment)
        .map_err(|found| Failure::findings(&found))
}

/// Tolerates mismatches of the cameras; each is reported with the rig file key that accepts it.
pub fn tolerate(rig: &mut RigFile) {
    for camera in &mut rig.cameras {
        camera.tolerant = true;
    }
}

/// Restricts `protocol` to the limits of the bench: the tighter limit applies, and a protocol without a method to find the
/// surface uses the bench's.
pub(crate) fn tighten(protocol: &mut Protocol, rig: &RigFile) {
    let (limits, bench) = (&mut protocol.limits, &rig.limits);
    limits.max_speed_mm_s = limits.max_speed_mm_s.min(bench.max_speed_mm_s);
    limits.max_force_n = limits.max_force_n.min(bench.max_force_n);
    limits.max_depth_mm = limits.max_depth_mm.min(bench.max_depth_mm);
    protocol.surface = protocol.surface.or(rig.surface);
}

/// Opens every device of `rig`, and returns the record of tolerated mismatches. The robot stays braked.
///
/// # Errors
/// [`Failure::input`] when the sample is off according to the file: a run presses the sample, and an arm that lost its power
/// must not sweep through it. [`Failure::rig`] with the device that could not be opened and the next step.
pub fn open(rig: &RigFile, protocol: &Protocol) -> Result<(Rig, ToleratedMismatches), Failure> {
    refuse_without_sample(rig)?;
    let clock = RealClock::start();
    // Settings first: a bad bias file is reported before any device is opened.
    let camera_settings = [
        camera_settings(&rig.cameras[0], &protocol.cameras[0])?,
        camera_settings(&rig.cameras[1], &protocol.cameras[1])?,
    ];
    let indenter = open_robot(rig, clock)?;
    let mut tolerated = ToleratedMismatches::default();
    let mut open_one = |camera: CameraId| {
        let setup = &rig.cameras[camera.index()];
        open_camera(setup, rig.kind, camera, clock, &mut tolerated)
    };
    let cameras = [open_one(CameraId::One)?, open_one(CameraId::Two)?];
    let trigger_box = match &rig.trigger_box {
        Some(setup) => Some(open_trigger_box(setup, rig.kind, clock)?),
        None => None,
    };
    let rig = assemble(
        (rig, protocol),
        camera_settings,
        indenter,
        cameras,
        trigger_box,
        clock,
    )?;
    Ok((rig, tolerated))
}

/// Assembles open devices into the rig of a run.
///
/// # Errors
/// [`Failure::internal`].
pub(crate) fn assemble(
    (rig, protocol): (&RigFile, &Protocol),
    camera_settings: [CameraSettings; 2],
    indenter: Box<dyn Indenter>,
    cameras: [Box<dyn EventCamera>; 2],
    trigger_box: Option<Box<dyn TriggerBox>>,
    clock: RealClock,
) -> Result<Rig, Failure> {
    Ok(Rig {
        kind: rig.kind.name().to_owned(),
        name: display_name(rig),
        indenter,
        cameras,
        camera_settings,
        trigger_box,
        clock: Box::new(clock),
        robot_from_skin: rig.frame.robot_from_skin,
        geometry: geometry(rig, protocol.surroundings.outline),
        description_json: serde_json::to_string(rig).map_err(Failure::internal)?,
    })
}

/// Rejects a bench whose sample is off.
///
/// # Errors
/// [`Failure::input`]: presses need the sample, and an arm that lost its power must not sweep through it.
pub(crate) fn refuse_without_sample(rig: &RigFile) -> Result<(), Failure> {
    if !rig.robot.sample_is_off {
        return Ok(());
    }
    Err(Failure::input(format!(
        "{}: robot.sample_is_off: expected false, because a run presses the sample, found true\n  \
         next: initialise the arm with `skinrig jog` while the sample is off, mount the sample, and set it to false",
        rig.file_name
    )))
}

/// Largest age of a valid pose when jogging, or when the robot is emulated and shares a processor with other work.
pub(crate) const SLOW_STALE: HostDuration = HostDuration::from_millis(1_000);

/// Longest gap between checks of an emulated rig while the tip is low.
pub(crate) const SLOW_LATE: HostDuration = HostDuration::from_millis(5_000);

/// Averaging time for the speed of an emulated arm, which catches up in bursts when other work delays it.
const SLOW_SPEED: HostDuration = HostDuration::from_millis(200);

/// Controller settings for a rig of this kind; emulated devices get longer timeouts because they share this computer's processors.
#[must_use]
pub fn settings(kind: &str) -> ControllerSettings {
    let mut settings = ControllerSettings::default();
    // Imported data arrive at their own times and may be sparse.
    if kind == "imported" {
        settings.camera_lag = None;
    }
    if kind == RigKind::Emulated.name() {
        settings.stale_after = SLOW_STALE;
        settings.late_after = SLOW_LATE;
        settings.speed_over = SLOW_SPEED;
        settings.camera_lag = Some(SLOW_LATE);
        settings.data_within = SLOW_LATE;
    }
    settings
}

/// Marks the name of a rig whose mismatches are tolerated.
pub const TOLERATED: &str = ", mismatches tolerated";

/// Name of the bench, which always includes its kind.
#[must_use]
pub fn display_name(rig: &RigFile) -> String {
    let kind = rig.kind.name();
    let mut name = rig.name.clone();
    if !name.contains(kind) {
        name = format!("{name} ({kind})");
    }
    // In the name, so that every report of such a session shows it.
    if rig.cameras.iter().any(|c| c.tolerant) {
        name.push_str(TOLERATED);
    }
    name
}

/// Geometry of the bench, for analyses.
fn geometry(rig: &RigFile, outline: SkinOutline) -> RigGeometry {
    let [one, two] = &rig.cameras;
    RigGeometry {
        outline,
        nominal: StereoGeometry {
            cameras: [one.geometry, two.geometry],
        },
        // The same on both cameras: the parser of rig files checks this.
        trigger_channel: rig.trigger_box.as_ref().map(|_| one.trigger_channel),
        trigger_delay_us: [one.trigger_delay_us, two.trigger_delay_us],
    }
}

/// Opens only the robot.
///
/// # Errors
/// [`Failure::rig`].
pub(crate) fn open_robot(rig: &RigFile, clock: RealClock) -> Result<Box<dyn Indenter>, Failure> {
    Ok(Box::new(
        omega(omega_config(rig)?, clock).map_err(Failure::rig)?,
    ))
}

/// Opens the robot's driver and prints its remarks.
pub(crate) fn omega(config: OmegaConfig, clock: RealClock) -> Result<Omega, OmegaError> {
    let omega = Omega::open(config, clock)?;
    for remark in omega.remarks() {
        errln!("note: {remark}");
    }
    Ok(omega)
}

pub(crate) fn omega_config(rig: &RigFile) -> Result<OmegaConfig, Failure> {
    let (robot, limits) = (&rig.robot, &rig.limits);
    let mut config = OmegaConfig {
        library: robot.library.clone(),
        serial: Some(robot.serial).filter(|s| *s != SERIAL_UNKNOWN),
        ..OmegaConfig::default()
    };
    config.mount.device_angle_deg = robot.device_angle_deg;
    config.mount.effector_mass_kg = robot.effector_mass_kg;
    let axes = Axes::new(robot.axes.map(axis));
    config.mount.axes = axes.ok_or_else(|| Failure::internal("robot.axes: not right-handed"))?;
    config.mount.reported_force_sign = if robot.motor_force.reports_sample_force {
        -1.0
    } else {
        1.0
    };
    let envelope = &mut config.envelope;
    envelope.min_mm = limits.workspace.min_mm;
    envelope.max_mm = limits.workspace.max_mm;
    envelope.max_speed_mm_s = limits.max_speed_mm_s;
    envelope.max_force_n = limits.max_force_n;
    envelope.n_per_ratio = robot.motor_force.per_ratio_n;
    envelope.gravity_ratio = robot.motor_force.gravity_ratio;
    envelope.least_ratio = robot.motor_force.least_ratio;
    config.motion.acceleration_mm_s2 = robot.acceleration_mm_s2;
    config.motion.jerk_mm_s3 = robot.jerk_mm_s3;
    config.motion.max_lead_mm = limits.max_lead_mm;
    config.gains.p = robot.proportional_gain;
    config.gains.i = Some(robot.integral_gain);
    config.gains.d = robot.derivative_gain;
    config.watchdog = Watchdog::ArmMilliseconds(f64::from(robot.watchdog_steps) * 0.125);
    if robot.auto_init && robot.sample_is_off {
        config.initialise = InitialiseRule::SampleIsOff;
    }
    if robot.needs_redundant_encoders {
        config.redundant_encoders = RedundantEncoders::Required;
    }
    if robot.supervisor {
        let program = std::env::current_exe()
            .map_err(|e| Failure::internal(format!("cannot find the path of this program: {e}")))?;
        config.supervisor = Some(SupervisorCommand {
            program,
            arguments: vec![SUPERVISE.to_owned()],
        });
    }
    Ok(config)
}

/// The hidden command that brakes the arm if this program dies.
const SUPERVISE: &str = "supervise-arm";

const fn axis(of: DeviceAxis) -> Axis {
    match of {
        DeviceAxis::PlusX => Axis::PlusX,
        DeviceAxis::MinusX => Axis::MinusX,
        DeviceAxis::PlusY => Axis::PlusY,
        DeviceAxis::MinusY => Axis::MinusY,
        DeviceAxis::PlusZ => Axis::PlusZ,
        DeviceAxis::MinusZ => Axis::MinusZ,
    }
}

/// Timeouts of the devices of a rig of this kind.
const fn timeouts(kind: RigKind) -> Timeouts {
    match kind {
        // Emulated devices share the processors of this computer; longer than the timeout of the emulated box.
        RigKind::Emulated => Timeouts {
            running: HostDuration::from_millis(12_000),
            set_up: HostDuration::from_millis(60_000),
        },
        RigKind::Bench => Timeouts::BENCH,
    }
}

/// Runs the camera on its own thread, so that none of its calls delays the motion of the robot.
///
/// # Errors
/// [`DeviceError::Lost`] when the thread cannot be started.
pub(crate) fn detached_camera(
    device: Box<dyn EventCamera>,
    kind: RigKind,
    clock: RealClock,
) -> Result<Box<dyn EventCamera>, DeviceError> {
    let detached = DetachedCamera::new(device, Box::new(clock), timeouts(kind))?;
    Ok(Box::new(detached))
}

/// Like [`detached_camera`], for the trigger box.
///
/// # Errors
/// As for [`detached_camera`].
pub(crate) fn detached_box(
    device: Box<dyn TriggerBox>,
    kind: RigKind,
    clock: RealClock,
) -> Result<Box<dyn TriggerBox>, DeviceError> {
    let detached = DetachedBox::new(device, Box::new(clock), timeouts(kind))?;
    Ok(Box::new(detached))
}

pub(crate) fn open_camera(
    setup: &CameraSetup,
    kind: RigKind,
    camera: CameraId,
    clock: RealClock,
    tolerated: &mut ToleratedMismatches,
) -> Result<Box<dyn EventCamera>, Failure> {
    let device = match setup.model {
        CameraKind::Evk1 => {
            let opened = evk1(setup, camera, clock).map_err(|e| {
                Failure::rig(format!(
                    "{camera}: {e}\n  next: `skinrig devices` shows what is connected"
                ))
            })?;
            tolerated.add(camera, opened.tolerated());
            Box::new(opened)
        }
        CameraKind::Evk4 | CameraKind::Evk3Hd | CameraKind::SilkyVga => {
            evt3_camera::open(setup, camera, clock)?
        }
    };
    detached_camera(device, kind, clock).map_err(Failure::rig)
}

/// The driver of an EVK1.
pub(crate) fn evk1(
    setup: &CameraSetup,
    camera: CameraId,
    clock: RealClock,
) -> Result<Evk1, Evk1Error> {
    let config = Evk1Config {
        read_back_exceptions: setup.read_back_exceptions.clone(),
        max_time_step_us: setup.max_time_high_gap_us,
        overflow_is_loss: setup.overflow_is_loss,
        tolerance: Tolerance {
            read_status: setup.read_status.clone(),
            failed_reset: setup.failed_reset_is_accepted,
            failed_transfers: setup.failed_transfer_is_loss,
            everything: setup.tolerant,
        },
        ..Evk1Config::default()
    };
    let opened = Evk1::open_serial(&setup.serial, camera, config, clock)?;
    for mismatch in opened.mismatches() {
        errln!("warning: {camera}: {mismatch}");
    }
    Ok(opened)
}

/// The settings that a run with this `request` writes to a camera.
///
/// # Errors
/// [`Failure::input`] for a bias file that cannot be read.
pub(crate) fn camera_settings(
    setup: &CameraSetup,
    request: &skinrig_protocol::CameraRequest,
) -> Result<CameraSettings, Failure> {
    let mut settings = CameraSettings {
        sync: match setup.sync {
            SyncRole::Standalone => SyncMode::Standalone,
            SyncRole::Master => SyncMode::Master,
            SyncRole::Slave => SyncMode::Slave,
        },
        noise_filter: setup
            .noise_filter_ev_s
            .map(|min_rate_ev_s| NoiseFilter { min_rate_ev_s }),
        trigger_channels: setup
            .has_trigger()
            .then_some(setup.trigger_channel)
            .into_iter()
            .collect(),
        ..CameraSettings::default()
    };
    if let Some(file) = &setup.bias_file {
        let wrong = |e: &dyn std::fmt::Display| Failure::input(format!("{}: {e}", file.display()));
        let text = std::fs::read_to_string(file).map_err(|e| wrong(&e))?;
        settings.biases = parse_bias_file(&text).map_err(|e| wrong(&e))?;
    }
    settings.biases.extend(setup.biases.clone());
    settings.roi = setup.roi.map(|[x, y, width, height]| Roi {
        x,
        y,
        width,
        height,
    });
    requests::apply(&mut settings, request);
    Ok(settings)
}

fn open_trigger_box(
    setup: &BoxSetup,
    kind: RigKind,
    clock: RealClock,
) -> Result<Box<dyn TriggerBox>, Failure> {
    let device = trigger_box(setup, kind, clock).map_err(Failure::rig)?;
    detached_box(Box::new(device), kind, clock).map_err(Failure::rig)
}

/// The trigger box's driver; the box is armed.
pub(crate) fn trigger_box(
    setup: &BoxSetup,
    kind: RigKind,
    clock: RealClock,
) -> Result<SerialTriggerBox, DeviceError> {
    let mut config = TriggerBoxConfig::new(&setup.port);
    config.serial.clone_from(&setup.serial);
    config.max_drift_ppm = setup.max_drift_ppm;
    if kind == RigKind::Emulated {
        // A simulated processor competes for a real one and answers late.
        config.reply_timeout = Duration::from_millis(500);
        config.command_timeout = Duration::from_secs(10);
        config.hello_timeout = Duration::from_secs(20);
        config.silence_ms = 30_000;
    }
    let mut device = SerialTriggerBox::open(config, clock)?;
    device.set_sync(Some(setup.sync_period_ms))?;
    device.arm()?;
    Ok(device)
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXAMPLE: &str = include_str!("../../../../hil/rigs/bench.example.yaml");

    /// The robot's configuration with the line of `key` in the example replaced.
    fn with(key: &str, value: &str) -> Option<OmegaConfig> {
        let line = |l: &str| match l.split_once(&format!("{key}: ")) {
            Some((indent, _)) if indent.trim().is_empty() => format!("{indent}{key}: {value}"),
            _ => l.to_owned(),
        };
        let text: Vec<String> = EXAMPLE.lines().map(line).collect();
        let changed = text.join("\n");
        assert!(changed.trim() != EXAMPLE.trim(), "no line of {key}");
        let rig = RigFile::parse("rig.yaml", changed.as_bytes(), &|_| None).ok()?;
        omega_config(&rig).ok()
    }

    #[cfg(not(feature = "evk4"))]
    #[test]
    fn an_unsupported_camera_is_rejected_with_the_build_that_supports_it() {
        let second = "serial: \"00001754\"";
        let text = EXAMPLE.replacen(second, &format!("{second}\n    model: evk4"), 1);
        let rig = RigFile::parse("rig.yaml", text.as_bytes(), &|_| None).ok();
        let camera = rig.as_ref().map(|r| &r.cameras[1]);
        let refused = camera.map(|c| {
            let mut tolerated = ToleratedMismatches::default();
            let clock = RealClock::start();
            open_camera(c, RigKind::Bench, CameraId::Two, clock, &mut tolerated).err()
        });
        let message = refused.flatten().map(|e| e.message).unwrap_or_default();
        assert!(message.contains("found `evk4`"), "{message}");
        assert!(
            message.contains("cargo build --release -p skinrig --features evk4"),
            "{message}"
        );
    }

    #[test]
    fn the_rig_file_rejects_what_the_robots_driver_would_reject() {
        for (key, largest, more) in [
            ("max_speed", "100 mm/s", "100.1 mm/s"),
            ("effector_mass", "1 kg", "1.01 kg"),
            ("max_lead", "4 mm", "4.1 mm"),
            ("watchdog", "31.875 ms", "32 ms"),
            ("device_angle", "180 deg", "181 deg"),
            ("acceleration", "10000 mm/s2", "10001 mm/s2"),
            ("jerk", "1000000 mm/s3", "1000001 mm/s3"),
            ("gravity_ratio", "0.3", "0.91"),
            ("least_ratio", "0.06", "1.01"),
        ] {
            let config = with(key, largest).unwrap_or_else(|| panic!("{key}: {largest}"));
            assert_eq!(config.check(), Ok(()), "{key}: {largest}");
            assert!(with(key, more).is_none(), "{key}: {more}");
        }
    }
}
