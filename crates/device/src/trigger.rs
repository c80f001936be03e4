//! The `TriggerBox` trait: a device that sends pulses to the cameras' trigger inputs.

use skinrig_model::{BoxReport, DeviceIdentity, HostDuration, Mark, SentMark};

use crate::DeviceError;

/// Capabilities of a trigger box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TriggerCapabilities {
    /// Duration of the train of one mark.
    pub train_duration: HostDuration,
}

/// Sends coded marks (see `skinrig_model::pulse`) to both cameras at once.
pub trait TriggerBox: Send {
    /// Model, serial number and firmware.
    fn identity(&self) -> DeviceIdentity;

    /// Capabilities.
    fn capabilities(&self) -> TriggerCapabilities;

    /// Starts the pulse train of `mark` and returns the time of its first edge. If the box is sending a train of its own, the mark's train
    /// follows it; the returned time is then in the future.
    ///
    /// # Errors
    /// [`DeviceError::State`] while a train is in progress; [`DeviceError::Refused`] for a press ID that does not fit into a train;
    /// [`DeviceError::Lost`]. [`DeviceError::Pending`] if the box needs longer: call again with the same mark, which is sent only once.
    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError>;

    /// Appends the reports since the last call in order of arrival: time exchanges with the host, trains sent, input edges, resets. A box
    /// without a clock has none.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]; reports already appended stay valid.
    fn poll(&mut self, reports: &mut Vec<BoxReport>) -> Result<(), DeviceError>;

    /// Returns notes about losses and anomalies since arming or the last call, with the next step: late edges, damaged frames, excessive
    /// clock drift. The default has none.
    fn take_notes(&mut self) -> Vec<String> {
        Vec::new()
    }
}
