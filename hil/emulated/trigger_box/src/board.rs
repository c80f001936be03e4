//! The board program as a child process, and what can be done to it.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::build::{Unavailable, build};
use crate::edges::EdgeStream;

/// How to run the board.
#[derive(Debug, Clone, Default)]
pub struct BoardOptions {
    /// As fast as it can, not at the host's pace.
    pub free_running: bool,
    /// How fast (above 0) or slow its clock is, ppm.
    pub ppm: f64,
    /// The serial number in its EEPROM; none as on a new board.
    pub serial: Option<String>,
    /// Where its port shall appear; a place of its own if none is given.
    pub port: Option<PathBuf>,
    /// Where its socket shall appear.
    pub socket: Option<PathBuf>,
}

/// Chances per million bytes on the serial line, both ways.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoisePerMillion {
    /// One bit turned.
    pub flip: u32,
    /// Byte lost.
    pub drop: u32,
    /// A random byte before it.
    pub insert: u32,
}

/// What the noise did so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoiseDone {
    /// Bytes with a turned bit.
    pub flipped: u64,
    /// Lost bytes.
    pub dropped: u64,
    /// Bytes that nobody sent.
    pub inserted: u64,
}

/// Why the board begins anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResetCause {
    /// The supply sagged.
    BrownOut,
    /// The reset button, or a port that was opened.
    Button,
}

/// A running board. Dropping it ends the board.
pub struct EmulatedBox {
    child: Child,
    lines: BufReader<UnixStream>,
    control: UnixStream,
    port: PathBuf,
    socket: PathBuf,
    _dir: tempfile::TempDir,
}

impl EmulatedBox {
    /// Builds and starts the board.
    ///
    /// # Errors
    /// [`Unavailable`] when this machine lacks a tool.
    ///
    /// # Panics
    /// When the board does not start although all tools are there.
    pub fn start(options: &BoardOptions) -> Result<Self, Unavailable> {
        let built = build()?;
        Ok(Self::launch(&built, options)
            .unwrap_or_else(|e| panic!("the board does not start: {e}")))
    }

    /// As [`EmulatedBox::start`]; a machine that cannot is told on standard error, past the capture of test output.
    ///
    /// # Panics
    /// As there.
    #[must_use]
    pub fn start_or_skip(options: &BoardOptions) -> Option<Self> {
        match Self::start(options) {
            Ok(board) => Some(board),
            Err(reason) => {
                // Not to be told is no reason to fail.
                let _ = writeln!(io::stderr(), "skipped: no emulated trigger box: {reason}");
                None
            }
        }
    }

    fn launch(built: &crate::build::Built, options: &BoardOptions) -> io::Result<Self> {
        let dir = tempfile::tempdir()?;
        let port = options
            .port
            .clone()
            .unwrap_or_else(|| dir.path().join("port"));
        let socket = options
            .socket
            .clone()
            .unwrap_or_else(|| dir.path().join("board"));
        let mut command = Command::new(&built.board);
        command.arg(&built.firmware).arg(&port).arg(&socket);
        if options.free_running {
            command.arg("--free");
        }
        command.args(["--ppm", &options.ppm.to_string()]);
        if let Some(serial) = &options.serial {
            command.args(["--serial", serial]);
        }
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let Some(stdout) = child.stdout.take() else {
            return Err(io::ErrorKind::BrokenPipe.into());
        };
        let ready = BufReader::new(stdout)
            .lines()
            .any(|line| line.is_ok_and(|l| l == "ready"));
        if !ready {
            let status = child.wait()?;
            return Err(io::Error::other(format!("it ended with {status}")));
        }
        let control = UnixStream::connect(&socket)?;
        control.set_read_timeout(Some(Duration::from_secs(20)))?;
        let lines = BufReader::new(control.try_clone()?);
        Ok(Self {
            child,
            lines,
            control,
            port,
            socket,
            _dir: dir,
        })
    }

    /// The path of the serial port.
    #[must_use]
    pub fn port(&self) -> &Path {
        &self.port
    }

    /// The path of the board's socket.
    #[must_use]
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// The edges from now on.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn edges(&self) -> io::Result<EdgeStream> {
        EdgeStream::open(&self.socket)
    }

    /// The present cycle.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn cycle(&mut self) -> io::Result<u64> {
        self.order("cycle")
    }

    /// Drives the input now; returns the cycle.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn input(&mut self, high: bool) -> io::Result<u64> {
        self.order(&format!("input {}", u8::from(high)))
    }

    /// Drives the input to these levels in these later cycles, which must be in order.
    ///
    /// # Errors
    /// When the board is gone, or too many are planned.
    pub fn plan_input(&mut self, plan: &[(bool, u64)]) -> io::Result<()> {
        let lines: String = plan
            .iter()
            .map(|(high, cycle)| format!("input {} {cycle}\n", u8::from(*high)))
            .collect();
        self.control.write_all(lines.as_bytes())?;
        plan.iter().try_for_each(|_| self.taken().map(|_| ()))
    }

    /// Wires the spare output to the input, which follows it after this many cycles; 0 takes the wire away.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn loop_back(&mut self, cycles: u64) -> io::Result<()> {
        self.order(&format!("loop {cycles}")).map(|_| ())
    }

    /// Spoils bytes of the serial line from now on; tells what the noise did before.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn noise(&mut self, seed: u32, noise: NoisePerMillion) -> io::Result<NoiseDone> {
        let NoisePerMillion { flip, drop, insert } = noise;
        let order = format!("noise {seed} {flip} {drop} {insert}\n");
        self.control.write_all(order.as_bytes())?;
        let answer = self.answer()?;
        let numbers: Vec<u64> = answer.split(' ').filter_map(|w| w.parse().ok()).collect();
        match numbers[..] {
            [_cycle, flipped, dropped, inserted] => Ok(NoiseDone {
                flipped,
                dropped,
                inserted,
            }),
            _ => Err(io::Error::other(answer)),
        }
    }

    /// Pulls the cable: no port, no power.
    ///
    /// # Errors
    /// When the board is gone, or unplugged already.
    pub fn unplug(&mut self) -> io::Result<u64> {
        self.order("unplug")
    }

    /// Plugs the cable in again.
    ///
    /// # Errors
    /// When the board is gone, or plugged in already.
    pub fn plug(&mut self) -> io::Result<u64> {
        self.order("plug")
    }

    /// Resets the processor.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn reset(&mut self, cause: ResetCause) -> io::Result<u64> {
        self.order(match cause {
            ResetCause::BrownOut => "reset brown-out",
            ResetCause::Button => "reset button",
        })
    }

    /// Lets the firmware hang, until its watchdog or anything else resets it.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn hang(&mut self) -> io::Result<u64> {
        self.order("hang")
    }

    /// Gives an order; the cycle in which it was taken.
    fn order(&mut self, line: &str) -> io::Result<u64> {
        self.control.write_all(format!("{line}\n").as_bytes())?;
        self.taken()
    }

    fn taken(&mut self) -> io::Result<u64> {
        let answer = self.answer()?;
        let cycle = answer.strip_prefix("ok ").and_then(|c| c.parse().ok());
        cycle.ok_or_else(|| io::Error::other(answer))
    }

    fn answer(&mut self) -> io::Result<String> {
        let mut answer = String::new();
        if self.lines.read_line(&mut answer)? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(answer.trim_end().to_owned())
    }
}

impl Drop for EmulatedBox {
    fn drop(&mut self) {
        // What is left of it is of no use to anybody, and may be gone already.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_file(&self.port);
        let _ = std::fs::remove_file(&self.socket);
    }
}
