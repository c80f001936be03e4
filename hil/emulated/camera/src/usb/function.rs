//! Device-specific behaviour behind the generic bus.

use super::descriptors::Descriptors;
use super::usbfs::Setup;

/// Reply to a control request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Reply {
    /// Success; with data for a request from device to host.
    Done(Vec<u8>),
    /// Rejected (protocol stall).
    Stall,
    /// Never answered.
    Silence,
}

/// A device behind the bus.
pub(crate) trait Function: Send + Sync {
    /// Its descriptors.
    fn descriptors(&self) -> &Descriptors;

    /// Handles a control request other than for descriptors; `data` comes from the host.
    fn control(&self, setup: Setup, data: &[u8]) -> Reply;

    /// Handles a port reset.
    fn reset(&self) {}
}
