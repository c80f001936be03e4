//! A rig: the devices of one bench, with what is known about it.

use skinrig_model::{CameraId, RigGeometry, RigidTransform, Robot, Skin};

use crate::{CameraSettings, Clock, EventCamera, Indenter, TriggerBox};

/// The devices of one bench and what is known about it.
pub struct Rig {
    /// `simulated`, `replayed`, `emulated` (production drivers over stand-ins for hardware) or `bench`.
    pub kind: String,
    /// For people, for example `simulated (geometric)`.
    pub name: String,
    /// The robot.
    pub indenter: Box<dyn Indenter>,
    /// Camera 1 and camera 2, in this order.
    pub cameras: [Box<dyn EventCamera>; 2],
    /// The settings to write to each camera.
    pub camera_settings: [CameraSettings; 2],
    /// The trigger box, when the bench has one.
    pub trigger_box: Option<Box<dyn TriggerBox>>,
    /// The clock that all of them share.
    pub clock: Box<dyn Clock>,
    /// Where the skin lies.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// What analyses need to know.
    pub geometry: RigGeometry,
    /// Everything worth keeping about the rig (for a simulated one: its whole configuration), as JSON.
    pub description_json: String,
}

impl Rig {
    /// The camera with this id.
    pub fn camera_mut(&mut self, id: CameraId) -> &mut dyn EventCamera {
        self.cameras[id.index()].as_mut()
    }
}
