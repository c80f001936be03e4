//! The preflight: checks of rig and devices before the robot is powered.

use skinrig_device::DeviceError;
use skinrig_model::pulse::{LOOPBACK, decode_marks};
use skinrig_model::{
    CameraId, CheckKind, DeviceIdentity, DeviceRole, HostDuration, PreflightCheck, RawChunk,
    Record, Setting, TriggerEdge,
};
use skinrig_protocol::rig::RigFile;

use crate::error::{ControllerError, Halt};
use crate::executor::{Collect, Executor};

/// How often to send the test mark before the line counts as broken: one damaged train must not cost a night.
const ATTEMPTS: u32 = 4;

/// Checks to make before the robot is powered.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Preflight {
    /// Results of checks that the caller has already made: disk, frame, recorder.
    pub caller_checks: Vec<PreflightCheck>,
    /// Expected device per role.
    pub expected: Vec<ExpectedDevice>,
    /// Time within which both cameras' clocks must advance; `None` skips the check.
    pub clocks_within: Option<HostDuration>,
    /// Loop-back of a mark through both cameras; `None` skips the check.
    pub loopback: Option<Loopback>,
}

/// Expected device in a role.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExpectedDevice {
    /// Role in the rig.
    pub role: DeviceRole,
    /// Its serial number; `None` for any.
    pub serial: Option<String>,
    /// Versions that its firmware text must contain.
    pub versions: Vec<String>,
    /// Required values of read-only settings by name, for example a library version.
    pub settings: Vec<(String, String)>,
}

/// Loop-back of a mark from the trigger box through the cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loopback {
    /// Trigger channels of camera 1 and camera 2.
    pub channels: [u8; 2],
    /// Longest time from sending until the bytes of both cameras reach the host.
    pub within: HostDuration,
}

/// Data from the cameras during the preflight.
#[derive(Debug, Default)]
pub(crate) struct StreamProbe {
    edges: [Vec<TriggerEdge>; 2],
    first_us: [Option<u64>; 2],
    last_us: [Option<u64>; 2],
}

impl StreamProbe {
    pub(crate) fn observe(&mut self, chunk: &RawChunk) {
        let i = chunk.camera.index();
        self.edges[i].extend_from_slice(&chunk.triggers);
        for t_us in [chunk.facts.first_us, chunk.facts.last_us]
            .into_iter()
            .flatten()
        {
            self.first_us[i].get_or_insert(t_us);
            self.last_us[i] = Some(t_us);
        }
    }

    fn advances(&self, camera: CameraId) -> bool {
        let i = camera.index();
        matches!((self.first_us[i], self.last_us[i]), (Some(a), Some(b)) if b > a)
    }

    /// True if the loop-back mark, and no other mark, arrived on `channel`.
    fn saw_mark(&self, camera: CameraId, channel: u8) -> bool {
        let marks = decode_marks(&self.on(camera, channel)).marks;
        !marks.is_empty() && marks.iter().all(|m| m.mark == LOOPBACK)
    }

    fn on(&self, camera: CameraId, channel: u8) -> Vec<TriggerEdge> {
        let edges = self.edges[camera.index()].iter().copied();
        edges.filter(|e| e.channel == channel).collect()
    }

    /// Description of the edges on `channel` and elsewhere.
    fn describe(&self, camera: CameraId, channel: u8) -> String {
        let here = self.on(camera, channel);
        let mut channels: Vec<u8> = self.edges[camera.index()]
            .iter()
            .map(|e| e.channel)
            .collect();
        channels.sort_unstable();
        channels.dedup();
        channels.retain(|c| *c != channel);
        let decoded = decode_marks(&here);
        let what = match decoded.marks.as_slice() {
            [] if here.is_empty() => format!("no edge on channel {channel}"),
            [] => format!(
                "no mark on channel {channel}, but {} edges: {} periodic trains, {} edges of no train",
                here.len(),
                decoded.syncs.len(),
                decoded.stray_edges
            ),
            marks if marks.iter().all(|m| m.mark == LOOPBACK) => "the mark".to_owned(),
            [first, ..] => {
                let n = decoded.marks.len();
                format!(
                    "{n} marks, the first `{}` of {}",
                    first.mark.kind, first.mark.press
                )
            }
        };
        if channels.is_empty() {
            what
        } else {
            format!("{what}; edges on channel {channels:?}")
        }
    }
}

