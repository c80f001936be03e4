//! Owns the reasons for which the calibration of another session does not fit.

use skinrig_model::CameraId;

/// Why the calibration of another session cannot be about this one's skin and cameras.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EarlierMismatch {
    /// It is this session.
    #[error("expected another session, found this one\n  next: leave --calibration-from out")]
    SameSession,
    /// Another skin was pressed.
    #[error(
        "expected the skin `{this}`, found `{earlier}`\n  next: take the calibration from a session of `{this}`, or calibrate in full"
    )]
    OtherSkin {
        /// Prototype of the earlier session.
        earlier: String,
        /// Prototype of this one.
        this: String,
    },
    /// The skin has another outline.
    #[error("expected a skin with the same outline, found another\n  next: calibrate in full")]
    OtherOutline,
    /// The cameras were drawn elsewhere, or with another lens.
    #[error(
        "expected the same camera geometry in both rig descriptions, found another for {camera}\n  next: calibrate in full"
    )]
    OtherGeometry {
        /// The camera.
        camera: CameraId,
    },
    /// Another camera was used.
    #[error(
        "expected {camera} with the serial number {this}, found {earlier}: another camera has another lens, and may have another \
         resolution\n  next: calibrate in full"
    )]
    OtherCamera {
        /// The camera.
        camera: CameraId,
        /// Serial number in the earlier session.
        earlier: String,
        /// Serial number in this one.
        this: String,
    },
}
