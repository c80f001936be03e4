//! Compares versions of library and firmwares with the rig file and with those that this build supports.

use skinrig_controller::contains_version;
use skinrig_protocol::rig::RigFile;
use skinrig_trigger_box::protocol::{FIRMWARE_VERSION, PROTOCOL_VERSION};

use super::case::Case;
use super::finding::{Check, Finding, check};
use super::survey::Library;
use crate::devices::{DeviceState, Line};

const AREA: &str = "versions";
/// First firmware of the robot with a watchdog (Force Dimension's documentation of `dhdSetWatchdog`).
const WATCHDOG_SINCE: f64 = 3.0;
const ACCEPT: &str =
    "install the expected version, or accept this one in the rig file after testing it";

/// All findings about versions.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    let mut findings = vec![library(case), robot(case)];
    for (i, role) in ["camera1", "camera2"].into_iter().enumerate() {
        let key = |rig: &RigFile| rig.cameras[i].fpga.as_ref().map(|v| format!("FPGA {v}"));
        findings.push(firmware(case, role, &format!("cameras.{role}.fpga"), key));
    }
    findings.push(trigger_box(case));
    findings
}

fn library(case: &Case<'_>) -> Finding {
    let required = case.rig.and_then(|r| r.robot.library_version.as_deref());
    let expected = required.map_or_else(
        || "a libdrd that this build can use".to_owned(),
        |v| format!("SDK {v}"),
    );
    let check = check(AREA, "robot library", expected);
    match &case.survey.library {
        Library::Loaded { version, .. }
            if required.is_some_and(|w| !contains_version(version, w)) =>
        {
            check.problem(format!("SDK {version}"), ACCEPT)
        }
        Library::Loaded {
            version,
            advice: Some(advice),
        } => check.warning(format!("SDK {version}"), advice.as_str()),
        Library::Loaded { version, .. } => check.ok(format!("SDK {version}")),
        Library::Unusable(why) => check.problem(
            why.as_str(),
            "name another libdrd in the rig file (robot.library) or in SKINRIG_LIBDRD",
        ),
        Library::Absent(places) => {
            let found = format!("no libdrd (places tried: {places})");
            let next = "install Force Dimension's SDK, and name its libdrd in the rig file (robot.library) or in SKINRIG_LIBDRD";
            match case.rig {
                Some(_) => check.problem(found, next),
                None => check.not_checked_yet(found, next),
            }
        }
    }
}

fn robot(case: &Case<'_>) -> Finding {
    let key = |rig: &RigFile| rig.robot.firmware.clone();
    let mut finding = firmware(case, "robot", "robot.firmware", key);
    let reported = line_of(case, "robot").and_then(|l| l.firmware.as_deref());
    let old = reported
        .and_then(|v| v.parse().ok())
        .is_some_and(|v: f64| v < WATCHDOG_SINCE);
    if old && finding.verdict == super::finding::Verdict::Ok {
        finding = check(AREA, "robot", format!("{WATCHDOG_SINCE:.1} or later, which has a watchdog")).warning(
            finding.found,
            "ask Force Dimension for an update: without the watchdog the device does not brake the arm when this computer crashes",
        );
    }
    finding
}

/// The device with a role; without a rig file, the first robot whose firmware is known.
fn line_of<'a>(case: &Case<'a>, role: &str) -> Option<&'a Line> {
    case.survey.role(role).or_else(|| {
        let kind = if role == "robot" { "robot" } else { "" };
        let ready = |l: &&Line| l.device == kind && l.firmware.is_some();
        case.survey
            .lines
            .iter()
            .find(ready)
            .filter(|_| case.rig.is_none())
    })
}

/// Compares the firmware of a device with the version that the rig file expects under `key`.
fn firmware(
    case: &Case<'_>,
    role: &str,
    key: &str,
    required: impl Fn(&RigFile) -> Option<String>,
) -> Finding {
    let required = case.rig.and_then(required);
    let expected = match (&required, case.rig) {
        (Some(version), _) => version.clone(),
        (None, Some(_)) => format!("any: {key} is not set"),
        (None, None) => "any: no rig file".to_owned(),
    };
    let check = check(AREA, role, expected);
    match line_of(case, role).and_then(|l| l.firmware.as_deref()) {
        None => check.not_checked("not queried"),
        Some(found) if required.is_none_or(|w| contains_version(found, &w)) => check.ok(found),
        Some(found) => check.problem(found, ACCEPT),
    }
}

fn trigger_box(case: &Case<'_>) -> Finding {
    let supported = format!("firmware {FIRMWARE_VERSION} with protocol {PROTOCOL_VERSION}");
    let required = |rig: &RigFile| rig.trigger_box.as_ref()?.firmware.clone();
    let flash = |line: &Line| line.next_step.clone().unwrap_or_default();
    match case.survey.role("trigger_box") {
        Some(line) if line.state == DeviceState::OtherFirmware => {
            box_check(&supported).problem(line.detail.as_str(), flash(line))
        }
        Some(line) if line.firmware.is_some() && case.rig.and_then(required).is_none() => {
            box_check(&supported).ok(line.detail.as_str())
        }
        _ => firmware(case, "trigger_box", "trigger_box.firmware", required),
    }
}

fn box_check(expected: &str) -> Check {
    check(AREA, "trigger_box", expected)
}
