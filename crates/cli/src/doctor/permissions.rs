//! Checks that this user may open the devices: USB nodes of cameras and robot, the serial port of the trigger box.

use std::path::Path;

use skinrig_omega3::enumerate::USB_VENDOR;

use super::access::User;
use super::case::Case;
use super::finding::{Finding, check};
use super::machine::MachineError;
use super::survey::{LEFT_ALONE, name_of};
use super::usb;
use crate::devices::{DeviceState, Line};

const AREA: &str = "permissions";
/// Installs the udev rules of this repository.
const INSTALL_RULES: &str = "sudo cp hil/udev/70-skinrig.rules /etc/udev/rules.d/ && sudo udevadm control --reload && sudo udevadm \
     trigger; then plug the device in again";

/// All findings about permissions.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    let user = case.machine.user();
    let mut findings = vec![user_finding(user.as_ref())];
    let user = user.ok();
    findings.extend(cameras(case, user.as_ref()));
    findings.extend(robot(case, user.as_ref()));
    findings.extend(serial_port(case, user.as_ref()));
    findings
}

fn user_finding(user: Result<&User, &MachineError>) -> Finding {
    let check = check(AREA, "user", "an ordinary user, not root");
    match user {
        Ok(user) if user.uid == 0 => check.warning(
            "root may open everything, so the permissions of the bench's user are not checked",
            "run it as the user of the bench",
        ),
        Ok(user) => check.ok(format!("{} (uid {})", user.name, user.uid)),
        Err(why) => check.not_checked(why),
    }
}

fn cameras(case: &Case<'_>, user: Option<&User>) -> Vec<Finding> {
    let lines: Vec<&Line> = case.survey.cameras().collect();
    let expected = "may be opened";
    if lines.is_empty() {
        let usb = case.survey.lines.iter().find(|l| l.what == "USB");
        let why = match usb {
            _ if case.survey.left_alone => LEFT_ALONE,
            Some(line) => line.detail.as_str(),
            None => "no camera on the bus",
        };
        return vec![check(AREA, "cameras", expected).not_checked(why)];
    }
    let finding = |line: &&Line| {
        let check = check(AREA, name_of(line), expected);
        if line.state != DeviceState::NotPermitted {
            return check.ok("opened");
        }
        let node = line
            .usb
            .map(|(bus, device)| format!("/dev/bus/usb/{bus:03}/{device:03}"));
        let node = node.unwrap_or_default();
        let (rights, next) = access_denied(case, user, &node);
        check.problem(format!("refused: {node}{rights}"), next)
    };
    lines.iter().map(finding).collect()
}

/// Uses the library's answer; without the library, the permissions of the device file.
fn robot(case: &Case<'_>, user: Option<&User>) -> Vec<Finding> {
    let check = || check(AREA, "robot", "may be opened");
    let devices = usb::list(case.machine);
    let node = devices.as_ref().ok().and_then(|all| {
        let mut of_maker = all.iter().filter(|d| d.vendor == USB_VENDOR);
        of_maker.next().map(usb::UsbDevice::node)
    });
    let has_state = |state: DeviceState| {
        let robots = case.survey.lines.iter().filter(|l| l.device == "robot");
        robots.into_iter().any(|l| l.state == state)
    };
    vec![match (node, user) {
        (node, _) if has_state(DeviceState::NotPermitted) => {
            let node = node.unwrap_or_default();
            let (rights, next) = access_denied(case, user, &node);
            check().problem(format!("refused: {node}{rights}"), next)
        }
        _ if has_state(DeviceState::Ready) || has_state(DeviceState::Busy) => check().ok("opened"),
        (Some(node), Some(user)) => match case.machine.node(&node) {
            Some(rights) if rights.is_open_to(user) => check().ok(node),
            Some(_) => {
                let (rights, next) = access_denied(case, Some(user), &node);
                check().problem(format!("{node}{rights}"), next)
            }
            None => check().not_checked(format!("there is no {node}")),
        },
        (Some(node), None) => check().not_checked(format!("{node}: the user is unknown")),
        (None, _) => check().not_checked(match devices {
            Ok(_) => "no device of Force Dimension (USB vendor 1451) on the bus".to_owned(),
            Err(why) => why.to_string(),
        }),
    }]
}

fn serial_port(case: &Case<'_>, user: Option<&User>) -> Vec<Finding> {
    let check = || check(AREA, "trigger_box", "its port may be opened");
    let port = case.rig.and_then(|r| r.trigger_box.as_ref());
    let Some(port) = port.map(|b| b.port.as_str()) else {
        return vec![check().not_checked("no rig file names its port")];
    };
    let state = case.survey.role("trigger_box").map(|l| l.state);
    vec![match state {
        Some(DeviceState::NotPermitted) => {
            let (rights, next) = access_denied(case, user, port);
            check().problem(format!("refused: {port}{rights}"), next)
        }
        None if case.survey.left_alone => check().not_checked(LEFT_ALONE),
        Some(DeviceState::Absent) | None => check().not_checked(format!("there is no {port}")),
        Some(_) => check().ok(format!("{port} opened")),
    }]
}

/// Group and mode of a file, and how to gain access: join the group that may open it, else install the udev rules.
fn access_denied(case: &Case<'_>, user: Option<&User>, node: &str) -> (String, String) {
    let rights = Some(node)
        .filter(|n| Path::new(n).is_absolute())
        .and_then(|n| case.machine.node(n));
    let Some(rights) = rights else {
        return (String::new(), INSTALL_RULES.to_owned());
    };
    let group = case.machine.group(rights.gid);
    let found = format!(" belongs to group {group}, mode {:04o}", rights.mode);
    let next = match user {
        Some(user) if group != "root" && rights.is_open_to_group() => {
            if user.groups.contains(&rights.gid) {
                INSTALL_RULES.to_owned()
            } else {
                format!(
                    "sudo usermod -aG {group} {}; then log out and in again",
                    user.name
                )
            }
        }
        _ => INSTALL_RULES.to_owned(),
    };
    (found, next)
}
