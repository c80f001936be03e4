//! The parts of a run, and the loop that polls the devices.
//!
//! Each part owns its state and is private to this module. Each stage of a run adds its methods in its own file: `arming`
//! (power on), `stream_checks` (preflight), `steps`, `press`, `press_data` and `search` (the plan), `surface` (surface
//! checks), `look` (a campaign's question), `feel` (touches felt meanwhile), `requests` (the operator), `suspension` (waiting), and `ending` (return to rest).

mod arming;
mod ending;
mod feel;
mod look;
mod press;
mod press_data;
mod requests;
mod search;
mod steps;
mod stream_checks;
mod surface;
mod suspension;

use skinrig_device::{Clock, DeviceError, Rig};
use skinrig_model::{
    CameraId, HostDuration, HostTime, Look, MotionCommand, Point3, Record, RunFault, Skin,
};
use skinrig_protocol::plan::Plan;

use crate::camera_streams::{CameraStreams, ReadMode};
use crate::error::Halt;
use crate::feeling::Feeling;
use crate::guard::GuardedIndenter;
use crate::journal::Journal;
use crate::looks::Looks;
use crate::machine::Machine;
use crate::pose_trackers::PoseTrackers;
use crate::preflight_run::PreflightRun;
use crate::press_series::PressSeries;
use crate::run::{Leg, RunParts, RunReport};
use crate::settings::ControllerSettings;
use crate::states::Event;
use crate::suspend::Suspender;
use crate::trigger_line::TriggerLine;

/// The parts of a run. Dropping it before the end of the run brings the rig to rest.
pub(crate) struct Executor<'a> {
    plan: &'a Plan,
    settings: ControllerSettings,
    indenter: GuardedIndenter<'static>,
    cameras: CameraStreams,
    trigger: TriggerLine,
    clock: Box<dyn Clock>,
    journal: Journal<'a>,
    machine: Machine,
    trackers: PoseTrackers,
    series: PressSeries,
    preflight: PreflightRun,
    suspender: Suspender,
    looks: Box<dyn Looks>,
    feeling: Feeling,
    /// The first look with an answer.
    answered: Option<Look>,
    /// The look that stops the run.
    decided: Option<Look>,
}

impl<'a> Executor<'a> {
    pub(crate) fn new(parts: RunParts<'a>) -> Self {
        let RunParts {
            plan,
            rig,
            control,
            sink,
            settings,
            preflight,
            looks,
            sense,
        } = parts;
        let Rig {
            indenter,
            cameras,
            camera_settings,
            trigger_box,
            clock,
            robot_from_skin,
            ..
        } = rig;
        Self {
            plan,
            settings,
            indenter: GuardedIndenter::new(indenter, robot_from_skin, plan.limits, &settings)
                .with_surroundings(plan.surroundings.clone()),
            cameras: CameraStreams::new(cameras, camera_settings, settings.camera_lag),
            trigger: TriggerLine::new(trigger_box, settings.mark_within),
            clock,
            journal: Journal::new(sink, plan.presses.len(), &settings),
            machine: Machine::new(control),
            series: PressSeries::new(plan),
            trackers: PoseTrackers::default(),
            preflight: PreflightRun::new(preflight),
            suspender: Suspender::new(plan.suspend),
            looks,
            feeling: Feeling::new(sense),
            answered: None,
            decided: None,
        }
    }

    /// Executes one leg from arming to disarming.
    pub(crate) fn execute(mut self, leg: &Leg) -> RunReport {
        self.journal.restore(leg.histories().unwrap_or_default());
        let result = self.catch_panic(|executor| {
            executor.arm(leg)?;
            executor.machine.fire(Event::Begin);
            executor.steps()
        });
        self.conclude(result)
    }

    fn now(&self) -> HostTime {
        self.clock.now()
    }

    /// Commands a straight motion; returns the time after the indenter accepted it.
    fn command(&mut self, target: Point3<Skin>, speed_mm_s: f64) -> Result<HostTime, RunFault> {
        // A slow sink may have delayed the loop: poll again before moving.
        if self.indenter.check_fresh(self.clock.now()).is_err() {
            self.observe_poses()?;
        }
        self.indenter
            .command(target, speed_mm_s, self.clock.now())?;
        let t = self.clock.now();
        self.journal.emit(Record::Command {
            t,
            command: MotionCommand { target, speed_mm_s },
        })?;
        Ok(t)
    }

    /// One turn of the loop: waits for at most one tick and not beyond `due`, then polls the devices and handles the
    /// operator's requests.
    fn tick(&mut self, due: Option<HostTime>) -> Result<(), Halt> {
        let now = self.now();
        let mut until = now + self.settings.tick;
        for t in [due, self.trigger.next_due()].into_iter().flatten() {
            if t > now && t < until {
                until = t;
            }
        }
        self.clock.wait_until(until);
        self.observe()?;
        self.suspend()?;
        self.take_looks()?;
        self.feel()?;
        self.handle_requests()
    }

