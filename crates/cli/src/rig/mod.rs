//! The rig of a run: simulated, a bench, or a replayed recording.

pub mod bench;
pub(crate) mod evt3_camera;
pub mod gates;
pub mod inputs;
pub mod planted;
mod requests;
mod scene;
pub mod tolerated;

use std::path::Path;

use skinrig_controller::ControlHandle;
use skinrig_device::{CameraSettings, Clock, Rig};
use skinrig_model::{HostTime, InterruptionKind, Point2, RunHeader, SimLevel, StereoGeometry};
use skinrig_protocol::{PlantedFault, Protocol};
use skinrig_sim::replay::{RecordedRig, replayed_rig};
use skinrig_sim::{FaultWatch, SimConfig, in_real_time, watched_rig};

use crate::exit::Failure;
use crate::recording::SessionRecording;
use skinrig_results::RigDocument;

/// The simulated rig for `protocol`, with the injected device faults and the watch over them; its name lists all `faults`.
///
/// # Errors
/// [`Failure::input`] for a fault that the simulated rig does not support.
pub fn simulated(
    protocol: &Protocol,
    level: SimLevel,
    seed: u64,
    real_time: bool,
    faults: &[PlantedFault],
) -> Result<(Rig, FaultWatch), Failure> {
    simulated_after(
        protocol,
        level,
        seed,
        real_time,
        faults,
        EarlierLegs::default(),
    )
}

/// What was done in earlier legs of a run.
#[derive(Default)]
pub(crate) struct EarlierLegs {
    /// Number of them.
    pub count: u32,
    /// Where the skin was pressed.
    pub pressed: Vec<Point2>,
}

/// Like [`simulated`], for a further leg: the same devices and skin, with other noise.
pub(crate) fn simulated_after(
    protocol: &Protocol,
    level: SimLevel,
    seed: u64,
    real_time: bool,
    faults: &[PlantedFault],
    before: EarlierLegs,
) -> Result<(Rig, FaultWatch), Failure> {
    let mut config = SimConfig {
        pressed_before: before.pressed,
        legs_before: before.count,
        ..SimConfig::new(seed, level)
    };
    config.outline = protocol.surroundings.outline;
    config.optical = scene::optical(&protocol.scene);
    config.twin_of.clone_from(&protocol.scene.twin_of);
    if let Some(skin) = protocol.scene.skin {
        config.skin_thickness_mm = skin.thickness_mm;
    }
    if let Some(cameras) = protocol.scene.cameras {
        config.nominal = StereoGeometry { cameras };
    }
    config.faults = planted::of_devices(faults).map_err(Failure::input)?;
    let (mut rig, watch) = watched_rig(&config);
    planted::mark_name(&mut rig, faults);
    for (settings, request) in rig.camera_settings.iter_mut().zip(&protocol.cameras) {
        requests::apply(settings, request);
    }
    let rig = if real_time { in_real_time(rig) } else { rig };
    Ok((rig, watch))
}

/// A recorded session as a rig.
///
/// # Errors
/// [`Failure::input`] when the session cannot be read.
pub fn replayed(path: &Path, header: &RunHeader, document: &RigDocument) -> Result<Rig, Failure> {
    let recording = SessionRecording::open(path, header).map_err(Failure::session)?;
    let recorded = RecordedRig {
        name: header.rig_name.clone(),
        robot_from_skin: header.robot_from_skin,
        geometry: document.geometry,
        stream_formats: header.stream_formats,
        camera_settings: [CameraSettings::default(), CameraSettings::default()],
        description_json: document.rig.to_string(),
    };
    Ok(replayed_rig(recorded, Box::new(recording)))
}

/// Repeats the operator of a recorded run: a clock that requests the recorded stop or abort at its time.
pub(crate) struct RepeatedOperator {
    /// The replayed clock.
    pub clock: Box<dyn Clock>,
    /// When the recorded run was interrupted.
    pub at: HostTime,
    /// Kind of the interruption.
    pub kind: InterruptionKind,
    /// Receives the request.
    pub control: ControlHandle,
}

impl Clock for RepeatedOperator {
    fn now(&self) -> HostTime {
        self.clock.now()
    }

    fn wait_until(&mut self, t: HostTime) {
        self.clock.wait_until(t);
        if self.clock.now() >= self.at {
            match self.kind {
                InterruptionKind::Stop => self.control.stop(),
                InterruptionKind::Abort => self.control.abort(),
                InterruptionKind::Halt => self.control.halt(),
                InterruptionKind::Pause
                | InterruptionKind::PauseNow
                | InterruptionKind::Resume
                | InterruptionKind::Fault => {}
            }
            self.at = HostTime(i64::MAX);
        }
    }
}
