//! `skinrig devices`: connected devices, what prevents their use, and the next step.

use std::path::Path;
use std::time::Duration;

use serde::{Serialize, Serializer};
use skinrig_evk1::{CameraState, FoundDevice};
use skinrig_hil::lease::{self, LeaseState};
use skinrig_omega3::enumerate::{Availability, SERIAL_UNKNOWN};
use skinrig_omega3::load::LoadError;
use skinrig_protocol::rig::{RigFile, RigKind};
use skinrig_text::{Column, Table, widest};
use skinrig_trigger_box::PortState;

use crate::args::DevicesArgs;
use crate::exit::{Exit, Outcome};
use crate::hil::lease::{holder_of, path};
use crate::rig::bench;

/// Timeout of the trigger box's hello; opening its port resets it.
const HELLO: Duration = Duration::from_secs(4);
/// The same for an emulated box, whose simulated processor competes for a real one.
const EMULATED_HELLO: Duration = Duration::from_secs(20);

/// State of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum DeviceState {
    /// It responded.
    Ready,
    /// Another program uses it.
    Busy,
    /// The operating system denies access.
    NotPermitted,
    /// A device of another kind.
    OtherDevice,
    /// The box runs another firmware.
    OtherFirmware,
    /// Not connected, or not installed.
    Absent,
    /// Not queried.
    #[default]
    NotAsked,
    /// It responded wrongly.
    Faulty,
}

impl DeviceState {
    /// The name, as shown and in JSON.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Ready => "ready",
            Self::Busy => "busy",
            Self::NotPermitted => "not permitted",
            Self::OtherDevice => "other device",
            Self::OtherFirmware => "other firmware",
            Self::Absent => "absent",
            Self::NotAsked => "not asked",
            Self::Faulty => "faulty",
        }
    }
}

impl Serialize for DeviceState {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name())
    }
}

/// One device, found or expected.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub(crate) struct Line {
    /// `robot`, `camera`, `trigger box` or `port`.
    pub device: &'static str,
    /// Model and place.
    pub what: String,
    /// Its serial number, if known.
    pub serial: Option<String>,
    /// Its state.
    pub state: DeviceState,
    /// More about the state.
    pub detail: String,
    /// Its role in the rig file, for example `camera1`.
    pub role: Option<String>,
    /// What to do next.
    pub next_step: Option<String>,
    /// Firmware version reported by a ready device.
    #[serde(skip)]
    pub firmware: Option<String>,
    /// Bus and address, if found on USB.
    #[serde(skip)]
    pub usb: Option<(u8, u8)>,
}

impl Line {
    fn shown_serial(&self) -> &str {
        self.serial.as_deref().unwrap_or("-")
    }
}

/// `skinrig devices`.
///
/// # Errors
/// [`crate::exit::Failure`] for a rig file that cannot be read. It is no error if no device is connected.
pub(crate) fn devices(args: &DevicesArgs, json: bool) -> Outcome {
    let rig = args.rig.as_deref().map(bench::load).transpose()?;
    let lines = survey(rig.as_ref());
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "rig": rig.as_ref().map(|r| &r.name),
            "kind": rig.as_ref().map(|r| r.kind.name()),
            "devices": lines,
        }));
        return Ok(Exit::Ok);
    }
    print(&lines, rig.as_ref());
    Ok(Exit::Ok)
}

/// Lists connected devices and the devices of the rig file that are missing. Nothing moves. Opening the trigger box's port resets
/// the box, so the port stays closed while the bench is in use.
pub(crate) fn survey(rig: Option<&RigFile>) -> Vec<Line> {
    let mut lines = robots(rig);
    lines.extend(cameras(rig));
    lines.extend(trigger_boxes(rig));
    lines
}

fn print(lines: &[Line], rig: Option<&RigFile>) {
    if let Some(rig) = rig {
        outln!("rig       {}", bench::display_name(rig));
    }
    let column = |of: fn(&Line) -> &str| widest(lines.iter().map(of));
    let (what, serial) = (column(|l| &l.what), column(Line::shown_serial));
    let table = Table::new([11, what, serial, 13].map(Column::left));
    for l in lines {
        let role = l.role.as_ref().map(|r| format!("[{r}]"));
        let first = [l.device, &l.what, l.shown_serial(), l.state.name()];
        let more = [Some(l.detail.as_str()), role.as_deref()];
        let more = more.into_iter().flatten().filter(|c| !c.is_empty());
        outln!("{}", table.row(first.into_iter().chain(more)));
        if let Some(next) = &l.next_step {
            outln!("             next: {next}");
        }
    }
    if lines.iter().all(|l| l.state != DeviceState::Ready) {
        outln!(
            "\nno device is ready. The simulated rig needs none: `skinrig run protocols/demo.yaml`; docs/how-to/bench.md describes how to wire a bench"
        );
    }
}

