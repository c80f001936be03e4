//! The box that pulses the cameras' trigger inputs.

use skinrig_model::{BoxReport, DeviceIdentity, HostDuration, Mark, SentMark};

use crate::DeviceError;

/// What a trigger box can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TriggerCapabilities {
    /// How long one mark occupies the line.
    pub train_duration: HostDuration,
}

/// Sends coded marks (see `skinrig_model::pulse`) to both cameras at once.
pub trait TriggerBox: Send {
    /// Who it is.
    fn identity(&self) -> DeviceIdentity;

    /// What it can do.
    fn capabilities(&self) -> TriggerCapabilities;

    /// Starts the pulse train of `mark` now and returns when its first edge rose. Behind a train that the box sends by
    /// itself the mark's begins right after it; the answer tells when, and need not wait for it.
    ///
    /// # Errors
    /// [`DeviceError::State`] while a train is under way; [`DeviceError::Refused`] for a press id that does
    /// not fit a train; [`DeviceError::Lost`]. [`DeviceError::Pending`] from a box that needs longer: the answer comes when the same
    /// mark is asked for again, which sends nothing twice.
    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError>;

    /// Appends what the box reported since the last call, in the order in which it came: exchanges of time with the
    /// host, trains that it sent, edges at its input, resets. A box without a clock of its own reports nothing.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]; reports already appended stay valid.
    fn poll(&mut self, reports: &mut Vec<BoxReport>) -> Result<(), DeviceError>;

    /// What the box lost or noticed since it was armed, or since the last call, that its reports do not say, in
    /// sentences with what to do: late edges, damaged frames, a clock that drifts too much. A box that notices nothing
    /// of the kind has none.
    fn take_notes(&mut self) -> Vec<String> {
        Vec::new()
    }
}
