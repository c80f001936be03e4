//! The life of a run in types, and the one call that goes through all of it.

use std::marker::PhantomData;

use skinrig_device::Rig;
use skinrig_model::{AttemptId, HostTime, PressHistory, PressId, ResumeHeader, RunEnd, RunHeader};
use skinrig_protocol::plan::Plan;

use crate::checks::Preflight;
use crate::control::ControlHandle;
use crate::core::Core;
use crate::error::{ControllerError, Problem};
use crate::press_fault::PressFault;
use crate::settings::ControllerSettings;
use crate::sink::RecordSink;
use crate::states::Event;

/// How a session goes on that was cut off, stopped or broken off by a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resume {
    /// The first record of the leg.
    pub header: ResumeHeader,
    /// What the legs before know of each planned press, in plan order.
    pub histories: Vec<PressHistory>,
}

/// What became of a run, all legs of its session together. `planned = valid + invalid + missed`, always.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub struct RunReport {
    /// How it ended, as in the last record.
    pub end: RunEnd,
    /// Why it ended before its plan did, typed: what ended it, and how the robot was left when that is not as it should be. Empty
    /// after a completed run and after the operator's stop.
    pub causes: Vec<ControllerError>,
    /// What was wrong with each attempt of this leg, in order.
    pub press_faults: Vec<(AttemptId, PressFault)>,
    /// The presses that are valid, all legs together.
    pub valid_presses: Vec<PressId>,
    /// When.
    pub ended_at: HostTime,
    /// Presses of the plan.
    pub planned: usize,
    /// Presses done as planned.
    pub valid: usize,
    /// Presses attempted, but not as planned.
    pub invalid: usize,
    /// Presses never attempted.
    pub missed: usize,
    /// True when the tip was seen at clearance height at the end, or the robot was never armed.
    pub retracted: bool,
    /// True when the robot confirmed that it is disarmed.
    pub disarmed: bool,
    /// What else went wrong while ending.
    pub problems: Vec<Problem>,
}

impl RunReport {
    /// True for a press whose last attempt, in whichever leg, was valid.
    #[must_use]
    pub fn is_valid(&self, press: PressId) -> bool {
        self.valid_presses.contains(&press)
    }
}

/// State of a [`Run`]: nothing has been opened.
#[derive(Debug)]
pub enum Planned {}
/// State of a [`Run`]: devices are configured and read back, cameras stream, the robot holds.
#[derive(Debug)]
pub enum Armed {}
/// State of a [`Run`]: ready to execute its steps.
#[derive(Debug)]
pub enum Running {}
/// State of a [`Run`]: disarmed, all records written.
#[derive(Debug)]
pub enum Finished {}

/// A run in state `S`. Dropped in any state before [`Finished`], it retracts, disarms, stops the cameras and
/// writes its last records first.
pub struct Run<'a, S> {
    core: Core<'a>,
    state: PhantomData<S>,
}

impl<'a, S> Run<'a, S> {
    fn become_<T>(self) -> Run<'a, T> {
        Run {
            core: self.core,
            state: PhantomData,
        }
    }
}

impl<'a> Run<'a, Planned> {
    /// A run of `plan` on `rig`. Nothing happens yet.
    pub fn new(
        plan: &'a Plan,
        header: RunHeader,
        rig: Rig,
        control: &ControlHandle,
        sink: &'a mut dyn RecordSink,
    ) -> Self {
        Self::with_settings(
            plan,
            header,
            rig,
            control,
            sink,
            ControllerSettings::default(),
        )
    }

    /// As [`new`](Self::new), with other than the default settings.
    pub fn with_settings(
        plan: &'a Plan,
        header: RunHeader,
        rig: Rig,
        control: &ControlHandle,
        sink: &'a mut dyn RecordSink,
        settings: ControllerSettings,
    ) -> Self {
        Self {
            core: Core::new(plan, header, rig, control, sink, settings),
            state: PhantomData,
        }
    }

    /// With these checks before the robot is powered.
    #[must_use]
    pub fn checked(mut self, preflight: Preflight) -> Self {
        self.core.preflight = Some(preflight);
        self
    }

    /// As a further leg of a session: the plan given is what is left of the session's own
    /// ([`Plan::remaining`] with the presses that [`Plan::wanted`] names), the header that of the session.
    #[must_use]
    pub fn resumed(mut self, resume: Resume) -> Self {
        self.core.journal.remember(&resume.histories);
        self.core.resume = Some(resume);
        self
    }

    /// Executes the plan from arming to disarming, and says what became of it; see [`execute`].
    pub fn execute(self) -> RunReport {
        match self.arm() {
            Ok(run) => run.begin().run().report(),
            Err(report) => *report,
        }
    }

    /// Checks the plan against the rig, configures every device and reads it back, starts the cameras and
    /// powers the robot, which holds its position.
    ///
    /// # Errors
    /// The report of a run that ended here, the rig at rest.
    pub fn arm(mut self) -> Result<Run<'a, Armed>, Box<RunReport>> {
        match self.core.shielded(Core::arm) {
            Ok(()) => Ok(self.become_()),
            Err(halt) => {
                self.core.conclude(Err(halt));
                Err(Box::new(self.core.take_report()))
            }
        }
    }
}

impl<'a> Run<'a, Armed> {
    /// Begins the plan. Nothing moves yet.
    #[must_use]
    pub fn begin(mut self) -> Run<'a, Running> {
        self.core.machine.fire(Event::Begin);
        self.become_()
    }
}

impl<'a> Run<'a, Running> {
    /// Executes the plan and ends the run, whatever happens.
    #[must_use]
    pub fn run(mut self) -> Run<'a, Finished> {
        let result = self.core.shielded(Core::steps);
        self.core.conclude(result);
        self.become_()
    }
}

impl Run<'_, Finished> {
    /// What became of it.
    pub fn report(mut self) -> RunReport {
        self.core.take_report()
    }
}

impl Core<'_> {
    fn take_report(&mut self) -> RunReport {
        // Concluding always leaves a report; an absent one must not read as success.
        self.report.take().unwrap_or_else(|| RunReport {
            end: RunEnd::Faulted("internal error: no report".to_owned()),
            causes: vec![ControllerError::Internal("no report".to_owned())],
            press_faults: Vec::new(),
            valid_presses: Vec::new(),
            ended_at: HostTime::ZERO,
            planned: self.plan.presses.len(),
            valid: 0,
            invalid: 0,
            missed: self.plan.presses.len(),
            retracted: false,
            disarmed: false,
            problems: Vec::new(),
        })
    }
}

/// Executes `plan` on `rig` from arming to disarming, and tells `sink` everything that happens.
///
/// Returns when the rig is at rest: also after a stop, an abort, a device fault, a fault of the sink, or a panic in
/// any of them. `header` is the first record.
pub fn execute(
    plan: &Plan,
    header: RunHeader,
    rig: Rig,
    control: &ControlHandle,
    sink: &mut dyn RecordSink,
) -> RunReport {
    Run::new(plan, header, rig, control, sink).execute()
}

/// As [`execute`], after a preflight: with a failed check the robot is not powered, and the report says which.
pub fn execute_checked(
    plan: &Plan,
    header: RunHeader,
    rig: Rig,
    control: &ControlHandle,
    sink: &mut dyn RecordSink,
    preflight: Preflight,
    settings: ControllerSettings,
) -> RunReport {
    let run = Run::with_settings(plan, header, rig, control, sink, settings);
    run.checked(preflight).execute()
}
