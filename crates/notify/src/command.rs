//! The channel `command`: a program with the JSON on its standard input.

use std::io::Write as _;
use std::os::unix::process::CommandExt as _;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group};
use skinrig_model::{NotificationChannel, NotificationFault};

use crate::attempt::Channel;
use crate::message::Message;

/// Interval at which the program is checked.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// A program and its arguments, without a shell.
pub(crate) struct Command {
    run: Vec<String>,
    timeout: Duration,
}

impl Command {
    pub(crate) const fn new(run: Vec<String>, timeout: Duration) -> Self {
        Self { run, timeout }
    }

    fn program(&self) -> String {
        self.run.first().cloned().unwrap_or_default()
    }

    fn wait(&self, child: &mut Child) -> Result<(), NotificationFault> {
        let program = self.program();
        let until = Instant::now() + self.timeout;
        loop {
            match child.try_wait() {
                Ok(Some(status)) if status.success() => return Ok(()),
                Ok(Some(status)) => {
                    let found = status.to_string();
                    return Err(NotificationFault::Exit { program, found });
                }
                Ok(None) if Instant::now() < until => std::thread::sleep(POLL_INTERVAL),
                Ok(None) => {
                    end(child);
                    let limit_s = self.timeout.as_secs();
                    return Err(NotificationFault::Slow { program, limit_s });
                }
                Err(e) => {
                    let found = e.to_string();
                    return Err(NotificationFault::Exit { program, found });
                }
            }
        }
    }
}

/// Ends the program, and the programs that it has started.
fn end(child: &mut Child) {
    // One that has ended meanwhile has no group left to end.
    let _ = kill_process_group(Pid::from_child(child), Signal::KILL);
    let _ = child.wait();
}

impl Channel for Command {
    fn name(&self) -> NotificationChannel {
        NotificationChannel::Command
    }

    fn send(&mut self, message: &Message) -> Result<(), NotificationFault> {
        let mut child = std::process::Command::new(self.program())
            .args(self.run.get(1..).unwrap_or_default())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .process_group(0)
            .spawn()
            .map_err(|e| NotificationFault::NotStarted {
                program: self.program(),
                found: e.to_string(),
            })?;
        // A program may leave its input unread: the pipe must not delay this thread.
        if let Some(mut input) = child.stdin.take() {
            let json = message.json.to_string();
            std::thread::spawn(move || input.write_all(json.as_bytes()));
        }
        self.wait(&mut child)
    }
}
