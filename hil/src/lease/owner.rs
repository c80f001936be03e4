//! The holder of a lease, as stored in the lease file.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Holder of a bench.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Owner {
    /// Login name.
    pub user: String,
    /// Name of the computer.
    pub host: String,
    /// Process ID.
    pub pid: u32,
    /// Start of the process in kernel ticks since boot. It distinguishes the process from a later
    /// one with the same ID.
    pub process_started: Option<u64>,
    /// Its command, such as `hil run nightly`.
    pub what: String,
    /// Start of the lease, RFC 3339, UTC.
    pub since: String,
}

impl Owner {
    /// This process, running the command `what`.
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

    /// Whether the process is running; `None` if unknown, as on another computer.
    #[must_use]
    pub fn is_running(&self, this_host: &str) -> Option<bool> {
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

/// Start time of a process: field 22 of proc_pid_stat(5). `None` without such a process, or without /proc.
fn process_started(pid: u32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The second field is a name in parentheses that may contain any character.
    let (_, rest) = stat.rsplit_once(") ")?;
    rest.split(' ').nth(19)?.parse().ok()
}

/// Content of the lease file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Entry {
    /// Format version.
    pub version: u32,
    /// The current or last holder.
    pub owner: Owner,
    /// Unique per lease. A holder detects a takeover by a changed token.
    pub token: String,
    /// Counts heartbeats. Another computer watches it change, so clocks are never compared.
    pub beats: u64,
    /// Time of the last heartbeat by the holder's clock; for display only.
    pub beat_at: String,
    /// Whether the holder released it.
    pub released: bool,
}

pub(super) const VERSION: u32 = 1;
