//! Checks the connections: devices of the rig file, hubs, controllers, USB speed.

use skinrig_omega3::enumerate::USB_VENDOR;
use skinrig_protocol::rig::RigKind;

use super::case::Case;
use super::finding::{Finding, check};
use super::rates::CAMERA_B_S;
use super::survey::{LEFT_ALONE, Library, name_of};
use super::usb::{self, UsbDevice};
use crate::devices::{DeviceState, Line};

const AREA: &str = "cables";
const SPEED: &str = "USB speed";
/// Speed that a camera needs, Mbit/s.
const CAMERA_MBIT: u64 = 5000;
/// Most bits of 5000 Mbit/s that carry data: 8 of 10 (USB 3, 8b/10b coding).
const CODING: f64 = 0.8;
/// Speed of the robot, Mbit/s (USB 2.0 high speed).
const ROBOT_MBIT: u64 = 480;

/// All findings about cables.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    let devices = usb::list(case.machine);
    if case.survey.left_alone {
        return vec![check(AREA, "devices", "those of the rig file").not_checked(LEFT_ALONE)];
    }
    let mut findings = connected(case, devices.as_deref().ok());
    let cameras: Vec<&Line> = case.survey.cameras().collect();
    match &devices {
        Ok(devices) => {
            let attached: Vec<(&Line, Option<&UsbDevice>)> = cameras
                .iter()
                .map(|l| (*l, devices.iter().find(|d| Some(d.place) == l.usb)))
                .collect();
            findings.extend(attached.iter().map(|(l, d)| hub(l, *d)));
            findings.push(controllers(&attached));
            findings.extend(attached.iter().map(|(l, d)| camera_speed(l, *d)));
            findings.push(robot_speed(devices));
        }
        Err(why) => {
            findings.push(check(AREA, "USB tree", "hubs, controllers, speeds").not_checked(why))
        }
    }
    findings
}

/// Checks that the devices of the rig file are connected; without a rig file, lists those that are.
fn connected(case: &Case<'_>, devices: Option<&[UsbDevice]>) -> Vec<Finding> {
    let Some(rig) = case.rig else {
        return unnamed(case);
    };
    let mut roles = vec!["robot", "camera1", "camera2"];
    if rig.trigger_box.is_some() {
        roles.push("trigger_box");
    }
    let library = matches!(case.survey.library, Library::Loaded { .. });
    let on_bus = |vendor: u16| devices.map(|all| all.iter().any(|d| d.vendor == vendor));
    let finding = |role: &str| {
        let check = check(
            AREA,
            role,
            format!("{} is connected", expected_device(case, role)),
        );
        let Some(line) = case.survey.role(role) else {
            // Without its library, the robot is not in the survey.
            return match on_bus(USB_VENDOR) {
                _ if role != "robot" || library => check.not_checked("not queried"),
                Some(false) if rig.kind == RigKind::Bench => check.problem(
                    "no device of Force Dimension (USB vendor 1451) on the bus",
                    "plug the robot in and switch it on",
                ),
                _ => check.not_checked("the robot cannot be queried without its library"),
            };
        };
        let next = || line.next_step.clone().unwrap_or_default();
        match line.state {
            DeviceState::Ready => check.ok(line.what.as_str()),
            DeviceState::Absent => check.problem("not connected", next()),
            DeviceState::NotAsked => check.not_checked(line.detail.as_str()),
            DeviceState::Faulty | DeviceState::OtherDevice => {
                check.problem(with_detail(line), next())
            }
            DeviceState::Busy | DeviceState::NotPermitted | DeviceState::OtherFirmware => {
                check.ok(format!("{}, {}", line.what, line.state.name()))
            }
        }
    };
    let mut findings: Vec<Finding> = roles.iter().map(|role| finding(role)).collect();
    // A device that does not respond may be the missing one.
    let nameless = |l: &&Line| l.role.is_none() && is_faulty(l);
    findings.extend(case.survey.lines.iter().filter(nameless).map(fault));
    findings
}

fn unnamed(case: &Case<'_>) -> Vec<Finding> {
    let mut findings =
        vec![check(AREA, "devices", "those of the rig file").not_checked("no rig file given")];
    for line in &case.survey.lines {
        if line.state == DeviceState::Ready {
            findings.push(check(AREA, name_of(line), "responds").ok(line.what.as_str()));
        } else if is_faulty(line) {
            findings.push(fault(line));
        }
    }
    findings
}

/// A machine without USB is not a cable fault; the permissions report it.
fn is_faulty(line: &Line) -> bool {
    line.state == DeviceState::Faulty && line.what != "USB"
}

