//! Owns the reasons for which the calibration of another session does not fit.

use skinrig_model::CameraId;

/// Why the calibration of another session cannot be about this one's skin and cameras.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EarlierMismatch {
    /// It is this session.
    #[error("expected another session, found this one\n  next: leave --calibration-from out")]
    SameSession,
    /// It holds events of this session: the presses that score would calibrate.
    #[error(
        "expected a recording of other presses, found {percent:.0} % of the same events: a replay, a copy or a part of this session, or \
         a simulation with the same seed and presses\n  next: take the calibration from a session recorded at another time, or \
         leave --calibration-from out"
    )]
    SameEvents {
        /// Share of the events of the smaller session that are in the other, percent.
        percent: f64,
    },
    /// Another kind of rig recorded it, or another level of the simulation.
    #[error(
        "expected a session of the same rig ({this}), found {earlier}: its cameras see other events\n  next: take the calibration from a \
         session of the same rig and level, or calibrate in full"
    )]
    OtherRig {
        /// Rig of the earlier session.
        earlier: String,
        /// Rig of this one.
        this: String,
    },
    /// A fault was planted in one of them, and not in the other.
    #[error(
        "expected the same planted faults as here ({this}), found {earlier}\n  next: take the calibration from a session with the same \
         faults, or calibrate in full"
    )]
    OtherFaults {
        /// Faults of the earlier session.
        earlier: String,
        /// Faults of this one.
        this: String,
    },
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
    /// The skin was pressed with another tip.
    #[error(
        "expected the tip {this}, found {earlier}: another contact area moves the centroids\n  next: take the calibration from a session \
         with the same tip, or calibrate in full"
    )]
    OtherTip {
        /// Tip in the earlier session.
        earlier: String,
        /// Tip in this one.
        this: String,
    },
    /// A camera had other settings.
    #[error(
        "expected {camera} with {name} {this}, found {earlier}: other events have other centroids\n  next: take the calibration from a \
         session with the same camera settings, or calibrate in full"
    )]
    OtherSetting {
        /// The camera.
        camera: CameraId,
        /// Name of the setting.
        name: String,
        /// Value in the earlier session.
        earlier: String,
        /// Value in this one.
        this: String,
    },
}
