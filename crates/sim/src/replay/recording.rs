//! Interface of a recording for replay, in model types only.

use skinrig_model::{
    BoxReport, CameraId, DeviceIdentity, DeviceRole, HostTime, MotionCommand, PoseSample, RawChunk,
    SentMark, Setting,
};

/// A recording could not be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("recording: {0}")]
pub struct RecordingError(pub String);

/// A stored run as streams: each `next_*` continues where it stopped and returns `None` at the end.
pub trait Recording: Send {
    /// Identity of the device; `None` if the rig had no such device.
    fn identity(&self, role: DeviceRole) -> Option<DeviceIdentity>;

    /// Settings of the device as read back.
    fn settings(&self, role: DeviceRole) -> Vec<Setting>;

    /// The next motion command, in time order.
    ///
    /// # Errors
    /// [`RecordingError`] if it cannot be read.
    fn next_command(&mut self) -> Result<Option<(HostTime, MotionCommand)>, RecordingError>;

    /// The next block of poses, in time order, of any size above 0.
    ///
    /// # Errors
    /// [`RecordingError`] if it cannot be read.
    fn next_poses(&mut self) -> Result<Option<Vec<PoseSample>>, RecordingError>;

    /// The next mark, in time order.
    ///
    /// # Errors
    /// [`RecordingError`] if it cannot be read.
    fn next_mark(&mut self) -> Result<Option<SentMark>, RecordingError>;

    /// The next report of the trigger box with the time at which it was received, in that order.
    ///
    /// # Errors
    /// [`RecordingError`] if it cannot be read.
    fn next_box_report(&mut self) -> Result<Option<(HostTime, BoxReport)>, RecordingError>;

    /// The next chunk of `camera`, in stream order.
    ///
    /// # Errors
    /// [`RecordingError`] if it cannot be read.
    fn next_chunk(&mut self, camera: CameraId) -> Result<Option<RawChunk>, RecordingError>;
}
