//! A recorded session as a rig: the same traits, served from a recording.
//!
//! # How replay keeps in step
//!
//! The recording, not real time, drives the clock. Each motion command of the controller is compared with the
//! recorded one (else [`DeviceError::Diverged`]), and the clock is then set to the instant of the recorded
//! command. Between commands the clock goes where it is asked to, but never past the next recorded command
//! without stopping there once: a wait that would pass it ends early, at that instant, and the next wait goes on.
//! So a controller whose decisions follow from device data and clock alone meets every recorded instant and
//! brings about the same records.
//!
//! Poses, chunks and marks are handed over as recorded: poses with `t <= now`, chunks with `host_time <= now`,
//! reports of the trigger box that had been taken by `now`, marks when asked for. At most one block of poses and one chunk per camera are held in memory.

mod camera;
mod indenter;
mod recording;
mod tape;
mod trigger;

use skinrig_device::{CameraSettings, EventCamera, Rig, TriggerBox};
use skinrig_model::{CameraId, DeviceRole, RigGeometry, RigidTransform, Robot, Skin, StreamFormat};

pub use camera::ReplayedCamera;
pub use indenter::ReplayedIndenter;
pub use recording::{Recording, RecordingError};
pub use tape::{ReplayClock, Tape};
pub use trigger::ReplayedTriggerBox;

#[cfg(doc)]
use skinrig_device::DeviceError;

/// What is known about the recorded rig.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedRig {
    /// Its name, for example `simulated (geometric)`.
    pub name: String,
    /// Where the skin lay.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// Geometry for analyses.
    pub geometry: RigGeometry,
    /// Word format of each camera.
    pub stream_formats: [StreamFormat; 2],
    /// What had been written to the cameras.
    pub camera_settings: [CameraSettings; 2],
    /// The rig's description as JSON.
    pub description_json: String,
}

/// A rig that replays `recording`. There is a trigger box when the recording knows one.
#[must_use]
pub fn replayed_rig(rig: RecordedRig, recording: Box<dyn Recording>) -> Rig {
    let has_box = recording.identity(DeviceRole::TriggerBox).is_some();
    let tape = Tape::new(recording, rig.robot_from_skin.inverse());
    let camera = |id: CameraId| -> Box<dyn EventCamera> {
        let format = rig.stream_formats[id.index()];
        Box::new(ReplayedCamera::new(tape.clone(), id, format))
    };
    let trigger_box =
        has_box.then(|| -> Box<dyn TriggerBox> { Box::new(ReplayedTriggerBox::new(tape.clone())) });
    Rig {
        kind: "replayed".to_owned(),
        name: format!("replayed {}", rig.name),
        indenter: Box::new(ReplayedIndenter::new(tape.clone(), rig.robot_from_skin)),
        cameras: CameraId::ALL.map(camera),
        camera_settings: rig.camera_settings,
        trigger_box,
        clock: Box::new(ReplayClock::new(tape.clone())),
        robot_from_skin: rig.robot_from_skin,
        geometry: rig.geometry,
        description_json: rig.description_json,
    }
}
