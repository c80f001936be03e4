//! State of a bench with real drivers: its rig file, and devices that are opened when needed.

use super::trouble;
use crate::exit::Failure;
use crate::rig::bench;
use crate::rig::tolerated::ToleratedMismatches;
use crate::signals::Operator;
use skinrig_device::{CameraSettings, EventCamera, RealClock, Rig};
use skinrig_hil::lease::Lease;
use skinrig_hil::{Bench, Devices, Problem, Slot};
use skinrig_model::{CameraId, HostDuration};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::Protocol;
use skinrig_protocol::rig::{CameraKind, RigFile, RigKind};
use std::path::PathBuf;

/// A bench with real drivers.
pub(crate) struct RealBench {
    pub(super) rig: RigFile,
    pub(super) folder: PathBuf,
    pub(super) operator: Operator,
    pub(super) command_line: String,
    pub(super) clock: RealClock,
    pub(super) devices: Option<Devices>,
    pub(super) tolerated: ToleratedMismatches,
    pub(super) firmware: Vec<(String, String)>,
    // Declared last, so that it is released after every device is closed.
    pub(super) lease: Option<Lease>,
}

impl RealBench {
    /// The bench of `rig`, with all devices closed. Sessions go to `folder`.
    #[must_use]
    pub(super) fn new(
        rig: RigFile,
        folder: PathBuf,
        operator: Operator,
        command_line: &str,
    ) -> Self {
        Self {
            rig,
            folder,
            operator,
            command_line: command_line.to_owned(),
            clock: RealClock::start(),
            devices: None,
            tolerated: ToleratedMismatches::default(),
            firmware: Vec::new(),
            lease: None,
        }
    }

    /// Adds the lease. The bench keeps it until dropped.
    #[must_use]
    pub(super) fn holding(self, lease: Lease) -> Self {
        Self {
            lease: Some(lease),
            ..self
        }
    }

    /// Control and stop requests from the terminal.
    #[must_use]
    pub(super) const fn operator(&self) -> &Operator {
        &self.operator
    }

    /// The command line that started this program.
    #[must_use]
    pub(super) fn command_line(&self) -> &str {
        &self.command_line
    }

    /// Prints the rig file lines that accept the tolerated mismatches.
    pub(crate) fn propose(&self) {
        self.tolerated.propose(&self.rig);
    }

    /// Opens every device and assembles the rig for a run of `protocol`, with a new clock. The
    /// bench keeps no device.
    ///
    /// # Errors
    /// The first device error.
    pub(crate) fn take_rig(&mut self, protocol: &Protocol) -> Result<Rig, Problem> {
        self.close();
        self.clock = RealClock::start();
        let mut settings = Vec::new();
        for (setup, request) in self.rig.cameras.iter().zip(&protocol.cameras) {
            let one = bench::camera_settings(setup, request);
            settings.push(one.map_err(|f| software("computer", &f))?);
        }
        let settings: [CameraSettings; 2] = settings
            .try_into()
            .map_err(|_| software("computer", &Failure::internal("two cameras")))?;
        self.devices();
        let Some(devices) = self.devices.take() else {
            return Err(software("computer", &Failure::internal("no devices")));
        };
        let [one, two] = devices.cameras;
        bench::assemble(
            (&self.rig, protocol),
            settings,
            devices.robot?,
            [one?, two?],
            devices.trigger_box.transpose()?,
            self.clock,
        )
        .map_err(|f| software("computer", &f))
    }

    pub(super) fn note_firmware(&mut self, device: &str, version: &str) {
        if !self.firmware.iter().any(|(d, _)| d == device) {
            self.firmware.push((device.to_owned(), version.to_owned()));
        }
    }

    /// Opens a camera. `held` cameras are already open here, so they do not count as busy.
    pub(super) fn open_camera(&mut self, camera: CameraId, held: usize) -> Slot<dyn EventCamera> {
        let setup = &self.rig.cameras[camera.index()];
        let subject = subject(camera);
        if setup.model == CameraKind::Evk1 {
            let opened = bench::evk1(setup, camera, self.clock);
            return match opened {
                Ok(evk1) => {
                    self.tolerated.add(camera, evk1.tolerated());
                    bench::detached_camera(Box::new(evk1), self.rig.kind, self.clock)
                        .map_err(|e| skinrig_hil::device_evidence::from_error(&e))
                }
                Err(e) => Err(trouble::camera(&e, subject, held)),
            };
        }
        let (kind, clock) = (self.rig.kind, self.clock);
        bench::open_camera(setup, kind, camera, clock, &mut self.tolerated).map_err(|failure| {
            let what = failure.message;
            Box::new(Evidence::new(EvidenceKind::Absent, subject, what))
        })
    }
}

/// Extra delay to tolerate from emulated devices that share this computer's processors.
pub(super) fn timing_slack_of(kind: RigKind) -> HostDuration {
    match kind {
        RigKind::Emulated => bench::SLOW_LATE,
        RigKind::Bench => HostDuration::ZERO,
    }
}

/// Name of a camera in results.
pub(super) fn subject(camera: CameraId) -> &'static str {
    match camera {
        CameraId::One => "camera1",
        CameraId::Two => "camera2",
    }
}

/// Initial content of a slot whose device was not opened yet.
pub(super) fn closed(subject: &str) -> Problem {
    Box::new(Evidence::new(EvidenceKind::State, subject, "not opened"))
}

/// Evidence of a fault in this program.
pub(super) fn software(subject: &str, failure: &Failure) -> Problem {
    Box::new(Evidence::new(
        EvidenceKind::Software,
        subject,
        &*failure.message,
    ))
}
