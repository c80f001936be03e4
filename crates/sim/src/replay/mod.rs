//! A recorded session as a rig with the usual traits.
//!
//! # Timing of a replay
//!
//! The recording drives the clock. Each motion command of the controller is compared with the recorded one
//! ([`DeviceError::Diverged`] if they differ), and the clock is set to the recorded time of the command. Between commands the clock
//! follows the controller's waits, but stops once at the time of the next recorded command: a wait beyond it returns early, and the next
//! wait continues. A controller whose decisions depend only on device data and clock therefore reaches every recorded time and produces
//! the same records.
//!
//! Data is returned as recorded: poses with `t <= now`, chunks with `host_time <= now`, reports of the trigger box received by `now`, marks
//! when requested. Memory holds at most one block of poses and one chunk per camera.

mod camera;
mod indenter;
mod recording;
mod shared_recording;
mod trigger;

use skinrig_device::{CameraSettings, EventCamera, Rig, TriggerBox};
use skinrig_model::{CameraId, DeviceRole, RigGeometry, RigidTransform, Robot, Skin, StreamFormat};

pub(crate) use camera::ReplayedCamera;
pub(crate) use indenter::ReplayedIndenter;
pub use recording::{Recording, RecordingError};
pub(crate) use shared_recording::ReplayClock;
pub(crate) use shared_recording::SharedRecording;
pub(crate) use trigger::ReplayedTriggerBox;

#[cfg(doc)]
use skinrig_device::DeviceError;

/// Description of the recorded rig.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedRig {
    /// Its name, for example `simulated (geometric)`.
    pub name: String,
    /// Pose of the skin.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// Geometry for analyses.
    pub geometry: RigGeometry,
    /// Word format of each camera.
    pub stream_formats: [StreamFormat; 2],
    /// Settings written to the cameras.
    pub camera_settings: [CameraSettings; 2],
    /// The rig's description as JSON.
    pub description_json: String,
}

/// A rig that replays `recording`. It has a trigger box if the recording does.
#[must_use]
pub fn replayed_rig(rig: RecordedRig, recording: Box<dyn Recording>) -> Rig {
    let has_box = recording.identity(DeviceRole::TriggerBox).is_some();
    let recording = SharedRecording::new(recording, rig.robot_from_skin.inverse());
    let camera = |id: CameraId| -> Box<dyn EventCamera> {
        let format = rig.stream_formats[id.index()];
        Box::new(ReplayedCamera::new(recording.clone(), id, format))
    };
    let trigger_box = has_box
        .then(|| -> Box<dyn TriggerBox> { Box::new(ReplayedTriggerBox::new(recording.clone())) });
    Rig {
        kind: "replayed".to_owned(),
        name: format!("replayed {}", rig.name),
        indenter: Box::new(ReplayedIndenter::new(
            recording.clone(),
            rig.robot_from_skin,
        )),
        cameras: CameraId::ALL.map(camera),
        camera_settings: rig.camera_settings,
        trigger_box,
        clock: Box::new(ReplayClock::new(recording.clone())),
        robot_from_skin: rig.robot_from_skin,
        geometry: rig.geometry,
        description_json: rig.description_json,
    }
}
