//! Arming: opens, configures, reads back and starts the devices, and waits for the robot's position.

use skinrig_model::{CameraId, DeviceRole, Record, RunFault};
use skinrig_protocol::plan::Step;

use super::Executor;
use super::steps::internal;
use crate::error::Halt;
use crate::preflight;
use crate::run::Leg;
use crate::states::{Action, Event, State};

impl Executor<'_> {
    /// Brings every device to readiness. Nothing moves.
    pub(crate) fn arm(&mut self, leg: &Leg) -> Result<(), Halt> {
        self.journal.emit(leg.first_record())?;
        let ready = self.catch_panic(|executor| executor.prepare(leg));
        self.conclude_preflight(ready)?;
        // If the operator has requested an end meanwhile, do not power the robot.
        self.handle_requests()?;
        if self.machine.state() == State::Retracting {
            return Err(Halt::Stopped);
        }
        self.indenter.arm()?;
        self.await_pose()?;
        if self.machine.state() == State::Retracting {
            return Err(Halt::Stopped); // the operator requested a stop meanwhile
        }
        match self.machine.fire(Event::ArmingDone) {
            Action::Reject => Err(internal("arming", self.machine.state())),
            _ => Ok(()),
        }
    }

    /// Everything before power: configures devices, reads them back, starts and checks the cameras.
    fn prepare(&mut self, leg: &Leg) -> Result<(), Halt> {
        let header = leg.header();
        preflight::check_plan(self.plan, header, leg.histories())?;
        if header.robot_from_skin != *self.indenter.robot_from_skin() {
            return Err(rig_error("header", "the skin pose of the rig", "a different one").into());
        }
        let can = self.indenter.capabilities();
        let touches = |s: &Step| matches!(s, Step::Press(p) if !p.surface.is_known());
        let touches = self.plan.surface_check.is_some() || self.plan.steps.iter().any(touches);
        if !can.reports_force && touches {
            return Err(rig_error(
                "indenter",
                "forces, because the plan finds the surface by touch",
                "a robot without force; write `press: {surface: known}` and no `surface_check`",
            )
            .into());
        }
        let (limits, remarks) =
            preflight::motion_limits(self.plan, self.indenter.robot_from_skin(), &can)?;
        for text in remarks {
            let t = self.now();
            self.journal.note(t, text)?;
        }
        let settings = self.indenter.configure(&limits)?;
        let identity = self.indenter.identity();
        self.preflight
            .check_device(DeviceRole::Indenter, &identity, &settings);
        self.journal.emit(Record::Device {
            role: DeviceRole::Indenter,
            identity,
            settings,
        })?;
        for camera in CameraId::ALL {
            self.configure_camera(camera, header.stream_formats[camera.index()])?;
        }
        self.check_trigger_box()?;
        self.cameras.start()?;
        self.check_streams()
    }

    fn configure_camera(
        &mut self,
        camera: CameraId,
        format: skinrig_model::StreamFormat,
    ) -> Result<(), RunFault> {
        let found = self.cameras.id(camera);
        if found != camera {
            return Err(rig_error("cameras", camera.to_string(), found.to_string()));
        }
        let can = self.cameras.capabilities(camera);
        if can.format != format {
            let expected = format!("stream format {format} (header)");
            return Err(rig_error(camera.to_string(), expected, can.format.name()));
        }
        let (identity, settings) = self.cameras.configure(camera)?;
        let role = DeviceRole::of_camera(camera);
        self.preflight.check_device(role, &identity, &settings);
        self.journal.emit(Record::Device {
            role,
            identity,
            settings,
        })
    }

    fn check_trigger_box(&mut self) -> Result<(), RunFault> {
        let marks = self
            .plan
            .steps
            .iter()
            .any(|s| matches!(s, Step::Press(p) if !p.marks.is_empty()));
        match self.trigger.identity() {
            Some(identity) => {
                self.preflight
                    .check_device(DeviceRole::TriggerBox, &identity, &[]);
                self.journal.emit(Record::Device {
                    role: DeviceRole::TriggerBox,
                    identity,
                    settings: Vec::new(),
                })
            }
            None if marks => Err(rig_error(
                "trigger box",
                "a trigger box, because the plan has trigger marks",
                "none; connect it or remove the marks from the protocol",
            )),
            None => Ok(()),
        }
    }

    /// Waits for the first pose after arming.
    fn await_pose(&mut self) -> Result<(), Halt> {
        let deadline = self.now() + self.settings.first_pose_within;
        loop {
            self.tick(None)?;
            if self.indenter.position().is_some() {
                return Ok(());
            }
            if self.now() >= deadline {
                let expected = format!("a sample within {}", self.settings.first_pose_within);
                return Err(Halt::Fault(RunFault::PoseStream {
                    expected,
                    found: "none".to_owned(),
                }));
            }
        }
    }
}

fn rig_error(
    place: impl Into<String>,
    expected: impl Into<String>,
    found: impl Into<String>,
) -> RunFault {
    RunFault::Rig {
        place: place.into(),
        expected: expected.into(),
        found: found.into(),
    }
}
