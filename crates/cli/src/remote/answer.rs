//! Answer of a run to a request.

use std::sync::mpsc::Receiver;

use super::touches::TouchLine;
use super::wire::Reply;

/// Answer to a request.
#[derive(Debug)]
pub(crate) enum Answer {
    /// One reply.
    Once(Reply),
    /// A reply per touch, until the run ends.
    Touches(Receiver<TouchLine>),
}