impl ExpectedDevice {
    /// Expected devices of a rig file: the robot, both cameras, and the trigger box if it has one.
    #[must_use]
    pub fn of_rig(file: &RigFile) -> Vec<Self> {
        let robot = &file.robot;
        let mut expected = vec![Self {
            role: DeviceRole::Indenter,
            serial: Some(robot.serial.to_string()),
            versions: [&robot.firmware, &robot.library_version]
                .into_iter()
                .flatten()
                .cloned()
                .collect(),
            settings: robot
                .velocity_threshold
                .map(|t| ("velocity_threshold".to_owned(), t.to_string()))
                .into_iter()
                .collect(),
        }];
        for (id, camera) in CameraId::ALL.into_iter().zip(&file.cameras) {
            expected.push(Self {
                role: DeviceRole::of_camera(id),
                serial: Some(camera.serial.clone()),
                versions: camera.fpga.iter().map(|v| format!("FPGA {v}")).collect(),
                settings: Vec::new(),
            });
        }
        if let Some(device) = &file.trigger_box {
            expected.push(Self {
                role: DeviceRole::TriggerBox,
                serial: device.serial.clone(),
                versions: device.firmware.iter().cloned().collect(),
                settings: Vec::new(),
            });
        }
        expected
    }
}

/// Checks the identity of a device against the expected one of its role, if any.
#[must_use]
pub fn identity_checks(
    role: DeviceRole,
    wanted: Option<&ExpectedDevice>,
    identity: &DeviceIdentity,
) -> Vec<PreflightCheck> {
    let serial = wanted.and_then(|w| w.serial.as_deref());
    let mut checks = vec![
        PreflightCheck::new(
            format!("{role}: identity"),
            serial.map_or_else(|| "any serial number".to_owned(), |s| format!("serial {s}")),
            format!("{} {}", identity.model, identity.serial),
            serial.is_none_or(|s| s == identity.serial),
            "connect the right device, or correct its serial number in the rig file",
        )
        .about(CheckKind::Identity(role)),
    ];
    for version in wanted.iter().flat_map(|w| &w.versions) {
        checks.push(
            PreflightCheck::new(
                format!("{role}: version"),
                version.as_str(),
                identity.firmware.as_str(),
                contains_version(&identity.firmware, version),
                "install the expected version, or accept this one in the rig file after testing it",
            )
            .about(CheckKind::Identity(role)),
        );
    }
    checks
}

/// Settings whose read-back differs from the written value; read-only values are ignored.
pub fn differing(settings: &[Setting]) -> impl Iterator<Item = &Setting> {
    let written = settings.iter().filter(|s| s.was_requested());
    written.filter(|s| !same(&s.requested, &s.read_back))
}

