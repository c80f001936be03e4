//! A run: its parts, and the report of its execution.

use skinrig_device::Rig;
use skinrig_model::{
    AttemptId, HostTime, PressFault, PressHistory, PressId, Record, ResumeHeader, RunEnd, RunHeader,
};
use skinrig_protocol::plan::Plan;

use crate::checks::Preflight;
use crate::control::ControlHandle;
use crate::error::Problem;
use crate::executor::Executor;
use crate::looks::{Looks, NoLooks};
use crate::settings::ControllerSettings;
use crate::sink::RecordSink;
use crate::touch_sense::{NoSense, TouchSense};

/// Data to continue an interrupted, stopped or faulted session.
#[derive(Debug, Clone, PartialEq)]
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
    /// The end, as in the last record: the faults of an early end are followed by an unsafe state of the robot, if any.
    pub end: RunEnd,
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

/// A run of a plan on a rig. Nothing happens before [`execute`](Self::execute).
pub struct Run<'a> {
    leg: Leg,
    parts: RunParts<'a>,
}

/// The leg of the session that a run executes.
pub(crate) struct Leg {
    header: RunHeader,
    resume: Option<Resume>,
}

/// Everything that the executor of a run needs.
pub(crate) struct RunParts<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) rig: Rig,
    pub(crate) control: ControlHandle,
    pub(crate) sink: &'a mut dyn RecordSink,
    pub(crate) settings: ControllerSettings,
    pub(crate) preflight: Option<Preflight>,
    pub(crate) looks: Box<dyn Looks>,
    pub(crate) sense: Box<dyn TouchSense>,
}

impl Leg {
    /// Header of the session.
    pub(crate) const fn header(&self) -> &RunHeader {
        &self.header
    }

    /// History of each planned press from earlier legs; `None` in the first leg.
    pub(crate) fn histories(&self) -> Option<&[PressHistory]> {
        self.resume.as_ref().map(|r| r.histories.as_slice())
    }

    /// First record of the leg.
    pub(crate) fn first_record(&self) -> Record {
        match &self.resume {
            None => Record::Started(Box::new(self.header.clone())),
            Some(resume) => Record::Resumed(Box::new(resume.header.clone())),
        }
    }
}

impl<'a> Run<'a> {
    /// A run of `plan` on `rig` that emits all records to `sink`. `header` is the first record.
    #[must_use]
    pub fn new(
        plan: &'a Plan,
        header: RunHeader,
        rig: Rig,
        control: &ControlHandle,
        sink: &'a mut dyn RecordSink,
    ) -> Self {
        Self {
            leg: Leg {
                header,
                resume: None,
            },
            parts: RunParts {
                plan,
                rig,
                control: control.clone(),
                sink,
                settings: ControllerSettings::default(),
                preflight: None,
                looks: Box::new(NoLooks),
                sense: Box::new(NoSense),
            },
        }
    }

    /// Replaces the default settings.
    #[must_use]
    pub fn with_settings(mut self, settings: ControllerSettings) -> Self {
        self.parts.settings = settings;
        self
    }

    /// Adds a preflight: if a check fails, the robot is not powered, and the report names the check.
    #[must_use]
    pub fn checked(mut self, preflight: Preflight) -> Self {
        self.parts.preflight = Some(preflight);
        self
    }

    /// Takes the looks of the plan with `looks`; without them, a plan that declares looks runs to its end.
    #[must_use]
    pub fn looking(mut self, looks: Box<dyn Looks>) -> Self {
        self.parts.looks = looks;
        self
    }

    /// Feels touches with `sense`. Without it, the plan's request for touches is ignored.
    #[must_use]
    pub fn feeling(mut self, sense: Box<dyn TouchSense>) -> Self {
        self.parts.sense = sense;
        self
    }

    /// Makes it a further leg of a session: the plan must be the remaining one of the session
    /// ([`Plan::remaining`] with the presses of [`Plan::pending`]), the header that of the session.
    #[must_use]
    pub fn resumed(mut self, resume: Resume) -> Self {
        self.leg.resume = Some(resume);
        self
    }

    /// Executes the plan from arming to disarming.
    ///
    /// Returns when the rig is at rest, even after a stop, an abort, a fault of a device or of the sink, or a panic in
    /// any of them.
    pub fn execute(self) -> RunReport {
        Executor::new(self.parts).execute(&self.leg)
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind, panic_any};
    use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

    use skinrig_device::{DeviceError, Indenter, IndenterCapabilities, MotionLimits, RobotSample};
    use skinrig_model::{
        DeviceIdentity, Point3, RigidTransform, Robot, Setting, SimLevel, Skin, StreamFormat,
    };
    use skinrig_protocol::plan::{RunLimits, TripReaction};
    use skinrig_protocol::{Retakes, Suspend};
    use skinrig_sim::config::SimConfig;
    use skinrig_sim::rig::simulated_rig;

    use super::*;
    use skinrig_model::fault::SinkFault;

    const CLEARANCE_MM: f64 = 5.0;

    /// State of the robot, and the call that panics, counted from now on.
    #[derive(Default)]
    struct Log {
        is_armed: bool,
        calls: u32,
        panic_at: Option<u32>,
        height_mm: f64,
    }

