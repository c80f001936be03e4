//! The lease: who holds a bench, as it stands in the lease's file.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Who holds a bench.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Owner {
    /// Login name.
    pub user: String,
    /// Name of the computer.
    pub host: String,
    /// Process.
    pub pid: u32,
    /// When the process began, in the kernel's ticks since the computer's start: tells it from a later one with the same number.
    pub process_started: Option<u64>,
    /// What it does: `hil run nightly`.
    pub what: String,
    /// Since when, RFC 3339, UTC.
    pub since: String,
}

impl Owner {
    /// This process, doing `what`.
    #[must_use]
    pub fn this_process(user: String, host: String, what: String) -> Self {
        let pid = std::process::id();
        Self {
            user,
            host,
            pid,
            process_started: process_started(pid),
            what,
            since: chrono::Utc::now().to_rfc3339_opts(chrono::SecondsFormat::Secs, true),
        }
    }

    /// Whether the process is there; `None` where that cannot be told, as on another computer.
    #[must_use]
    pub fn lives(&self, this_host: &str) -> Option<bool> {
        let known = self.host == this_host && self.process_started.is_some();
        known.then(|| process_started(self.pid) == self.process_started)
    }
}

impl fmt::Display for Owner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            user,
            host,
            pid,
            what,
            since,
            ..
        } = self;
        write!(
            f,
            "`skinrig {what}` of {user} on {host}, process {pid}, since {since}"
        )
    }
}

/// When a process of this computer began: field 22 of proc_pid_stat(5). `None` where there is no such process, or no /proc.
fn process_started(pid: u32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The second field is a name in parentheses that may hold anything.
    let (_, rest) = stat.rsplit_once(") ")?;
    rest.split(' ').nth(19)?.parse().ok()
}

/// What stands in the file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Entry {
    /// Of this form.
    pub version: u32,
    /// The last one that took the lease.
    pub owner: Owner,
    /// Names this taking, so that an owner sees when it is another's.
    pub token: String,
    /// Counts up while the owner lives. Whoever asks on another computer watches it change: no two clocks are compared.
    pub beats: u64,
    /// When it was last counted, by the owner's clock; for people.
    pub beat_at: String,
    /// The owner let go of it.
    pub released: bool,
}

pub(super) const VERSION: u32 = 1;
