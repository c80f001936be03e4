//! Whether somebody else holds the bench: devices that are busy, and by whom; a run that writes here.

use std::path::Path;

use skinrig_hil::lease::{self, LeaseState};
use skinrig_omega3::enumerate::USB_VENDOR;
use skinrig_recorder::writer_of;

use super::case::Case;
use super::finding::{Finding, check};
use super::machine::Machine;
use super::survey::name_of;
use super::usb;
use crate::devices::Line;
use crate::sessions;

const AREA: &str = "bench";

/// All findings about others.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    let busy: Vec<Finding> = case
        .survey
        .lines
        .iter()
        .filter(|l| l.state == "busy")
        .map(|l| held(case, l))
        .collect();
    let mut findings = Vec::new();
    findings.extend(case.lease.map(leased));
    if busy.is_empty() && !case.survey.left_alone {
        findings.push(check(AREA, "devices", "held by nobody else").ok("nobody"));
    }
    findings.push(run(case));
    findings.extend(busy);
    findings
}

/// Whether somebody holds the lease at `path` at this moment.
pub(super) fn is_held(path: &Path) -> bool {
    matches!(lease::inspect(path), Ok(LeaseState::Held { .. }))
}

fn leased(path: &Path) -> Finding {
    let check = check(AREA, "lease", "held by nobody");
    match lease::inspect(path) {
        Err(e) => check.not_checked(format!("cannot read {}: {e}", path.display())),
        Ok(LeaseState::Free { last: None }) => check.ok("free; nobody ever took it"),
        Ok(LeaseState::Free { last: Some(last) }) => check.ok(format!("free; last: {last}")),
        Ok(LeaseState::Held { owner, .. }) => check.problem(
            owner.map_or_else(|| "somebody is just taking it".to_owned(), |o| o.to_string()),
            "let it end: `skinrig hil lease` shows who it is, `skinrig status` how a run is going",
        ),
        Ok(LeaseState::Abandoned { owner, beat_at }) => check.warning(
            format!("{owner} ended without releasing it, or runs on another computer; last sign of life {beat_at}"),
            "look at the arm before it is moved again; whoever takes the bench next takes it over",
        ),
    }
}

fn held(case: &Case<'_>, line: &Line) -> Finding {
    let check = check(AREA, name_of(line), "held by nobody else");
    let node = match (line.device, line.usb) {
        (_, Some((bus, device))) => Some(format!("/dev/bus/usb/{bus:03}/{device:03}")),
        ("robot", None) => usb::list(case.machine).ok().and_then(|all| {
            let robot = all.iter().find(|d| d.vendor == USB_VENDOR);
            robot.map(usb::UsbDevice::node)
        }),
        // A port has two names: the lasting one is a link beside the other's folder.
        _ => Some(port_of(case.machine, &line.what)),
    };
    let holder = node.and_then(|node| holder(case.machine, &node));
    match holder {
        Some((pid, command)) => check.problem(
            format!("process {pid} holds it: {command}"),
            "let it end; `skinrig status` tells how a run is going, `skinrig control SESSIONS stop` ends it after the press",
        ),
        None => check.problem(
            "another program holds it, which this user may not see",
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

/// The process that has this file open, and its command line, as far as this user may look.
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

/// A run under way in the same folder may be on this bench.
fn run(case: &Case<'_>) -> Finding {
    let folder = case.sessions.display();
    let check = check(AREA, "runs", format!("no run under way in {folder}"));
    if !case.sessions.is_dir() {
        return check.ok(format!("{folder} is not there yet"));
    }
    let running = sessions::files(case.sessions)
        .into_iter()
        .flatten()
        .find_map(|s| writer_of(&s).map(|by| (s, by)));
    match running {
        None => check.ok("none"),
        Some((session, by)) => check.warning(
            format!("{} is written by {by}", session.display()),
            format!("skinrig status {}", session.display()),
        ),
    }
}