impl Executor<'_> {
    /// Checks identity and read-back settings of a device.
    pub(crate) fn check_device(
        &mut self,
        role: DeviceRole,
        identity: &DeviceIdentity,
        settings: &[Setting],
    ) {
        let Some(preflight) = &self.preflight else {
            return;
        };
        let wanted = preflight.expected.iter().find(|e| e.role == role);
        let mut checks = identity_checks(role, wanted, identity);
        for (name, value) in wanted.iter().flat_map(|w| &w.settings) {
            let found = settings.iter().find(|s| s.name == *name);
            checks.push(
                PreflightCheck::new(
                    format!("{role}: {name}"),
                    value.as_str(),
                    found.map_or("not reported", |s| s.read_back.as_str()),
                    found.is_some_and(|s| same(value, &s.read_back)),
                    "find out what changed, or accept the value in the rig file after testing it",
                )
                .about(CheckKind::ReadBack(role)),
            );
        }
        if role != DeviceRole::TriggerBox {
            checks.push(read_back(role, settings));
        }
        if role == DeviceRole::Indenter {
            let told = settings.iter().find(|s| s.name == "initialised");
            checks.push(match told {
                Some(s) => PreflightCheck::new(
                    "indenter: initialised",
                    "true",
                    s.read_back.as_str(),
                    s.read_back == "true",
                    "initialise the robot by hand (calibration pole into the pit), or see docs/how-to/bench.md",
                )
                .about(CheckKind::State(role)),
                None => PreflightCheck::skipped(
                    "indenter: initialised",
                    "true",
                    "not reported by this robot",
                ),
            });
        }
        self.checks.extend(checks);
    }

    /// Checks, with the cameras streaming, that both clocks advance and a mark arrives through both.
    pub(crate) fn check_streams(&mut self) -> Result<(), Halt> {
        let Some(preflight) = self.preflight.clone() else {
            return Ok(());
        };
        self.watch = Some(StreamProbe::default());
        let answer = self.watch_streams(&preflight);
        self.watch = None;
        answer
    }

    fn watch_streams(&mut self, preflight: &Preflight) -> Result<(), Halt> {
        if let Some(within) = preflight.clocks_within {
            self.watch_until(within, |w| CameraId::ALL.into_iter().all(|c| w.advances(c)))?;
            for camera in CameraId::ALL {
                let watch = self.watch.as_ref();
                let times = watch.map_or((None, None), |w| {
                    (w.first_us[camera.index()], w.last_us[camera.index()])
                });
                let found = match times {
                    (Some(a), Some(b)) => format!("from {a} to {b} us"),
                    _ => "no time".to_owned(),
                };
                self.checks.push(
                    PreflightCheck::new(
                        format!("{camera}: clock"),
                        format!("advancing within {}", seconds(within)),
                        found,
                        watch.is_some_and(|w| w.advances(camera)),
                        "power-cycle the camera; a slave camera needs its master's sync line",
                    )
                    .about(CheckKind::Clock(DeviceRole::of_camera(camera))),
                );
            }
        }
        let Some(loopback) = preflight.loopback else {
            return Ok(());
        };
        if self.trigger_box.is_none() {
            return Ok(());
        }
        let seen = |w: &StreamProbe| {
            CameraId::ALL
                .into_iter()
                .all(|c| w.saw_mark(c, loopback.channels[c.index()]))
        };
        let mut attempts = 0;
        while attempts < ATTEMPTS && !self.watch.as_ref().is_some_and(seen) {
            attempts += 1;
            self.send_loopback()?;
            let share = HostDuration(loopback.within.0 / i64::from(ATTEMPTS));
            self.watch_until(share, seen)?;
        }
        for camera in CameraId::ALL {
            let channel = loopback.channels[camera.index()];
            let watch = self.watch.as_ref();
            self.checks.push(PreflightCheck::new(
                format!("{camera}: trigger loop-back"),
                format!(
                    "the mark on channel {channel} within {}",
                    seconds(loopback.within)
                ),
                watch.map_or_else(String::new, |w| {
                    let found = w.describe(camera, channel);
                    match attempts {
                        1 => found,
                        n => format!("{found}; {n} marks were sent"),
                    }
                }),
                watch.is_some_and(|w| w.saw_mark(camera, channel)),
                "check the trigger cable, its channel in the rig file, and levels (docs/how-to/bench.md)",
            )
            .about(CheckKind::Trigger(DeviceRole::of_camera(camera))));
        }
        Ok(())
    }

    /// Sends the test mark as soon as the line is free; the box may be sending its own train.
    fn send_loopback(&mut self) -> Result<(), Halt> {
        let until = self.now() + self.settings.mark_within;
        while let Some(trigger) = &mut self.trigger_box {
            match trigger.send(LOOPBACK) {
                Ok(sent) => {
                    let train = trigger.capabilities().train_duration;
                    self.hold_line(sent.t + train);
                    break;
                }
                Err(DeviceError::Pending { .. }) => self.tick(None)?,
                Err(DeviceError::State { .. }) if self.now() < until => self.tick(Some(until))?,
                Err(e) => return Err(ControllerError::from(e).into()),
            }
        }
        Ok(())
    }

    /// Polls the cameras until `done`, or until `within` has passed.
    fn watch_until(
        &mut self,
        within: HostDuration,
        done: impl Fn(&StreamProbe) -> bool,
    ) -> Result<(), Halt> {
        let until = self.now() + within;
        while !self.watch.as_ref().is_some_and(&done) && self.now() < until {
            self.tick(Some(until))?;
            // A chunk may take long to fill.
            self.collect(Collect::Flush)?;
        }
        Ok(())
    }

    /// Emits the checks. If one failed, or a device failed meanwhile, nothing is armed.
    pub(crate) fn conclude_preflight(&mut self, result: Result<(), Halt>) -> Result<(), Halt> {
        if self.preflight.is_none() {
            return result;
        }
        let mut checks = std::mem::take(&mut self.checks);
        if let Err(Halt::Fault(e)) = &result {
            checks.push(PreflightCheck::new(
                "devices",
                "every device answers, fits the plan and keeps its settings",
                e.to_string(),
                false,
                "`skinrig devices` shows what is connected",
            ));
        }
        let failed: Vec<PreflightCheck> = checks.iter().filter(|c| c.failed()).cloned().collect();
        self.journal.emit(Record::Preflight(checks))?;
        result?;
        if failed.is_empty() {
            return Ok(());
        }
        Err(ControllerError::Preflight { failed }.into())
    }
}

