//! Interface below the adapter: a camera that is opened with settings and then returns packets.

use std::time::Duration;

use crate::stream_settings::StreamSettings;

/// The camera cannot be reached; contains the error of the implementation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct LinkError(pub String);

/// Bytes received together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// EVT3 words.
    pub bytes: &'a [u8],
    /// Age of the packet on arrival here.
    pub age: Duration,
    /// Whether packets were dropped just before this one.
    pub after_loss: bool,
}

/// A streaming camera; dropping it stops the stream.
pub trait Packets: Send {
    /// Passes the next packet to `take`, if there is one; never blocks.
    ///
    /// # Errors
    /// When the stream has ended. Earlier packets are passed on first.
    fn next(&mut self, take: &mut dyn FnMut(Packet<'_>)) -> Result<bool, LinkError>;

    /// Packets dropped since the start of the stream.
    fn dropped(&self) -> u64;
}

/// A camera with a known serial number.
pub trait Link: Send {
    /// Maximum size of a packet, bytes.
    fn packet_bytes(&self) -> usize;

    /// Opens it with these settings and starts the stream.
    ///
    /// # Errors
    /// When it is missing, busy, or does not respond as expected.
    fn stream(&mut self, settings: &StreamSettings) -> Result<Box<dyn Packets>, LinkError>;
}