fn robots(rig: Option<&RigFile>) -> Vec<Line> {
    let line = |what: &str, state, detail: String, next_step: Option<String>| Line {
        device: "robot",
        what: what.to_owned(),
        state,
        detail,
        next_step,
        ..Line::default()
    };
    let expected = rig.map(|r| r.robot.serial);
    let library = rig.and_then(|r| r.robot.library.as_deref());
    let loaded = match skinrig_omega3::load::load(library) {
        Ok(loaded) => loaded,
        Err(e) => {
            let detail = match &e {
                LoadError::Absent(tried) => format!("libdrd not found in {} places", tried.len()),
                other => other.to_string(),
            };
            let next = "install Force Dimension's SDK (3.10 or newer is advised) and name its libdrd in the rig file or in SKINRIG_LIBDRD; everything else works without it";
            return vec![line(
                "omega.3 library",
                DeviceState::Absent,
                detail,
                Some(next.to_owned()),
            )];
        }
    };
    let found = match skinrig_omega3::enumerate::list(&loaded.library) {
        Ok(found) => found,
        Err(e) => return vec![line("omega.3", DeviceState::Faulty, e.to_string(), None)],
    };
    let mut lines: Vec<Line> = found
        .iter()
        .map(|f| {
            let (state, detail) = match &f.availability {
                Availability::Free => (DeviceState::Ready, String::new()),
                Availability::Busy => (DeviceState::Busy, "in use by another program".to_owned()),
                Availability::NotPermitted => (DeviceState::NotPermitted, String::new()),
                Availability::OtherModel => (DeviceState::OtherDevice, "not an omega.3".to_owned()),
                Availability::Failed(e) => (DeviceState::Faulty, e.to_string()),
            };
            Line {
                serial: f.serial.map(|s| s.to_string()),
                // The library reports 65535 for a device without a serial number.
                role: (expected == Some(f.serial.unwrap_or(SERIAL_UNKNOWN)))
                    .then(|| "robot".to_owned()),
                firmware: f.firmware.clone(),
                ..line(
                    f.model.as_deref().unwrap_or("Force Dimension device"),
                    state,
                    detail,
                    f.next_step(),
                )
            }
        })
        .collect();
    add_missing(
        &mut lines,
        "robot",
        "omega.3",
        expected.map(|s| ("robot", s.to_string())),
    );
    lines
}

fn camera_line(what: &str, state: DeviceState, detail: String) -> Line {
    Line {
        device: "camera",
        what: what.to_owned(),
        state,
        detail,
        ..Line::default()
    }
}

/// A camera with the USB IDs of an EVK1; `role_of` gives the role of a serial number or port.
fn evk1_line(found: &FoundDevice, role_of: &dyn Fn(&str) -> Option<String>) -> Line {
    let what = |model: &str| format!("{model}, {}", found.place);
    let line = match &found.state {
        CameraState::Ready(identity) => Line {
            serial: Some(identity.serial.clone()),
            role: role_of(&identity.serial).or_else(|| role_of(found.port.as_deref()?)),
            firmware: Some(identity.firmware()),
            ..camera_line(
                &what("EVK1 Gen3.1"),
                DeviceState::Ready,
                identity.firmware(),
            )
        },
        CameraState::Busy => camera_line(
            &what("camera"),
            DeviceState::Busy,
            "in use by another program".to_owned(),
        ),
        CameraState::NoPermission => {
            camera_line(&what("camera"), DeviceState::NotPermitted, String::new())
        }
        CameraState::NotEvk1(other) => camera_line(
            &what("not an EVK1"),
            DeviceState::OtherDevice,
            other.clone(),
        ),
        CameraState::Faulty(why) => camera_line(&what("camera"), DeviceState::Faulty, why.clone()),
    };
    Line {
        next_step: found.next_step(),
        usb: Some(found.address),
        ..line
    }
}

