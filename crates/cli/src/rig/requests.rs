//! Camera settings that a protocol requests.

use skinrig_device::{CameraSettings, Roi};
use skinrig_protocol::CameraRequest;

/// Applies the protocol's requests on top of the rig's settings.
pub(super) fn apply(settings: &mut CameraSettings, request: &CameraRequest) {
    settings.biases.extend(request.biases.clone());
    if let Some([x, y, width, height]) = request.roi {
        settings.roi = Some(Roi {
            x,
            y,
            width,
            height,
        });
    }
}
