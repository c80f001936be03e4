//! A rig: the devices of one bench and their description.

use skinrig_model::{RigGeometry, RigidTransform, Robot, Skin};

use crate::{CameraSettings, Clock, EventCamera, Indenter, TriggerBox};

/// The devices of one bench and their description.
pub struct Rig {
    /// `simulated`, `replayed`, `emulated` (production drivers over emulated hardware) or `bench`.
    pub kind: String,
    /// Display name, for example `simulated (geometric)`.
    pub name: String,
    /// The robot.
    pub indenter: Box<dyn Indenter>,
    /// Camera 1 and camera 2, in this order.
    pub cameras: [Box<dyn EventCamera>; 2],
    /// Settings to write to each camera.
    pub camera_settings: [CameraSettings; 2],
    /// The trigger box, if any.
    pub trigger_box: Option<Box<dyn TriggerBox>>,
    /// Clock shared by all devices.
    pub clock: Box<dyn Clock>,
    /// Pose of the skin.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// Geometry for analyses.
    pub geometry: RigGeometry,
    /// Description of the rig for the record, as JSON; for a simulated rig its complete configuration.
    pub description_json: String,
}