fn cameras(rig: Option<&RigFile>) -> Vec<Line> {
    let role_of = |serial: &str| {
        let cameras = &rig?.cameras;
        let roles = ["camera1", "camera2"];
        let at = cameras.iter().position(|c| c.serial == serial)?;
        Some(roles[at].to_owned())
    };
    let mut lines = Vec::new();
    let others = other_cameras(&mut lines, &role_of);
    match skinrig_evk1::enumerate() {
        Err(e) => lines.push(camera_line("USB", DeviceState::Faulty, e.to_string())),
        Ok(found) => {
            let evk1 = found.iter().filter(|f| !others.contains(&f.address));
            lines.extend(evk1.map(|f| evk1_line(f, &role_of)));
        }
    }
    for (role, camera) in ["camera1", "camera2"]
        .into_iter()
        .zip(rig.iter().flat_map(|r| &r.cameras))
    {
        add_missing(
            &mut lines,
            "camera",
            &format!("camera, model {}", camera.model),
            Some((role, camera.serial.clone())),
        );
    }
    if rig.is_none() && lines.is_empty() {
        lines.push(Line {
            next_step: Some("check cable and power; an EVK1 needs USB 3".to_owned()),
            ..camera_line(
                "EVK1",
                DeviceState::Absent,
                "no device with the USB IDs of an EVK1".to_owned(),
            )
        });
    }
    lines
}

/// Adds a line for each supported camera that is not an EVK1; returns bus and address of each.
#[cfg(feature = "evk4")]
fn other_cameras(lines: &mut Vec<Line>, role_of: &dyn Fn(&str) -> Option<String>) -> Vec<(u8, u8)> {
    use skinrig_evk4::CameraState;

    let known = crate::rig::evt3_camera::evk1_places();
    let mut places = Vec::new();
    // A USB failure is reported by the EVK1's list.
    for found in skinrig_evk4::enumerate(&known).unwrap_or_default() {
        let (bus, device) = found.place;
        // Other devices with the same USB IDs are left to the EVK1's list.
        if let CameraState::Ready(model, serial) = found.state {
            places.push(found.place);
            lines.push(Line {
                device: "camera",
                what: format!("{}, USB bus {bus} device {device}", model.name()),
                role: role_of(&serial),
                serial: Some(serial),
                state: DeviceState::Ready,
                detail: format!("model {}", model.word()),
                usb: Some(found.place),
                ..Line::default()
            });
        }
    }
    places
}

/// This build supports no other cameras.
#[cfg(not(feature = "evk4"))]
fn other_cameras(_: &mut Vec<Line>, _: &dyn Fn(&str) -> Option<String>) -> Vec<(u8, u8)> {
    Vec::new()
}

/// Adds a line for a device of the rig file that is not among `lines`. A device without a known serial number, for example
/// because it is busy, may be the expected one.
fn add_missing(
    lines: &mut Vec<Line>,
    device: &'static str,
    model: &str,
    expected: Option<(&str, String)>,
) {
    let (role, serial) = match expected {
        Some((role, serial)) => (Some(role.to_owned()), Some(serial)),
        None => (None, None),
    };
    let is_present = match &role {
        Some(role) => lines.iter().any(|l| l.role.as_ref() == Some(role)),
        None => !lines.is_empty(),
    };
    if is_present {
        return;
    }
    let is_candidate = |l: &&Line| {
        l.device == device
            && l.serial.is_none()
            && matches!(
                l.state,
                DeviceState::Busy | DeviceState::NotPermitted | DeviceState::Faulty
            )
    };
    let candidates: Vec<DeviceState> = lines.iter().filter(is_candidate).map(|l| l.state).collect();
    let (state, detail, next_step) = match candidates.first() {
        None => (
            DeviceState::Absent,
            String::new(),
            "plug it in and switch it on, or correct its serial number in the rig file",
        ),
        Some(first) => (
            DeviceState::NotAsked,
            format!(
                "may be one that is {}: {} of that kind without a known serial number",
                first.name(),
                candidates.len()
            ),
            "fix that one first, then repeat this command",
        ),
    };
    lines.push(Line {
        device,
        what: model.to_owned(),
        serial,
        state,
        detail,
        role,
        next_step: Some(next_step.to_owned()),
        ..Line::default()
    });
}

