//! What a protocol asks of the cameras.

use skinrig_device::{CameraSettings, Roi};
use skinrig_protocol::CameraRequest;

/// The protocol's wishes on top of the rig's own settings.
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
