//! The seam below the adapter: a camera that can be opened with settings and then gives packets.

use std::time::Duration;

use crate::wanted::Wanted;

/// The camera cannot be reached, or not any more; in the words of whoever tried.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct LinkError(pub String);

/// Bytes that arrived together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// EVT3 words.
    pub bytes: &'a [u8],
    /// How long ago they arrived.
    pub age: Duration,
    /// Packets were dropped just before this one.
    pub after_loss: bool,
}

/// A camera that streams; it stops when this is dropped.
pub trait Packets: Send {
    /// Hands the next packet to `take`, if there is one; never waits.
    ///
    /// # Errors
    /// When the stream has ended. Packets that came before are handed over first.
    fn next(&mut self, take: &mut dyn FnMut(Packet<'_>)) -> Result<bool, LinkError>;

    /// Packets dropped since the stream began.
    fn dropped(&self) -> u64;
}

/// A camera of a known serial number.
pub trait Link: Send {
    /// The most bytes that a packet holds.
    fn packet_bytes(&self) -> usize;

    /// Opens it with these settings and lets it stream.
    ///
    /// # Errors
    /// When it is not there, busy, or does not answer as it should.
    fn stream(&mut self, wanted: &Wanted) -> Result<Box<dyn Packets>, LinkError>;
}