/// Queries the rig file's trigger box. Other serial ports are only listed: bytes sent to an unknown device may move something.
fn trigger_boxes(rig: Option<&RigFile>) -> Vec<Line> {
    let port = rig
        .and_then(|r| r.trigger_box.as_ref())
        .map(|b| b.port.clone());
    let hello = match rig.map(|r| r.kind) {
        Some(RigKind::Emulated) => EMULATED_HELLO,
        _ => HELLO,
    };
    let mut lines = Vec::new();
    // Opening the port resets the box, which would disturb a run.
    let holder = rig.and_then(holder);
    let open = if let (Some(holder), Some(port)) = (&holder, &port) {
        lines.push(Line {
            device: "trigger box",
            what: port.clone(),
            state: DeviceState::Busy,
            detail: "not opened, which would reset it".to_owned(),
            role: Some("trigger_box".to_owned()),
            next_step: Some(format!(
                "wait until the bench is free: {holder} holds it; see `skinrig hil lease`"
            )),
            ..Line::default()
        });
        None
    } else {
        port.as_ref()
    };
    for found in
        skinrig_trigger_box::enumerate(open.map(std::slice::from_ref).unwrap_or_default(), hello)
    {
        use skinrig_trigger_box::OpenError;
        use skinrig_trigger_box::handshake::HandshakeError;
        let (state, detail) = match &found.state {
            PortState::Ready(identity) => (
                DeviceState::Ready,
                format!("firmware {}", identity.firmware),
            ),
            PortState::Closed(OpenError::Absent(_)) => (DeviceState::Absent, String::new()),
            PortState::Closed(OpenError::Busy(_)) => (DeviceState::Busy, String::new()),
            PortState::Closed(OpenError::NotPermitted(_)) => {
                (DeviceState::NotPermitted, String::new())
            }
            PortState::Closed(_) => (DeviceState::Faulty, String::new()),
            PortState::Unusable(HandshakeError::WrongFirmware {
                firmware, protocol, ..
            }) => (
                DeviceState::OtherFirmware,
                format!("firmware {firmware} with protocol {protocol}"),
            ),
            PortState::Unusable(_) => (DeviceState::OtherDevice, String::new()),
        };
        let (identity, next_step) = match &found.state {
            PortState::Ready(identity) => (Some(identity.clone()), None),
            other => (None, Some(other.to_string())),
        };
        lines.push(Line {
            device: "trigger box",
            what: found.port,
            serial: identity.as_ref().map(|i| i.serial.clone()),
            state,
            detail,
            role: Some("trigger_box".to_owned()),
            next_step,
            firmware: identity.map(|i| i.firmware),
            ..Line::default()
        });
    }
    for path in serial_ports(Path::new("/dev/serial/by-id")) {
        if port.as_deref() != Some(&path) {
            lines.push(Line {
                device: "port",
                what: path,
                state: DeviceState::NotAsked,
                next_step: Some(
                    "if this is the trigger box, name the port in the rig file; other ports are never opened".to_owned(),
                ),
                ..Line::default()
            });
        }
    }
    lines
}

/// Current holder of the bench's lease.
fn holder(rig: &RigFile) -> Option<String> {
    match lease::inspect(&path(rig)) {
        Ok(LeaseState::Held { owner, .. }) => Some(holder_of(owner.as_deref())),
        _ => None,
    }
}

/// Serial ports by their persistent names, sorted.
fn serial_ports(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut ports: Vec<String> = entries.map(|e| e.path().display().to_string()).collect();
    ports.sort();
    ports
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(state: DeviceState, serial: Option<&str>, role: Option<&str>) -> Line {
        Line {
            device: "camera",
            what: "camera, USB bus 1 device 4".to_owned(),
            serial: serial.map(str::to_owned),
            state,
            role: role.map(str::to_owned),
            ..Line::default()
        }
    }

    /// State of camera 1 when `found` is the only camera.
    fn state_beside(found: Line) -> Option<DeviceState> {
        let mut lines = vec![found];
        let expected = Some(("camera1", "00001753".to_owned()));
        add_missing(&mut lines, "camera", "EVK1", expected);
        lines.get(1).map(|l| l.state)
    }

    #[test]
    fn a_device_that_may_be_the_busy_one_is_not_called_absent() {
        for state in [
            DeviceState::Busy,
            DeviceState::NotPermitted,
            DeviceState::Faulty,
        ] {
            assert_eq!(
                state_beside(camera(state, None, None)),
                Some(DeviceState::NotAsked)
            );
        }
        let other = camera(DeviceState::Ready, Some("00001754"), Some("camera2"));
        assert_eq!(state_beside(other), Some(DeviceState::Absent));
        let it = camera(DeviceState::Ready, Some("00001753"), Some("camera1"));
        assert_eq!(state_beside(it), None);
        assert_eq!(
            state_beside(camera(DeviceState::OtherDevice, None, None)),
            Some(DeviceState::Absent)
        );
    }
}
