//! The typed life cycle of a run, and the function that executes all of it.

use std::marker::PhantomData;

use skinrig_device::Rig;
use skinrig_model::{AttemptId, HostTime, PressHistory, PressId, ResumeHeader, RunEnd, RunHeader};
use skinrig_protocol::plan::Plan;

use crate::checks::Preflight;
use crate::control::ControlHandle;
use crate::error::{ControllerError, Problem};
use crate::executor::Executor;
use crate::press_fault::PressFault;
use crate::settings::ControllerSettings;
use crate::sink::RecordSink;
use crate::states::Event;

/// Data to continue an interrupted, stopped or faulted session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resume {
    /// First record of the leg.
    pub header: ResumeHeader,
    /// History of each planned press from earlier legs, in plan order.
    pub histories: Vec<PressHistory>,
}

/// Result of a run over all legs of its session. `planned = valid + invalid + missed`, always.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub struct RunReport {
    /// Kind of the end, as in the last record.
    pub end: RunEnd,
    /// Causes of an early end, followed by an unsafe state of the robot, if any. Empty after a completed run and after the
    /// operator's stop.
    pub causes: Vec<ControllerError>,
    /// Faults of each attempt in this leg, in order.
    pub press_faults: Vec<(AttemptId, PressFault)>,
    /// Valid presses, over all legs.
    pub valid_presses: Vec<PressId>,
    /// Time of the end.
    pub ended_at: HostTime,
    /// Number of presses in the plan.
    pub planned: usize,
    /// Number of valid presses.
    pub valid: usize,
    /// Number of presses attempted but not valid.
    pub invalid: usize,
    /// Number of presses never attempted.
    pub missed: usize,
    /// True if the tip reached clearance height at the end, or the robot was never armed.
    pub retracted: bool,
    /// True if the robot confirmed that it is disarmed.
    pub disarmed: bool,
    /// Further problems during the end.
    pub problems: Vec<Problem>,
}

impl RunReport {
    /// True if the last attempt at the press, in any leg, was valid.
    #[must_use]
    pub fn is_valid(&self, press: PressId) -> bool {
        self.valid_presses.contains(&press)
    }
}

/// State of a [`Run`]: no device is open.
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

/// A run in state `S`. Dropping it in any state before [`Finished`] first retracts, disarms, stops the cameras and
/// writes the last records.
pub struct Run<'a, S> {
    executor: Executor<'a>,
    state: PhantomData<S>,
}

impl<'a, S> Run<'a, S> {
    fn into_state<T>(self) -> Run<'a, T> {
        Run {
            executor: self.executor,
            state: PhantomData,
        }
    }
}

impl<'a> Run<'a, Planned> {
    /// A run of `plan` on `rig`. Nothing happens until it is armed.
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

    /// Like [`new`](Self::new), with settings other than the defaults.
    pub fn with_settings(
        plan: &'a Plan,
        header: RunHeader,
        rig: Rig,
        control: &ControlHandle,
        sink: &'a mut dyn RecordSink,
        settings: ControllerSettings,
    ) -> Self {
        Self {
            executor: Executor::new(plan, header, rig, control, sink, settings),
            state: PhantomData,
        }
    }

    /// Adds checks before the robot is powered.
    #[must_use]
    pub fn checked(mut self, preflight: Preflight) -> Self {
        self.executor.preflight = Some(preflight);
        self
    }

    /// Makes it a further leg of a session: the plan must be the remaining one of the session
    /// ([`Plan::remaining`] with the presses of [`Plan::wanted`]), the header that of the session.
    #[must_use]
    pub fn resumed(mut self, resume: Resume) -> Self {
        self.executor.journal.restore(&resume.histories);
        self.executor.resume = Some(resume);
        self
    }

    /// Executes the plan from arming to disarming, and returns the report; see [`execute`].
    pub fn execute(self) -> RunReport {
        match self.arm() {
            Ok(run) => run.begin().run().report(),
            Err(report) => *report,
        }
    }

    /// Checks the plan against the rig, configures every device and reads it back, starts the cameras and
    /// powers the robot, which holds its position.
    ///
    /// The report of a run that ended here, with the rig at rest.
    /// The report of a run that ended here, the rig at rest.
    pub fn arm(mut self) -> Result<Run<'a, Armed>, Box<RunReport>> {
        match self.executor.catch_panic(Executor::arm) {
            Ok(()) => Ok(self.into_state()),
            Err(halt) => {
                self.executor.conclude(Err(halt));
                Err(Box::new(self.executor.take_report()))
            }
        }
    }
}

impl<'a> Run<'a, Armed> {
    /// Starts the plan. Nothing moves yet.
    #[must_use]
    pub fn begin(mut self) -> Run<'a, Running> {
        self.executor.machine.fire(Event::Begin);
        self.into_state()
    }
}

impl<'a> Run<'a, Running> {
    /// Executes the plan and ends the run, whatever happens.
    #[must_use]
    pub fn run(mut self) -> Run<'a, Finished> {
        let result = self.executor.catch_panic(Executor::steps);
        self.executor.conclude(result);
        self.into_state()
    }
}

impl Run<'_, Finished> {
    /// Result of the run.
    pub fn report(mut self) -> RunReport {
        self.executor.take_report()
    }
}

impl Executor<'_> {
    fn take_report(&mut self) -> RunReport {
        // Concluding always leaves a report; a missing one must not read as success.
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

/// Executes `plan` on `rig` from arming to disarming, and emits all records to `sink`.
///
/// Returns when the rig is at rest, even after a stop, an abort, a fault of a device or of the sink, or a panic in
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

/// Like [`execute`], after a preflight: if a check fails, the robot is not powered, and the report names the check.
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
