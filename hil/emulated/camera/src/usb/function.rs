//! What a device does beyond what the bus does for all.

use super::descriptors::Descriptors;
use super::usbfs::Setup;

/// The answer to a control request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// Done; for a request from device to host, with these bytes.
    Done(Vec<u8>),
    /// The device refuses (protocol stall).
    Stall,
    /// The device never answers.
    Silence,
}

/// A device behind the bus.
pub(crate) trait Function: Send + Sync {
    /// What it says about itself.
    fn descriptors(&self) -> &Descriptors;

    /// A control request that is not about descriptors; `data` comes from the host.
    fn control(&self, setup: Setup, data: &[u8]) -> Reply;

    /// The host reset the port.
    fn reset(&self) {}
}
