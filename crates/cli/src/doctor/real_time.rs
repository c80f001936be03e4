//! Checks the real-time limits of this process: priority, locked memory, USB buffers, memory.

use std::collections::BTreeMap;

use skinrig_evk1::Evk1Config;

use super::access::{CAP_IPC_LOCK, CAP_SYS_NICE};
use super::case::Case;
use super::finding::{Check, Finding, check};
use super::machine::MachineError;
use super::rates::CAMERA_B_S;
use crate::rig::gates::size;

const AREA: &str = "real time";
/// Largest acceptable share of the last minute spent waiting for memory, percent.
const MAX_PRESSURE_PERCENT: f64 = 1.0;

/// All findings about real time.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    let limits = case.machine.text("/proc/self/limits");
    vec![
        priority(case, &limits),
        locked_memory(case, &limits),
        usb_buffers(case),
        memory(case),
        pressure(case),
    ]
}

/// `/proc/self/limits`, or why it cannot be read.
type Limits = Result<String, MachineError>;

/// A limit of this process is unknown.
#[derive(Debug, thiserror::Error)]
enum LimitError<'a> {
    /// The limits cannot be read.
    #[error("{0}")]
    Unreadable(&'a MachineError),
    /// The limit is not a number.
    #[error("{name}: {found}")]
    NotANumber { name: &'a str, found: &'a str },
    /// The limit is missing.
    #[error("/proc/self/limits has no line `{name}`")]
    Missing { name: &'a str },
}

/// Soft limit in the line `name` of `/proc/self/limits`; `u64::MAX` if unlimited.
fn soft<'a>(limits: &'a Limits, name: &'a str) -> Result<u64, LimitError<'a>> {
    let text = limits.as_ref().map_err(LimitError::Unreadable)?;
    let line = text.lines().find_map(|l| l.strip_prefix(name));
    let word = line.and_then(|rest| rest.split_whitespace().next());
    match word {
        Some("unlimited") => Ok(u64::MAX),
        Some(found) => found
            .parse()
            .map_err(|_| LimitError::NotANumber { name, found }),
        None => Err(LimitError::Missing { name }),
    }
}

/// The robot's library raises the priority of its control thread and locks memory (it imports `pthread_setschedparam` and
/// `mlockall`); without permission it does neither.
fn raise_limits(case: &Case<'_>) -> String {
    let user = case
        .machine
        .user()
        .map_or_else(|_| "USER".to_owned(), |u| u.name);
    format!(
        "printf '{user} - rtprio 99\\n{user} - memlock unlimited\\n' | sudo tee /etc/security/limits.d/skinrig.conf; then log out and \
         in again"
    )
}

fn has_capability(case: &Case<'_>, capability: u64) -> bool {
    let user = case.machine.user();
    user.is_ok_and(|u| u.capabilities & capability != 0)
}

fn priority(case: &Case<'_>, limits: &Limits) -> Finding {
    let check = check(
        AREA,
        "priority",
        "real-time priorities allowed (RLIMIT_RTPRIO)",
    );
    match soft(limits, "Max realtime priority") {
        Err(why) => check.not_checked(why),
        Ok(n) if n > 0 => check
            .ok(format!("up to {}", n.min(99)))
            .means("control goes before all else"),
        Ok(_) if has_capability(case, CAP_SYS_NICE) => check.ok("by CAP_SYS_NICE"),
        Ok(_) => check.warning("none", raise_limits(case)),
    }
}

fn locked_memory(case: &Case<'_>, limits: &Limits) -> Finding {
    let check = check(AREA, "locked memory", "unlimited (RLIMIT_MEMLOCK)");
    match soft(limits, "Max locked memory") {
        Err(why) => check.not_checked(why),
        Ok(u64::MAX) => check.ok("unlimited").means("control never waits for swap"),
        Ok(_) if has_capability(case, CAP_IPC_LOCK) => check.ok("by CAP_IPC_LOCK"),
        Ok(bytes) => check.warning(size(bytes as f64), raise_limits(case)),
    }
}

/// The kernel limits the total memory of USB transfers.
fn usb_buffers(case: &Case<'_>) -> Finding {
    let config = Evk1Config::default();
    let need_b = 2 * config.transfers * config.transfer_bytes;
    let need_mb = need_b.div_ceil(1 << 20) as u64;
    let check = check(
        AREA,
        "USB buffers",
        format!("at least {need_mb} MiB for both cameras' transfers (usbfs_memory_mb)"),
    );
    let file = "/sys/module/usbcore/parameters/usbfs_memory_mb";
    match case.machine.number(file) {
        None => check.not_checked(format!("cannot read {file}")),
        Some(0) => check.ok("unlimited"),
        Some(mb) if mb >= need_mb => {
            let times = mb as f64 / need_mb as f64;
            check
                .ok(format!("{mb} MiB"))
                .means(format!("{times:.1} times both cameras' transfers"))
        }
        Some(mb) => check.problem(
            format!("{mb} MiB"),
            format!("echo 64 | sudo tee {file}; permanently: usbcore.usbfs_memory_mb=64 on the kernel's command line"),
        ),
    }
}

/// Twice the largest backlog of both cameras: the recorder needs as much again.
fn memory(case: &Case<'_>) -> Finding {
    let backlog_b = Evk1Config::default().backlog_bytes as f64;
    let need_b = 4.0 * backlog_b;
    let check = check(AREA, "memory", format!("{} available", size(need_b)));
    match case.machine.table("/proc/meminfo") {
        Err(why) => check.not_checked(why),
        Ok(table) => match kib(&table, "MemAvailable") {
            None => check.not_checked("/proc/meminfo has no line MemAvailable"),
            Some(bytes) if bytes >= need_b => check.ok(size(bytes)).means(format!(
                "{:.0} times the buffers for {:.1} s",
                bytes / need_b,
                backlog_b / CAMERA_B_S
            )),
            Some(bytes) => check.warning(
                size(bytes),
                "end other programs: a browser, a desktop, other analyses",
            ),
        },
    }
}

fn kib(table: &BTreeMap<String, String>, key: &str) -> Option<f64> {
    let number = table.get(key)?.strip_suffix("kB")?.trim();
    number.parse::<f64>().ok().map(|kib| kib * 1024.0)
}

/// Swapping shows as time spent waiting for memory (`/proc/pressure`).
fn pressure(case: &Case<'_>) -> Finding {
    let check: Check = check(
        AREA,
        "memory pressure",
        format!("at most {MAX_PRESSURE_PERCENT} % of the last minute spent waiting for memory"),
    );
    let text = match case.machine.text("/proc/pressure/memory") {
        Ok(text) => text,
        Err(why) => return check.not_checked(why),
    };
    let some = text.lines().find(|l| l.starts_with("some "));
    let word = some.and_then(|l| l.split(' ').find_map(|w| w.strip_prefix("avg60=")));
    match word.and_then(|w| w.parse::<f64>().ok()) {
        None => check.not_checked("/proc/pressure/memory has no avg60"),
        Some(percent) if percent <= MAX_PRESSURE_PERCENT => check
            .ok(format!("{percent} %"))
            .means("nothing waits for swapping"),
        Some(percent) => check.warning(
            format!("{percent} %"),
            "end the program that uses most memory (`ps --sort=-rss -eo pid,rss,comm | head`); pauses for swapping lose data",
        ),
    }
}