/// Checks that everything written reads back unchanged; read-only values are ignored.
fn read_back(role: DeviceRole, settings: &[Setting]) -> PreflightCheck {
    let written = settings.iter().filter(|s| s.was_requested());
    let differing: Vec<String> = differing(settings)
        .map(|s| format!("{} {} instead of {}", s.name, s.read_back, s.requested))
        .collect();
    PreflightCheck::new(
        format!("{role}: settings read back"),
        format!("{} as written", written.count()),
        if differing.is_empty() {
            "all".to_owned()
        } else {
            differing.join(", ")
        },
        differing.is_empty(),
        "power-cycle the device and try again",
    )
    .about(CheckKind::ReadBack(role))
}

/// `2 s`, without trailing zeros.
fn seconds(t: HostDuration) -> String {
    format!("{} s", t.as_secs_f64())
}

/// Equal as texts, or as numbers in single precision.
fn same(wanted: &str, found: &str) -> bool {
    if wanted == found {
        return true;
    }
    match (wanted.parse::<f64>(), found.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 1e-4 * a.abs().max(1e-3),
        _ => false,
    }
}

/// Whether the firmware text `found` contains the version `wanted` as a whole: `3.0` is in
/// `FPGA 3.0, system 1c`, but not in `13.0` or `3.01`.
#[must_use]
pub fn contains_version(found: &str, wanted: &str) -> bool {
    let part = |c: char| c.is_ascii_alphanumeric() || c == '.';
    found.match_indices(wanted).any(|(at, _)| {
        let before = found[..at].chars().next_back();
        let after = found[at + wanted.len()..].chars().next();
        !before.is_some_and(part) && !after.is_some_and(part)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_and_values_are_compared_as_a_whole() {
        assert!(contains_version("FPGA 3.0, system 1c", "3.0"));
        assert!(contains_version("3.0", "3.0"));
        for found in ["13.0", "3.01", "3.0.1", "v3", ""] {
            assert!(!contains_version(found, "3.0"), "{found}");
        }
        assert!(same("0.14", "0.14000000059604645") && same("evt2", "evt2"));
        assert!(!same("0.14", "0.15") && !same("on", "off") && !same("", "0"));
    }

    #[test]
    fn read_only_values_are_not_settings() {
        let setting = |requested: &str, read_back: &str| Setting {
            name: "x".into(),
            requested: requested.into(),
            read_back: read_back.into(),
        };
        let found = setting(Setting::AS_FOUND, "7");
        let check = read_back(DeviceRole::Indenter, &[found.clone(), setting("5", "5.0")]);
        assert!(
            !check.failed() && check.expected == "1 as written",
            "{check:?}"
        );
        // A tolerated difference is no written setting; its name explains it.
        let passed = setting(Setting::TOLERATED, "expected 1, found 2");
        assert!(!read_back(DeviceRole::Camera1, &[passed]).failed());
        let check = read_back(DeviceRole::Indenter, &[found, setting("5", "6")]);
        assert!(
            check.failed() && check.found == "x 6 instead of 5",
            "{check:?}"
        );
    }
}