    /// Polls every device without waiting.
    fn observe(&mut self) -> Result<(), RunFault> {
        let poses = self.observe_poses();
        let cameras = self.collect(ReadMode::Poll);
        let line = self.observe_box();
        if self.journal.is_ending() {
            for e in [cameras, line].into_iter().filter_map(Result::err) {
                self.journal.problem("", e);
            }
            return poses;
        }
        poses.and(cameras).and(line)?;
        self.show_newest();
        self.journal.check(self.clock.now())?;
        self.queue_marks();
        self.send_marks()
    }

    /// Passes the newest bytes of both cameras to the sink, if it asks for them.
    fn show_newest(&mut self) {
        let Some(most) = self.journal.wants_newest() else {
            return;
        };
        for camera in CameraId::ALL {
            if let Some(bytes) = self.cameras.newest(camera, most) {
                self.journal.newest(camera, bytes);
            }
        }
    }

    /// Emits the reports of the trigger box, including those before a failure.
    fn observe_box(&mut self) -> Result<(), RunFault> {
        let mut reports = Vec::new();
        let answer = self.trigger.poll(&mut reports);
        if !reports.is_empty() {
            let t = self.clock.now();
            self.journal.emit(Record::BoxReports { t, reports })?;
        }
        match answer {
            // An event was lost, and the box continues: the alignment certificate accounts for missing events.
            Err(e @ DeviceError::State { .. }) => {
                let (t, text) = (self.clock.now(), e.to_string());
                self.journal.problem("", e);
                self.journal.note(t, text)
            }
            other => Ok(other?),
        }
    }

    fn observe_poses(&mut self) -> Result<(), RunFault> {
        let clock = self.clock.as_ref();
        let answer = self.trackers.poll(&mut self.indenter, clock);
        let buffered = self.journal.add_poses(self.trackers.fresh());
        buffered.and(answer)
    }

    /// Emits the data of both cameras, including those before a failure. A camera that needs longer for a flush delivers
    /// the rest later: see [`CameraStreams::is_flushed_to`].
    fn collect(&mut self, how: ReadMode) -> Result<(), RunFault> {
        let mut answer = Ok(());
        for camera in CameraId::ALL {
            let now = self.clock.now();
            let read = self.cameras.read(camera, how, now);
            let emitted = self.emit_chunks();
            answer = answer.and(emitted).and(read.map_err(Into::into));
        }
        answer
    }

    /// Stops one camera, and emits its remaining data and its notes.
    fn stop_camera(&mut self, camera: CameraId) -> Result<(), RunFault> {
        let (stopped, notes) = self.cameras.stop(camera);
        self.emit_chunks()?;
        for note in notes {
            let (t, text) = (self.now(), format!("{camera}: {note}"));
            self.journal.note(t, text)?;
        }
        Ok(stopped?)
    }

    /// Emits the notes of the trigger box.
    fn emit_box_notes(&mut self) -> Result<(), RunFault> {
        for note in self.trigger.take_notes() {
            let (t, text) = (self.now(), format!("trigger box: {note}"));
            self.journal.note(t, text)?;
        }
        Ok(())
    }

    fn emit_chunks(&mut self) -> Result<(), RunFault> {
        let mut answer = Ok(());
        for chunk in self.cameras.take_chunks() {
            let ordered = self.cameras.check_order(&chunk);
            if let Some(press) = self.trackers.press_mut() {
                press.count(&chunk);
            }
            self.suspender.count(&chunk);
            self.feeling.complete(&chunk);
            self.preflight.observe(&chunk);
            let timed = match self.cameras.check_time(&chunk) {
                Ok(Some(late)) => self.journal.note(chunk.host_time, late.to_string()),
                other => other.map(drop),
            };
            let emitted = self.journal.emit(Record::Chunk(chunk));
            answer = answer.and(ordered).and(timed).and(emitted);
        }
        answer
    }

    /// Queues the marks for phases that have been reached.
    fn queue_marks(&mut self) {
        let Some(press) = self.trackers.press_mut() else {
            return;
        };
        let marks = press.take_reached_marks();
        self.trigger.queue(marks, self.clock.now());
    }

    /// Sends the next mark if the line is free.
    fn send_marks(&mut self) -> Result<(), RunFault> {
        match self.trigger.send_next(self.clock.as_ref())? {
            Some(sent) => self.journal.emit(Record::MarkSent(sent)),
            None => Ok(()),
        }
    }

    /// Speed and longest duration of a motion over `distance_mm` that is not part of the plan.
    fn own_motion(&self, distance_mm: f64) -> (f64, HostDuration) {
        let can = self.indenter.capabilities().max_speed_mm_s;
        let speed = self
            .settings
            .rise_speed_mm_s
            .min(self.plan.limits.max_speed_mm_s)
            .min(can);
        let seconds = 2.0 * distance_mm / speed;
        (
            speed,
            HostDuration::from_secs_f64(seconds) + self.settings.rise_allowance,
        )
    }
}