    /// A simulated robot that logs its state.
    struct LoggedIndenter<I> {
        inner: I,
        skin_from_robot: RigidTransform<Skin, Robot>,
        log: Arc<Mutex<Log>>,
    }

    fn lock(log: &Mutex<Log>) -> MutexGuard<'_, Log> {
        log.lock().unwrap_or_else(PoisonError::into_inner)
    }

    impl<I> LoggedIndenter<I> {
        fn call(&self) {
            let mut log = lock(&self.log);
            log.calls += 1;
            if log.panic_at == Some(log.calls) {
                drop(log);
                panic_any("robot panics".to_owned());
            }
        }
    }

    impl<I: Indenter> Indenter for LoggedIndenter<I> {
        fn identity(&self) -> DeviceIdentity {
            self.inner.identity()
        }
        fn capabilities(&self) -> IndenterCapabilities {
            self.inner.capabilities()
        }
        fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
            self.inner.configure(limits)
        }
        fn arm(&mut self) -> Result<(), DeviceError> {
            self.inner.arm()?;
            lock(&self.log).is_armed = true;
            Ok(())
        }
        fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
            self.call();
            self.inner.command(target, speed_mm_s)
        }
        fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
            self.call();
            let answer = self.inner.poll(samples);
            if let Some(last) = samples.last() {
                lock(&self.log).height_mm = self.skin_from_robot.apply(last.measured).z_mm;
            }
            answer
        }
        fn hold(&mut self) -> Result<(), DeviceError> {
            self.call();
            self.inner.hold()
        }
        fn disarm(&mut self) -> Result<(), DeviceError> {
            self.inner.disarm()?;
            lock(&self.log).is_armed = false;
            Ok(())
        }
    }

    #[derive(Default)]
    struct Records(Vec<Record>);

    impl RecordSink for Records {
        fn accept(&mut self, record: Record) -> Result<(), SinkFault> {
            self.0.push(record);
            Ok(())
        }
    }

    fn plan_without_steps() -> Plan {
        Plan {
            version: 1,
            name: "empty".into(),
            seed: 1,
            limits: RunLimits {
                workspace_min_mm: [-40.0, -50.0, -3.0],
                workspace_max_mm: [60.0, 55.0, 40.0],
                clearance_mm: CLEARANCE_MM,
                max_depth_mm: 3.0,
                max_speed_mm_s: 100.0,
                max_force_n: 8.0,
                position_tolerance_mm: 0.05,
                settle_time: skinrig_model::HostDuration::from_millis(20),
                max_acceleration_mm_s2: None,
                on_trip: TripReaction::Retract,
            },
            surroundings: None,
            retakes: Retakes::NONE,
            max_consecutive_invalid: 0,
            surface_check: None,
            suspend: Suspend::default(),
            stop: None,
            online: None,
            presses: Vec::new(),
            steps: Vec::new(),
        }
    }

    fn header(config: &SimConfig) -> RunHeader {
        RunHeader {
            protocol_text: String::new(),
            protocol_name: String::new(),
            protocol_sha256: String::new(),
            overrides: Vec::new(),
            plan_json: String::new(),
            plan_sha256: String::new(),
            seed: 1,
            rig_kind: String::new(),
            rig_name: String::new(),
            rig_json: String::new(),
            robot_from_skin: config.robot_from_skin,
            stream_formats: [StreamFormat::Evt2; 2],
            prototype: String::new(),
            operator: String::new(),
            started_at: String::new(),
            host: String::new(),
            software: String::new(),
            command_line: String::new(),
            presses: Vec::new(),
        }
    }

    #[test]
    fn an_armed_executor_that_is_dropped_or_unwound_comes_to_rest() {
        // Last case: the robot panics once more while the first panic unwinds.
        for (is_unwound, second) in [(false, None), (true, None), (true, Some(20))] {
            let mut config = SimConfig::new(5, SimLevel::Kinematic);
            config.start = Point3::new(0.0, 0.0, 1.0);
            let log = Arc::new(Mutex::new(Log::default()));
            let mut rig = simulated_rig(&config);
            rig.indenter = Box::new(LoggedIndenter {
                // Leaked, because only a reference to a boxed robot is a robot.
                inner: Box::leak(rig.indenter),
                skin_from_robot: config.robot_from_skin.inverse(),
                log: log.clone(),
            });
            let (plan, mut sink) = (plan_without_steps(), Records::default());
            let control = ControlHandle::new();
            let run = Run::new(&plan, header(&config), rig, &control, &mut sink);
            let ended = catch_unwind(AssertUnwindSafe(|| {
                let Run { leg, parts } = run;
                let mut executor = Executor::new(parts);
                assert_eq!(executor.arm(&leg), Ok(()));
                {
                    let mut log = lock(&log);
                    assert!(log.is_armed && log.height_mm < CLEARANCE_MM - 1.0);
                    log.panic_at = second.map(|n| log.calls + n);
                }
                if is_unwound {
                    panic_any("caller panics".to_owned());
                }
            }));
            assert_eq!(ended.is_err(), is_unwound);
            let log = lock(&log);
            assert!(!log.is_armed && log.height_mm > CLEARANCE_MM - 0.06);
            assert!(log.panic_at.is_none_or(|n| log.calls > n));
            assert!(matches!(
                sink.0.last(),
                Some(Record::Ended {
                    end: RunEnd::Faulted(_),
                    ..
                })
            ));
        }
    }
}
