//! Edges of the emulated pins, and conversion of cycles to host time.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use skinrig_model::TriggerEdge;

/// Cycles of the box's processor per microsecond of its own clock.
pub const CYCLES_PER_US: u64 = 16;
/// The time-stamped input, Arduino D8.
pub const INPUT: u8 = 0;
/// Camera 1's trigger line, Arduino D9.
pub const CAMERA_1: u8 = 1;
/// Camera 2's trigger line, Arduino D10.
pub const CAMERA_2: u8 = 2;
/// The spare output, Arduino D11.
pub const SPARE: u8 = 3;

/// A level change of a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Processor cycle since the board was started.
    pub cycle: u64,
    /// [`INPUT`], [`CAMERA_1`], [`CAMERA_2`] or [`SPARE`].
    pub pin: u8,
    /// The new level.
    pub high: bool,
}

/// A message of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoardMessage {
    /// A level change of a pin.
    Edge(Edge),
    /// The current cycle: no later message has an earlier one. Only with [`EdgeStream::follow`].
    At(u64),
}

impl BoardMessage {
    fn parse(line: &str) -> Option<Self> {
        if let Some(cycle) = line.strip_prefix("at ") {
            return cycle.parse().ok().map(Self::At);
        }
        let mut words = line.strip_prefix("edge ")?.split(' ');
        let cycle = words.next()?.parse().ok()?;
        let pin = words.next()?.parse().ok()?;
        let high = words.next()? == "1";
        Some(Self::Edge(Edge { cycle, pin, high }))
    }
}

/// Edges of one pin as seen by a camera with a perfect clock, in whole microseconds of the board.
#[must_use]
pub fn trigger_edges(edges: &[Edge], pin: u8) -> Vec<TriggerEdge> {
    edges
        .iter()
        .filter(|e| e.pin == pin)
        .map(|e| TriggerEdge {
            t_us: e.cycle / CYCLES_PER_US,
            channel: pin,
            rising: e.high,
        })
        .collect()
}

/// Relation of the board's cycles to the host's monotonic clock (`CLOCK_MONOTONIC`).
///
/// A board in real time is never ahead of this line; on a busy computer it reports its edges later, with the same cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardClock {
    /// Time of cycle 0, ns.
    pub start_ns: i64,
    /// Cycles per ns.
    pub cycles_per_ns: f64,
    /// False when the board runs as fast as possible, so that its cycles have no host time.
    pub paced: bool,
}

impl BoardClock {
    /// Host time of a cycle on the monotonic clock, ns.
    #[must_use]
    pub fn host_ns(&self, cycle: u64) -> i64 {
        self.start_ns + (cycle as f64 / self.cycles_per_ns) as i64
    }

    pub(crate) fn parse(line: &str) -> Option<Self> {
        let mut words = line.trim_end().strip_prefix("clock ")?.split(' ');
        Some(Self {
            start_ns: words.next()?.parse().ok()?,
            cycles_per_ns: words.next()?.parse().ok()?,
            paced: words.next()? == "paced",
        })
    }
}

/// All edges of a board from now on. A thread reads the socket, so that the board never waits.
pub struct EdgeStream {
    messages: Receiver<BoardMessage>,
    socket: UnixStream,
    clock: BoardClock,
}

impl EdgeStream {
    /// Connects to the board at this socket; returns when no later edge can be missed.
    ///
    /// # Errors
    /// When the board is not running or does not respond.
    pub fn open(socket: &Path) -> io::Result<Self> {
        Self::with(socket, "clock\nsubscribe\n")
    }

    /// Like [`EdgeStream::open`]; [`EdgeStream::next_message`] then also returns the board's time every millisecond.
    ///
    /// # Errors
    /// As [`EdgeStream::open`].
    pub fn follow(socket: &Path) -> io::Result<Self> {
        Self::with(socket, "clock\nsubscribe\ntimes\n")
    }

    fn with(socket: &Path, orders: &str) -> io::Result<Self> {
        let mut stream = UnixStream::connect(socket)?;
        stream.set_read_timeout(Some(Duration::from_secs(20)))?;
        stream.write_all(orders.as_bytes())?;
        let mut lines = BufReader::new(stream.try_clone()?);
        let bad = |line: &str| {
            io::Error::new(
                io::ErrorKind::InvalidData,
                format!("expected a line of the board, found {line:?}"),
            )
        };
        let mut line = String::new();
        lines.read_line(&mut line)?;
        let clock = BoardClock::parse(&line).ok_or_else(|| bad(&line))?;
        line.clear();
        lines.read_line(&mut line)?;
        if !line.starts_with("ok ") {
            return Err(bad(&line));
        }
        stream.set_read_timeout(None)?;
        let (sender, messages) = channel();
        thread::Builder::new()
            .name("emulated edges".to_owned())
            .spawn(move || {
                for line in lines.lines() {
                    let Ok(line) = line else { return };
                    if let Some(messages) = BoardMessage::parse(&line)
                        && sender.send(messages).is_err()
                    {
                        return;
                    }
                }
            })?;
        Ok(Self {
            messages,
            socket: stream,
            clock,
        })
    }

    /// Relation of the cycles to host time.
    #[must_use]
    pub fn clock(&self) -> BoardClock {
        self.clock
    }

    /// The next edge, waiting up to `timeout`; `None` if there was none.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn next(&mut self, timeout: Duration) -> io::Result<Option<Edge>> {
        loop {
            match self.next_message(timeout)? {
                Some(BoardMessage::Edge(edge)) => return Ok(Some(edge)),
                Some(BoardMessage::At(_)) => {}
                None => return Ok(None),
            }
        }
    }

    /// The next message, waiting up to `timeout`; `None` if there was none.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn next_message(&mut self, timeout: Duration) -> io::Result<Option<BoardMessage>> {
        match self.messages.recv_timeout(timeout) {
            Ok(messages) => Ok(Some(messages)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(io::ErrorKind::UnexpectedEof.into()),
        }
    }

    /// The next `n` edges.
    ///
    /// # Errors
    /// When one of them takes longer than `timeout`.
    pub fn take(&mut self, n: usize, timeout: Duration) -> io::Result<Vec<Edge>> {
        (0..n)
            .map(|k| {
                self.next(timeout)?.ok_or_else(|| {
                    io::Error::new(
                        io::ErrorKind::TimedOut,
                        format!("expected {n} edges, found {k}"),
                    )
                })
            })
            .collect()
    }
}

impl Drop for EdgeStream {
    fn drop(&mut self) {
        // Wakes the thread, unless the board's end has already done so.
        let _ = self.socket.shutdown(std::net::Shutdown::Both);
    }
}
