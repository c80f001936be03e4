//! One request and its reply on a line that may damage, lose or delay both.
//!
//! A request is repeated with the same number until its reply arrives. This is safe: each mark has its own number, and the box executes
//! it only once.

use std::io;
use std::time::{Duration, Instant};

use skinrig_device::RealClock;
use skinrig_model::HostTime;

use crate::frame::{self, FrameReader};
use crate::protocol::{Reply, Request};
use crate::wire::Wire;

/// Time limits of a request. A reply to any try counts, so that a slow machine does not fail.
#[derive(Debug, Clone, Copy)]
pub struct RequestTimeouts {
    /// Time before the request is sent again.
    pub per_try: Duration,
    /// Time before the request fails.
    pub total: Duration,
}

/// A reply with the host times around it.
#[derive(Debug, Clone)]
pub struct TimedReply {
    /// The reply.
    pub reply: Reply,
    /// Time before the first byte of the first try.
    pub sent: HostTime,
    /// Time after the last byte of the reply.
    pub received: HostTime,
}

/// Why a request failed.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The line is disconnected.
    #[error("the line broke: {0}")]
    Disconnected(#[from] io::Error),
    /// No reply in time.
    #[error(
        "no reply to `{request}` in {} ms ({tries} tries, {bad_frames} damaged frames received)",
        waited.as_millis()
    )]
    NoReply {
        /// Name of the request.
        request: &'static str,
        /// Number of tries.
        tries: u32,
        /// Waiting time.
        waited: Duration,
        /// Damaged frames received meanwhile.
        bad_frames: u64,
    },
}

/// An open line with numbered requests.
pub struct Link {
    wire: Box<dyn Wire>,
    reader: FrameReader,
    /// Received bytes that were not yet decoded, last first.
    unread: Vec<u8>,
    next_id: u16,
    clock: RealClock,
}

impl Link {
    /// Wraps an open line.
    #[must_use]
    pub fn new(wire: Box<dyn Wire>, clock: RealClock) -> Self {
        Self {
            wire,
            reader: FrameReader::default(),
            unread: Vec::new(),
            next_id: 0,
            clock,
        }
    }

    /// Sends a request and waits for its reply.
    ///
    /// # Errors
    /// [`LinkError`]; after [`LinkError::NoReply`] it is unknown whether the box executed the request.
    pub fn request(
        &mut self,
        request: &Request,
        timeouts: RequestTimeouts,
    ) -> Result<TimedReply, LinkError> {
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        let frame = frame::encode(&request.encode(id)).ok_or_else(|| {
            io::Error::new(
                io::ErrorKind::InvalidInput,
                "the request does not fit into a frame",
            )
        })?;
        let began = Instant::now();
        let sent = self.clock.now();
        let bad_before = self.reader.bad_frames();
        let mut tries = 0;
        while tries == 0 || began.elapsed() < timeouts.total {
            tries += 1;
            self.wire.write(&frame)?;
            let end = Instant::now() + timeouts.per_try;
            while let Some(reply) = self.next_reply(end)? {
                // Skip late replies to failed requests, and second replies to repeated ones.
                if reply.is_reply_to(request, id) {
                    let received = self.clock.now();
                    return Ok(TimedReply {
                        reply,
                        sent,
                        received,
                    });
                }
            }
        }
        Err(LinkError::NoReply {
            request: request.name(),
            tries,
            waited: began.elapsed(),
            bad_frames: self.reader.bad_frames() - bad_before,
        })
    }

    /// The next reply to any request; `None` on timeout.
    fn next_reply(&mut self, end: Instant) -> io::Result<Option<Reply>> {
        let mut buffer = [0; 256];
        loop {
            while let Some(byte) = self.unread.pop() {
                if let Some(reply) = self.reader.push(byte).and_then(|b| Reply::parse(&b)) {
                    return Ok(Some(reply));
                }
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            let n = self.wire.read(&mut buffer, left)?;
            self.unread.extend(buffer[..n].iter().rev());
        }
    }
}
