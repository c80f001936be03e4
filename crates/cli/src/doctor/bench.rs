//! Checks that the bench is free: its lease, busy devices and the processes that use them, runs in the sessions folder.

use std::path::{Path, PathBuf};

use skinrig_hil::lease::{self, LeaseState};
use skinrig_omega3::enumerate::USB_VENDOR;
use skinrig_recorder::writer_of;

use super::case::Case;
use super::finding::{Finding, check};
use super::machine::Machine;
use super::survey::name_of;
use super::usb;
use crate::devices::{DeviceState, Line};
use crate::paths::shell_path;
use crate::sessions;

const AREA: &str = "bench";

/// All findings about other users of the bench.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    let busy: Vec<Finding> = case
        .survey
        .lines
        .iter()
        .filter(|l| l.state == DeviceState::Busy)
        .map(|l| held(case, l))
        .collect();
    let mut findings = Vec::new();
    findings.extend(case.lease.map(leased));
    if busy.is_empty() && !case.survey.left_alone {
        findings.push(check(AREA, "devices", "not in use").ok("free"));
    }
    findings.push(run(case));
    findings.extend(busy);
    findings
}

/// True if the lease at `path` is held.
pub(super) fn is_held(path: &Path) -> bool {
    matches!(lease::inspect(path), Ok(LeaseState::Held { .. }))
}

fn leased(path: &Path) -> Finding {
    let check = check(AREA, "lease", "free");
    match lease::inspect(path) {
        Err(e) => check.not_checked(format!("cannot read {}: {e}", path.display())),
        Ok(LeaseState::Free { last: None }) => check.ok("free; never taken"),
        Ok(LeaseState::Free { last: Some(last) }) => check.ok(format!("free; last: {last}")),
        Ok(LeaseState::Held { owner, .. }) => check.problem(
            owner.map_or_else(|| "it is just being taken".to_owned(), |o| o.to_string()),
            "wait until it is free: `skinrig hil lease` shows the holder, `skinrig status` the progress of a run",
        ),
        Ok(LeaseState::Abandoned { owner, beat_at }) => check.warning(
            format!("{owner} ended without releasing it, or runs on another computer; last heartbeat {beat_at}"),
            "look at the arm before moving it; the next command that needs the bench takes the lease over",
        ),
    }
}

fn held(case: &Case<'_>, line: &Line) -> Finding {
    let check = check(AREA, name_of(line), "not in use");
    let node = match (line.device, line.usb) {
        (_, Some((bus, device))) => Some(format!("/dev/bus/usb/{bus:03}/{device:03}")),
        ("robot", None) => usb::list(case.machine).ok().and_then(|all| {
            let robot = all.iter().find(|d| d.vendor == USB_VENDOR);
            robot.map(usb::UsbDevice::node)
        }),
        // A port has two names; the persistent one is a link to the other.
        _ => Some(port_of(case.machine, &line.what)),
    };
    let holder = node.and_then(|node| holder(case.machine, &node));
    match holder {
        Some((pid, command)) => check.problem(
            format!("in use by process {pid}: {command}"),
            "wait until it ends; `skinrig status` shows the progress of a run, `skinrig control SESSIONS stop` ends it after the press",
        ),
        None => check.problem(
            "in use by another program, which this user may not see",
            "end it; `sudo fuser -v /dev/bus/usb/*/* /dev/ttyACM* /dev/ttyUSB*` names it",
        ),
    }
}

fn port_of(machine: &Machine, path: &str) -> String {
    match machine
        .link(path)
        .as_deref()
        .and_then(|l| l.file_name().map(|n| n.to_owned()))
    {
        Some(name) => format!("/dev/{}", name.to_string_lossy()),
        None => path.to_owned(),
    }
}

/// The process that has this file open, and its command line, if this user may see it.
fn holder(machine: &Machine, node: &str) -> Option<(u32, String)> {
    let me = std::process::id();
    let processes = machine.names("/proc").ok()?;
    processes
        .iter()
        .filter_map(|name| name.parse().ok())
        .filter(|pid: &u32| *pid != me)
        .find(|pid| {
            let folder = format!("/proc/{pid}/fd");
            let files = machine.names(&folder).unwrap_or_default();
            files.iter().any(|file| {
                let target = machine.link(&format!("{folder}/{file}"));
                target.is_some_and(|t| t.as_os_str() == node)
            })
        })
        .map(|pid| {
            let command = machine.text(&format!("/proc/{pid}/cmdline"));
            let words = command.unwrap_or_default().replace('\0', " ");
            (pid, words.trim().to_owned())
        })
}

/// A run that writes to the same folder may use this bench.
fn run(case: &Case<'_>) -> Finding {
    let folder = case.sessions.display();
    let check = check(AREA, "runs", format!("no run under way in {folder}"));
    if !case.sessions.is_dir() {
        return check.ok(format!("{folder} does not exist yet"));
    }
    match running(case.sessions) {
        None => check.ok("none"),
        Some((session, by)) => check.warning(
            format!("{} is written by {by}", session.display()),
            format!("skinrig status {}", shell_path(&session)),
        ),
    }
}

/// The session in `folder` that is being written, and by whom.
pub(super) fn running(folder: &Path) -> Option<(PathBuf, String)> {
    let sessions = sessions::files(folder).into_iter().flatten();
    sessions
        .into_iter()
        .find_map(|s| writer_of(&s).map(|by| (s, by)))
}
