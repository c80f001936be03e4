//! A guest that runs as a process: lines over its standard input and output, each with a thread of its own.

use std::io::{BufRead as _, BufReader, BufWriter, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use skinrig_export::challenge::{Guest, GuestError};

/// Interval between checks whether the process has ended.
const LOOK: Duration = Duration::from_millis(5);
/// Time for a process that closed its output to end.
const CLOSED: Duration = Duration::from_secs(1);

/// A running guest; killed when dropped.
pub(super) struct Process {
    child: Child,
    /// To its standard input; `None` after the last line.
    lines: Option<Sender<String>>,
    answers: Receiver<std::io::Result<String>>,
}

impl Process {
    /// Starts `command`, a program and its arguments.
    pub(super) fn start(command: &[String]) -> Result<Self, GuestError> {
        let program = command.first().map_or("", String::as_str);
        let refused = |e: std::io::Error| GuestError::Start {
            program: program.to_owned(),
            reason: e.to_string(),
        };
        let mut child = Command::new(program)
            .args(command.iter().skip(1))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(refused)?;
        let missing = || refused(std::io::Error::other("a pipe is missing"));
        let input = child.stdin.take().ok_or_else(missing)?;
        let output = child.stdout.take().ok_or_else(missing)?;
        let (lines, to_write) = channel::<String>();
        std::thread::spawn(move || {
            let mut input = BufWriter::new(input);
            while let Ok(line) = to_write.recv() {
                // Send what is waiting in one go; the guest may read only when it is asked.
                let written = std::iter::once(line)
                    .chain(std::iter::from_fn(|| to_write.try_recv().ok()))
                    .try_for_each(|line| writeln!(input, "{line}"));
                // The reader notices a guest that has ended.
                if written.and_then(|()| input.flush()).is_err() {
                    return;
                }
            }
        });
        let (said, answers) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(output).lines() {
                let is_broken = line.is_err();
                if said.send(line).is_err() || is_broken {
                    return;
                }
            }
        });
        Ok(Self {
            child,
            lines: Some(lines),
            answers,
        })
    }

    /// How the process ended; waits a moment for a process that only closed its output.
    fn how_it_ended(&mut self) -> String {
        match self.wait(CLOSED) {
            Ok(Some(status)) => status.to_string(),
            Ok(None) => "it closed its standard output".to_owned(),
            Err(e) => e.to_string(),
        }
    }

    /// Exit status; `None` if it still runs after this time.
    fn wait(&mut self, within: Duration) -> std::io::Result<Option<std::process::ExitStatus>> {
        let begun = Instant::now();
        loop {
            match self.child.try_wait()? {
                None if begun.elapsed() < within => std::thread::sleep(LOOK),
                ended => return Ok(ended),
            }
        }
    }
}

impl Guest for Process {
    fn tell(&mut self, line: String) {
        if let Some(lines) = &self.lines {
            // The reader notices a writer that has stopped.
            let _ = lines.send(line);
        }
    }

    fn answer(&mut self, to: &str, within: Duration) -> Result<String, GuestError> {
        let to = to.to_owned();
        match self.answers.recv_timeout(within) {
            Ok(Ok(line)) => Ok(line),
            Ok(Err(e)) => Err(GuestError::Ended {
                to,
                how: e.to_string(),
            }),
            Err(RecvTimeoutError::Timeout) => Err(GuestError::Silent { to, within }),
            Err(RecvTimeoutError::Disconnected) => Err(GuestError::Ended {
                to,
                how: self.how_it_ended(),
            }),
        }
    }

    fn end(&mut self, within: Duration) -> Result<(), GuestError> {
        self.lines = None;
        let to = "the end of its input".to_owned();
        match self.answers.recv_timeout(within) {
            Ok(Ok(found)) => return Err(GuestError::TooMuch { found }),
            Ok(Err(e)) => {
                let how = e.to_string();
                return Err(GuestError::Ended { to, how });
            }
            Err(RecvTimeoutError::Timeout) => return Err(GuestError::Silent { to, within }),
            Err(RecvTimeoutError::Disconnected) => {}
        }
        match self.wait(within) {
            Ok(Some(status)) if status.success() => Ok(()),
            Ok(Some(status)) => {
                let how = status.to_string();
                Err(GuestError::Ended { to, how })
            }
            Ok(None) => Err(GuestError::Silent { to, within }),
            Err(e) => {
                let how = e.to_string();
                Err(GuestError::Ended { to, how })
            }
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
