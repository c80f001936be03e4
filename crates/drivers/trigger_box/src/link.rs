//! One request, one reply: over a line that may spoil, lose or delay either.
//!
//! A request is repeated with the same number until its reply comes, which is safe because the box carries out no
//! command twice that must not be: a mark has a number of its own.

use std::io;
use std::time::{Duration, Instant};

use skinrig_device::RealClock;
use skinrig_model::HostTime;

use crate::frame::{self, FrameReader};
use crate::protocol::{Reply, Request};
use crate::wire::Wire;

/// How long to wait for a reply. A reply to any of the tries counts, so that a slow machine is slow and not deaf.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    /// Before the request is sent again.
    pub per_try: Duration,
    /// Before it is given up.
    pub total: Duration,
}

/// A reply and the instants of the host around it.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The reply.
    pub reply: Reply,
    /// Before the first byte of the first try left.
    pub sent: HostTime,
    /// After the last byte of the reply came.
    pub received: HostTime,
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The line is gone.
    #[error("the line broke: {0}")]
    Gone(#[from] io::Error),
    /// No reply in time.
    #[error(
        "no answer to `{request}` in {} ms ({tries} tries, {bad_frames} spoiled frames came)",
        waited.as_millis()
    )]
    Silent {
        /// What was asked.
        request: &'static str,
        /// How often.
        tries: u32,
        /// How long.
        waited: Duration,
        /// Frames that came and were no replies.
        bad_frames: u64,
    },
}

/// An open line with its numbering of requests.
pub struct Link {
    wire: Box<dyn Wire>,
    reader: FrameReader,
    /// Bytes that were read and not yet looked at, last first.
    unread: Vec<u8>,
    next_id: u16,
    clock: RealClock,
}

impl Link {
    /// Over an open line.
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
    /// [`LinkError`]; after [`LinkError::Silent`] it is unknown whether the box carried the request out.
    pub fn ask(&mut self, request: &Request, patience: Patience) -> Result<Answer, LinkError> {
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        let frame = frame::encode(&request.encode(id)).ok_or_else(|| {
            io::Error::new(io::ErrorKind::InvalidInput, "a request fits no frame")
        })?;
        let began = Instant::now();
        let sent = self.clock.now();
        let bad_before = self.reader.bad_frames();
        let mut tries = 0;
        while tries == 0 || began.elapsed() < patience.total {
            tries += 1;
            self.wire.write(&frame)?;
            let end = Instant::now() + patience.per_try;
            while let Some(reply) = self.next_reply(end)? {
                // Late replies to requests that were given up, and second replies to repeated ones, pass by.
                if reply.answers(request, id) {
                    let received = self.clock.now();
                    return Ok(Answer {
                        reply,
                        sent,
                        received,
                    });
                }
            }
        }
        Err(LinkError::Silent {
            request: request.name(),
            tries,
            waited: began.elapsed(),
            bad_frames: self.reader.bad_frames() - bad_before,
        })
    }

    /// The next reply of any request, or `None` when the time is over.
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
