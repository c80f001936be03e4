//! The board program as a child process, with its inputs and faults.

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
    /// Whether it runs as fast as possible instead of in real time.
    pub free_running: bool,
    /// Rate deviation of its clock, ppm; positive is fast.
    pub ppm: f64,
    /// Serial number in its EEPROM; `None` for a new board.
    pub serial: Option<String>,
    /// Path for its serial port; in a temporary folder if `None`.
    pub port: Option<PathBuf>,
    /// Path for its socket.
    pub socket: Option<PathBuf>,
}

/// Error rates of the serial line in both directions, per million bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NoisePerMillion {
    /// Bytes with a flipped bit.
    pub flip: u32,
    /// Lost bytes.
    pub drop: u32,
    /// Random bytes inserted.
    pub insert: u32,
}

/// Errors so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoiseDone {
    /// Bytes with a flipped bit.
    pub flipped: u64,
    /// Lost bytes.
    pub dropped: u64,
    /// Inserted bytes.
    pub inserted: u64,
}

/// Cause of a reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResetCause {
    /// A brown-out of the supply.
    BrownOut,
    /// The reset button, or opening the port.
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
    /// [`Unavailable`] if a tool is missing.
    ///
    /// # Panics
    /// When the board does not start although all tools exist.
    pub fn start(options: &BoardOptions) -> Result<Self, Unavailable> {
        let built = build()?;
        Ok(Self::launch(&built, options)
            .unwrap_or_else(|e| panic!("the board does not start: {e}")))
    }

    /// Like [`EmulatedBox::start`]; reports missing tools on standard error, bypassing the capture of test output.
    ///
    /// # Panics
    /// As [`EmulatedBox::start`].
    #[must_use]
    pub fn start_or_skip(options: &BoardOptions) -> Option<Self> {
        match Self::start(options) {
            Ok(board) => Some(board),
            Err(reason) => {
                // Failing to print is not an error.
                let _ = writeln!(io::stderr(), "skipped: no emulated trigger box: {reason}");
                None
            }
        }
    }

    fn launch(built: &crate::build::BuildOutput, options: &BoardOptions) -> io::Result<Self> {
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

    /// Path of the serial port.
    #[must_use]
    pub fn port(&self) -> &Path {
        &self.port
    }

    /// Path of the board's socket.
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

    /// The current cycle.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn cycle(&mut self) -> io::Result<u64> {
        self.send("cycle")
    }

    /// Sets the input level now; returns the cycle.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn input(&mut self, high: bool) -> io::Result<u64> {
        self.send(&format!("input {}", u8::from(high)))
    }

    /// Schedules input levels at these cycles, in order.
    ///
    /// # Errors
    /// When the board is gone, or the schedule is full.
    pub fn plan_input(&mut self, plan: &[(bool, u64)]) -> io::Result<()> {
        let lines: String = plan
            .iter()
            .map(|(high, cycle)| format!("input {} {cycle}\n", u8::from(*high)))
            .collect();
        self.control.write_all(lines.as_bytes())?;
        plan.iter().try_for_each(|_| self.read_cycle().map(|_| ()))
    }

    /// Connects the spare output to the input with this delay in cycles; 0 disconnects it.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn loop_back(&mut self, cycles: u64) -> io::Result<()> {
        self.send(&format!("loop {cycles}")).map(|_| ())
    }

    /// Sets the error rates of the serial line; returns the errors so far.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn noise(&mut self, seed: u32, noise: NoisePerMillion) -> io::Result<NoiseDone> {
        let NoisePerMillion { flip, drop, insert } = noise;
        let order = format!("noise {seed} {flip} {drop} {insert}\n");
        self.control.write_all(order.as_bytes())?;
        let reply = self.reply()?;
        let numbers: Vec<u64> = reply.split(' ').filter_map(|w| w.parse().ok()).collect();
        match numbers[..] {
            [_cycle, flipped, dropped, inserted] => Ok(NoiseDone {
                flipped,
                dropped,
                inserted,
            }),
            _ => Err(io::Error::other(reply)),
        }
    }

    /// Unplugs the cable: no port, no power.
    ///
    /// # Errors
    /// When the board is gone, or already unplugged.
    pub fn unplug(&mut self) -> io::Result<u64> {
        self.send("unplug")
    }

    /// Plugs the cable in again.
    ///
    /// # Errors
    /// When the board is gone, or already plugged in.
    pub fn plug(&mut self) -> io::Result<u64> {
        self.send("plug")
    }

    /// Resets the processor.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn reset(&mut self, cause: ResetCause) -> io::Result<u64> {
        self.send(match cause {
            ResetCause::BrownOut => "reset brown-out",
            ResetCause::Button => "reset button",
        })
    }

    /// Hangs the firmware until a reset, for example by its watchdog.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn hang(&mut self) -> io::Result<u64> {
        self.send("hang")
    }

    /// Sends a command; returns the cycle of its execution.
    fn send(&mut self, line: &str) -> io::Result<u64> {
        self.control.write_all(format!("{line}\n").as_bytes())?;
        self.read_cycle()
    }

    fn read_cycle(&mut self) -> io::Result<u64> {
        let reply = self.reply()?;
        let cycle = reply.strip_prefix("ok ").and_then(|c| c.parse().ok());
        cycle.ok_or_else(|| io::Error::other(reply))
    }

    fn reply(&mut self) -> io::Result<String> {
        let mut reply = String::new();
        if self.lines.read_line(&mut reply)? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(reply.trim_end().to_owned())
    }
}

impl Drop for EmulatedBox {
    fn drop(&mut self) {
        // Ignore errors: the process may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_file(&self.port);
        let _ = std::fs::remove_file(&self.socket);
    }
}