fn fault(line: &Line) -> Finding {
    let check = check(AREA, name_of(line), "responds correctly");
    let next = line.next_step.clone();
    check.problem(
        with_detail(line),
        next.unwrap_or_else(|| "unplug it, wait 5 s, plug it in again".to_owned()),
    )
}

fn with_detail(line: &Line) -> String {
    match line.detail.as_str() {
        "" => format!("{}, {}", line.what, line.state.name()),
        detail => format!("{}, {}: {detail}", line.what, line.state.name()),
    }
}

/// The device that the rig file names for a role.
fn expected_device(case: &Case<'_>, role: &str) -> String {
    let Some(rig) = case.rig else {
        return role.to_owned();
    };
    match role {
        "robot" => format!("{} {}", rig.robot.model, rig.robot.serial),
        "camera1" => format!("{} {}", rig.cameras[0].model, rig.cameras[0].serial),
        "camera2" => format!("{} {}", rig.cameras[1].model, rig.cameras[1].serial),
        _ => rig
            .trigger_box
            .as_ref()
            .map_or_else(String::new, |b| format!("a box at {}", b.port)),
    }
}

fn hub(line: &Line, device: Option<&UsbDevice>) -> Finding {
    let check = check(
        AREA,
        format!("{}: hub", name_of(line)),
        "no hub between camera and computer",
    );
    match device {
        None => check.not_checked("the kernel does not list it"),
        Some(UsbDevice { hub: Some(hub), .. }) => check.warning(
            format!("behind the hub at {hub}"),
            "plug the camera into the computer itself: a hub shares its bandwidth and adds a cable that may fail",
        ),
        Some(_) => check.ok("none"),
    }
}

fn controllers(attached: &[(&Line, Option<&UsbDevice>)]) -> Finding {
    let check = check(
        AREA,
        "cameras: controllers",
        "each camera on its own USB controller",
    );
    let of = |(_, device): &(&Line, Option<&UsbDevice>)| device.and_then(|d| d.controller.clone());
    match attached.iter().map(of).collect::<Vec<_>>().as_slice() {
        [Some(one), Some(two)] if one == two => check.warning(
            format!("both on {one}"),
            "plug one camera into a port of another controller (`lsusb -t` shows the tree), or add one: two cameras at full rate lose data \
            on one controller",
        ),
        [Some(one), Some(two)] => check.ok(format!("{one} and {two}")),
        [_, _] => check.not_checked("the kernel does not report the controllers"),
        other => check.not_checked(format!("{} cameras on the bus", other.len())),
    }
}

fn camera_speed(line: &Line, device: Option<&UsbDevice>) -> Finding {
    let check = check(
        SPEED,
        name_of(line),
        format!("{CAMERA_MBIT} Mbit/s or more (USB 3)"),
    );
    match device.and_then(|d| d.speed_mbit) {
        Some(mbit) if mbit >= CAMERA_MBIT => {
            let times = CODING * mbit as f64 * 1e6 / 8.0 / CAMERA_B_S;
            let found = format!("{mbit} Mbit/s");
            check
                .ok(found)
                .means(format!("{times:.1} times a camera's peak"))
        }
        Some(mbit) => {
            let percent = 100.0 * mbit as f64 * 1e6 / 8.0 / CAMERA_B_S;
            let finding = check.problem(
                format!("{mbit} Mbit/s"),
                "use a USB 3 port (blue, or marked SS) and a USB 3 cable; push the plug home: half in, it is a USB 2 plug",
            );
            finding.means(format!("{percent:.0} % of a camera's peak"))
        }
        None => check.not_checked("the kernel does not report its speed"),
    }
}

fn robot_speed(devices: &[UsbDevice]) -> Finding {
    let check = check(SPEED, "robot", format!("{ROBOT_MBIT} Mbit/s (USB 2.0)"));
    let robot = devices.iter().find(|d| d.vendor == USB_VENDOR);
    match robot.map(|d| d.speed_mbit) {
        Some(Some(mbit)) if mbit >= ROBOT_MBIT => check
            .ok(format!("{mbit} Mbit/s"))
            .means("the robot's full speed"),
        Some(Some(mbit)) => check.warning(
            format!("{mbit} Mbit/s"),
            "use another port and cable: the control loop polls the arm thousands of times a second",
        ),
        Some(None) => check.not_checked("the kernel does not report its speed"),
        None => check.not_checked("no device of Force Dimension (USB vendor 1451) on the bus"),
    }
}
