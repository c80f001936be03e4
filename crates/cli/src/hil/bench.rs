//! Implements `Bench` for a rig file: production drivers, each device opened separately.

use std::io;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use skinrig_controller::ControlHandle;
use skinrig_device::CameraSettings;
use skinrig_hil::lease::Lease;
use skinrig_hil::{Bench, CampaignRun, Devices, DrillResult, OnlineComparison, Problem};
use skinrig_model::{CameraId, HostDuration};
use skinrig_nightly::{Evidence, EvidenceKind, GoldenSession};
use skinrig_protocol::CameraRequest;
use skinrig_protocol::rig::{Drill, RigFile, RigKind};
use skinrig_protocol::suite::Light;

use super::real_bench::{RealBench, closed, software, subject, timing_slack_of};
use super::{campaign, drill, trouble};
use crate::rig::bench;

/// Time limit for a program that switches the lamps.
const LAMPS_TIMEOUT: Duration = Duration::from_secs(10);
/// Polling interval for that program.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

impl Bench for RealBench {
    fn rig(&self) -> &RigFile {
        &self.rig
    }

    fn devices(&mut self) -> &mut Devices {
        let mut devices = self.devices.take().unwrap_or_else(|| Devices {
            robot: Err(closed("robot")),
            cameras: CameraId::ALL.map(|c| Err(closed(subject(c)))),
            trigger_box: self
                .rig
                .trigger_box
                .is_some()
                .then(|| Err(closed("trigger box"))),
            clock: Box::new(self.clock),
        });
        if devices.robot.is_err() {
            devices.robot = match bench::omega_config(&self.rig) {
                Ok(config) => match bench::omega(config, self.clock) {
                    Ok(omega) => Ok(Box::new(omega)),
                    Err(e) => Err(trouble::robot(&e, &self.rig)),
                },
                Err(failure) => Err(software("robot", &failure)),
            };
        }
        for camera in CameraId::ALL {
            let held = devices.cameras.iter().filter(|c| c.is_ok()).count();
            let slot = &mut devices.cameras[camera.index()];
            if slot.is_err() {
                *slot = self.open_camera(camera, held);
            }
        }
        if let (Some(slot @ Err(_)), Some(setup)) =
            (&mut devices.trigger_box, &self.rig.trigger_box)
        {
            let kind = self.rig.kind;
            *slot = bench::trigger_box(setup, kind, self.clock)
                .and_then(|device| bench::detached_box(Box::new(device), kind, self.clock))
                .map_err(|e| trouble::trigger_box(&e, setup));
        }
        let mut firmware = Vec::new();
        if let Ok(robot) = &devices.robot {
            let identity = robot.identity();
            // Versions are compared between nights; the file of the library, in parentheses behind its version, is none.
            let versions = identity.firmware.split(" (").next().unwrap_or_default();
            firmware.push(("robot", versions.to_owned()));
        }
        for camera in CameraId::ALL {
            if let Ok(device) = &devices.cameras[camera.index()] {
                firmware.push((subject(camera), device.identity().firmware));
            }
        }
        if let Some(Ok(device)) = &devices.trigger_box {
            firmware.push(("trigger box", device.identity().firmware));
        }
        for (device, version) in firmware {
            self.note_firmware(device, &version);
        }
        self.devices.insert(devices)
    }

    fn close(&mut self) {
        // Every driver stops its device when it is dropped.
        self.devices = None;
    }

    fn camera_settings(&self, camera: CameraId) -> Result<CameraSettings, Problem> {
        let setup = &self.rig.cameras[camera.index()];
        bench::camera_settings(setup, &CameraRequest::default()).map_err(|failure| {
            let what = failure.message;
            let kind = EvidenceKind::Refused;
            Box::new(
                Evidence::new(kind, subject(camera), what)
                    .next("correct the camera's settings in the rig file"),
            )
        })
    }

    fn set_light(&mut self, light: Light) -> Result<bool, Problem> {
        let Some(lamps) = &self.rig.hil.lamps else {
            return Ok(false);
        };
        let words = match light {
            Light::Dark => &lamps.dark,
            Light::Lit => &lamps.lit,
        };
        switch(words).map(|()| true).map_err(|why| {
            let what = format!("lamp program `{}`: {why}", words.join(" "));
            let next = "run it by hand, then correct `hil.light` in the rig file";
            Box::new(Evidence::new(EvidenceKind::State, "computer", what).next(next))
        })
    }

    fn permits(&self, drill: Drill) -> bool {
        self.rig.kind == RigKind::Emulated || self.rig.hil.drills.contains(&drill)
    }

    fn watchdog_drill(&mut self) -> Result<DrillResult, Problem> {
        self.close();
        drill::watchdog(self)
    }

    fn run_campaign(&mut self, protocol: &Path) -> Result<CampaignRun, Problem> {
        self.close();
        campaign::run(self, protocol)
    }

    fn compare_online(&mut self, session: &GoldenSession) -> Result<OnlineComparison, Problem> {
        campaign::compare_online(self, session)
    }

    fn folder(&self) -> &Path {
        &self.folder
    }

    fn firmware(&self) -> Vec<(String, String)> {
        self.firmware.clone()
    }

    fn stop_signal(&self) -> Box<dyn Fn() -> bool> {
        let operator = self.operator.clone();
        let lost = self.lease.as_ref().map(Lease::watch);
        Box::new(move || operator.is_requested() || lost.as_ref().is_some_and(|lost| lost()))
    }

    fn stop_requested(&self) -> bool {
        self.operator.is_requested() || self.lease_is_lost()
    }

    fn control(&self) -> ControlHandle {
        self.operator.control().clone()
    }

    fn lease_is_lost(&self) -> bool {
        self.lease.as_ref().is_some_and(Lease::is_lost)
    }

    fn timing_slack(&self) -> HostDuration {
        timing_slack_of(self.rig.kind)
    }
}

/// Why the lamp program failed.
#[derive(Debug, thiserror::Error)]
enum LampsError {
    /// The rig file names no program.
    #[error("expected a program")]
    NoProgram,
    /// The system cannot start it.
    #[error("cannot be started: {0}")]
    Start(#[source] io::Error),
    /// The system cannot wait for its end.
    #[error("cannot be waited for: {0}")]
    Wait(#[source] io::Error),
    /// The program failed.
    #[error("expected success, found {0}")]
    Failed(ExitStatus),
    /// The program does not end in time.
    #[error("expected an end within {LAMPS_TIMEOUT:?}")]
    Late,
}

/// Runs a program to its end, without a shell.
fn switch(words: &[String]) -> Result<(), LampsError> {
    let (program, arguments) = words.split_first().ok_or(LampsError::NoProgram)?;
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .map_err(LampsError::Start)?;
    let until = Instant::now() + LAMPS_TIMEOUT;
    loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return Ok(()),
            Ok(Some(status)) => return Err(LampsError::Failed(status)),
            Ok(None) if Instant::now() < until => std::thread::sleep(POLL_INTERVAL),
            Ok(None) => {
                let _ = child.kill();
                let _ = child.wait();
                return Err(LampsError::Late);
            }
            Err(e) => return Err(LampsError::Wait(e)),
        }
    }
}
