//! The edges of the emulated pins, and what their cycles mean on the host's clock.

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

/// A pin changed its level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// In this cycle of the processor since the board was started.
    pub cycle: u64,
    /// [`INPUT`], [`CAMERA_1`], [`CAMERA_2`] or [`SPARE`].
    pub pin: u8,
    /// To this level.
    pub high: bool,
}

/// What a board tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Told {
    /// A pin changed its level.
    Edge(Edge),
    /// The board is in this cycle: no later edge comes before it. Only told by [`EdgeStream::follow`].
    At(u64),
}

impl Told {
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

/// The edges of one pin as a camera with a perfect clock would tell them, in whole microseconds of the board.
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

/// How the board's cycles lie on the host's monotonic clock (`CLOCK_MONOTONIC`).
///
/// A board that keeps pace is never ahead of this line; when the machine is busy it tells its edges later, with the
/// same cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardClock {
    /// Cycle 0, ns.
    pub start_ns: i64,
    /// Cycles per ns.
    pub cycles_per_ns: f64,
    /// False when the board runs as fast as it can: then its cycles mean nothing to the host.
    pub paced: bool,
}

impl BoardClock {
    /// The host's monotonic clock in this cycle, ns.
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

/// All edges of a board since this stream was opened. A thread takes them from the socket, so the board never waits.
pub struct EdgeStream {
    told: Receiver<Told>,
    socket: UnixStream,
    clock: BoardClock,
}

impl EdgeStream {
    /// Listens to the board at this socket; returns when no later edge can be missed.
    ///
    /// # Errors
    /// When the board is not there or does not answer.
    pub fn open(socket: &Path) -> io::Result<Self> {
        Self::with(socket, "clock\nsubscribe\n")
    }

    /// As [`EdgeStream::open`]; [`EdgeStream::told`] then also gives the board's time every millisecond.
    ///
    /// # Errors
    /// As there.
    pub fn follow(socket: &Path) -> io::Result<Self> {
        Self::with(socket, "clock\nsubscribe\ntimes\n")
    }

    fn with(socket: &Path, orders: &str) -> io::Result<Self> {
        let mut stream = UnixStream::connect(socket)?;
        stream.set_read_timeout(Some(Duration::from_secs(20)))?;
        stream.write_all(orders.as_bytes())?;
        let mut lines = BufReader::new(stream.try_clone()?);
        let bad =
            |line: &str| io::Error::new(io::ErrorKind::InvalidData, format!("board said {line:?}"));
        let mut line = String::new();
        lines.read_line(&mut line)?;
        let clock = BoardClock::parse(&line).ok_or_else(|| bad(&line))?;
        line.clear();
        lines.read_line(&mut line)?;
        if !line.starts_with("ok ") {
            return Err(bad(&line));
        }
        stream.set_read_timeout(None)?;
        let (sender, told) = channel();
        thread::Builder::new()
            .name("emulated edges".to_owned())
            .spawn(move || {
                for line in lines.lines() {
                    let Ok(line) = line else { return };
                    if let Some(told) = Told::parse(&line)
                        && sender.send(told).is_err()
                    {
                        return;
                    }
                }
            })?;
        Ok(Self {
            told,
            socket: stream,
            clock,
        })
    }

    /// What the cycles mean.
    #[must_use]
    pub fn clock(&self) -> BoardClock {
        self.clock
    }

    /// The next edge, waiting for `patience` at most; `None` when there was none.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn next(&mut self, patience: Duration) -> io::Result<Option<Edge>> {
        loop {
            match self.told(patience)? {
                Some(Told::Edge(edge)) => return Ok(Some(edge)),
                Some(Told::At(_)) => {}
                None => return Ok(None),
            }
        }
    }

    /// What the board tells next, waiting for `patience` at most; `None` when it told nothing.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn told(&mut self, patience: Duration) -> io::Result<Option<Told>> {
        match self.told.recv_timeout(patience) {
            Ok(told) => Ok(Some(told)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(io::ErrorKind::UnexpectedEof.into()),
        }
    }

    /// The next `n` edges.
    ///
    /// # Errors
    /// When they do not come within `patience` each.
    pub fn take(&mut self, n: usize, patience: Duration) -> io::Result<Vec<Edge>> {
        (0..n)
            .map(|k| {
                self.next(patience)?.ok_or_else(|| {
                    io::Error::new(io::ErrorKind::TimedOut, format!("{k} of {n} edges came"))
                })
            })
            .collect()
    }
}

impl Drop for EdgeStream {
    fn drop(&mut self) {
        // Wakes the thread; a board that is gone has woken it already.
        let _ = self.socket.shutdown(std::net::Shutdown::Both);
    }
}
