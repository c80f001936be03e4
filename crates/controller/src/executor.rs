//! Shared state of a run, and the loop that polls the devices.
//!
//! Every stage of a run needs devices, clock, journal and state machine together, so they live in one struct. Each stage adds its
//! methods in its own file: `arming` (power on), `checks` (preflight), `steps`, `press` and `touch` (the plan), `surface` (surface
//! checks), `continuity` (camera streams), `suspend` (waiting), and `ending` (return to rest).

use std::collections::VecDeque;

use skinrig_device::{CameraSettings, Clock, DeviceError, EventCamera, Rig, TriggerBox};
use skinrig_model::{
    AttemptId, CameraId, HostDuration, HostTime, InterruptionKind, Mark, MarkKind, MotionCommand,
    Point3, PoseSample, PreflightCheck, RawChunk, Record, RigidTransform, Robot, RunHeader, Skin,
};
use skinrig_protocol::plan::Plan;

use crate::checks::{Preflight, StreamProbe};
use crate::continuity::Continuity;
use crate::control::{ControlHandle, Request};
use crate::error::{ControllerError, Halt};
use crate::guard::GuardedIndenter;
use crate::invalid_run::InvalidRun;
use crate::journal::Journal;
use crate::machine::Machine;
use crate::press_fault::PressFault;
use crate::press_tracker::{PressTracker, Settling};
use crate::run::{Resume, RunReport};
use crate::settings::ControllerSettings;
use crate::sink::RecordSink;
use crate::states::{Event, State};
use crate::suspend::Suspender;
use crate::touch::TouchDetector;

/// The press in progress.
pub(crate) struct OpenPress {
    pub(crate) attempt: AttemptId,
    pub(crate) tracker: Option<PressTracker>,
    pub(crate) marks: Vec<MarkKind>,
    pub(crate) lost: [u64; 2],
    pub(crate) bytes: [u64; 2],
    pub(crate) events: [u64; 2],
    /// Time of its intent.
    pub(crate) began: HostTime,
    /// Faults of its data other than lost bytes.
    pub(crate) data_faults: Vec<PressFault>,
}

/// Shared state of a run. Dropping it before the end of the run brings the rig to rest.
pub(crate) struct Executor<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) settings: ControllerSettings,
    pub(crate) header: Option<Box<RunHeader>>,
    /// Set in a further leg of a session.
    pub(crate) resume: Option<Resume>,
    /// Number of immediate retakes so far.
    pub(crate) retaken: u32,
    pub(crate) robot_from_skin: RigidTransform<Robot, Skin>,
    pub(crate) indenter: GuardedIndenter<'static>,
    pub(crate) cameras: [Box<dyn EventCamera>; 2],
    pub(crate) camera_settings: [CameraSettings; 2],
    pub(crate) trigger_box: Option<Box<dyn TriggerBox>>,
    pub(crate) clock: Box<dyn Clock>,
    pub(crate) control: ControlHandle,
    pub(crate) journal: Journal<'a>,
    pub(crate) machine: Machine,
    pub(crate) report: Option<RunReport>,
    /// Start of the current repetition or sync block, delayed by pauses.
    pub(crate) begin: HostTime,
    pub(crate) open: Option<OpenPress>,
    pub(crate) settling: Option<Settling>,
    /// The surface search in progress.
    pub(crate) touch: Option<TouchDetector>,
    pub(crate) invalid_run: InvalidRun,
    /// Faults of each attempt so far.
    pub(crate) press_faults: Vec<(AttemptId, PressFault)>,
    /// Checks before arming; `None` for a run without preflight.
    pub(crate) preflight: Option<Preflight>,
    pub(crate) checks: Vec<PreflightCheck>,
    /// Data from the cameras while the preflight checks them.
    pub(crate) watch: Option<StreamProbe>,
    pub(crate) suspender: Suspender,
    /// True during the end of the run: failing cameras or a failing trigger box no longer interrupt it.
    pub(crate) ending: bool,
    /// True while a motion is in progress that `pause_now` may interrupt.
    pub(crate) breakable: bool,
    /// Time at which the operator's halt was received.
    pub(crate) halted_at: Option<HostTime>,
    marks: VecDeque<Mark>,
    marks_since: HostTime,
    line_free_at: HostTime,
    sink_checked: HostTime,
    next_seq: [Option<u64>; 2],
    pub(crate) continuity: [Continuity; 2],
    poses: Vec<PoseSample>,
    fresh: Vec<PoseSample>,
    chunks: Vec<RawChunk>,
}

impl<'a> Executor<'a> {
    pub(crate) fn new(
        plan: &'a Plan,
        header: RunHeader,
        rig: Rig,
        control: &ControlHandle,
        sink: &'a mut dyn RecordSink,
        settings: ControllerSettings,
    ) -> Self {
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
            header: Some(Box::new(header)),
            resume: None,
            retaken: 0,
            robot_from_skin,
            indenter: GuardedIndenter::new(indenter, robot_from_skin, plan.limits, &settings)
                .with_surroundings(plan.surroundings.clone()),
            cameras,
            camera_settings,
            trigger_box,
            clock,
            control: control.clone(),
            journal: Journal::new(sink, plan.presses.len()),
            machine: Machine::new(control.clone()),
            report: None,
            begin: HostTime::ZERO,
            open: None,
            settling: None,
            touch: None,
            invalid_run: InvalidRun::new(plan.max_consecutive_invalid),
            press_faults: Vec::new(),
            preflight: None,
            checks: Vec::new(),
            watch: None,
            suspender: Suspender::new(plan.suspend),
            ending: false,
            breakable: false,
            halted_at: None,
            marks: VecDeque::new(),
            marks_since: HostTime::ZERO,
            line_free_at: HostTime::ZERO,
            sink_checked: HostTime::ZERO,
            next_seq: [None; 2],
            continuity: [Continuity::default(); 2],
            poses: Vec::new(),
            fresh: Vec::new(),
            chunks: Vec::new(),
        }
    }

    pub(crate) fn now(&self) -> HostTime {
        self.clock.now()
    }

    /// Commands a straight motion; returns the time after the indenter accepted it.
    pub(crate) fn command(
        &mut self,
        target: Point3<Skin>,
        speed_mm_s: f64,
    ) -> Result<HostTime, ControllerError> {
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
    pub(crate) fn tick(&mut self, due: Option<HostTime>) -> Result<(), Halt> {
        let now = self.now();
        let mut until = now + self.settings.tick;
        let line = (!self.marks.is_empty()).then_some(self.line_free_at);
        for t in [due, line].into_iter().flatten() {
            if t > now && t < until {
                until = t;
            }
        }
        self.clock.wait_until(until);
        self.observe()?;
        self.suspend()?;
        self.handle_requests()
    }

    /// Polls every device without waiting.
    pub(crate) fn observe(&mut self) -> Result<(), ControllerError> {
        let poses = self.observe_poses();
        let cameras = self.collect(Collect::Poll);
        let line = self.observe_box();
        if self.ending {
            for e in [cameras, line].into_iter().filter_map(Result::err) {
                self.journal.problem("", e);
            }
            return poses;
        }
        poses.and(cameras).and(line)?;
        self.check_sink()?;
        self.queue_marks();
        self.send_marks()
    }

    /// Regularly checks that the records are still where they were written.
    fn check_sink(&mut self) -> Result<(), ControllerError> {
        let now = self.now();
        if now - self.sink_checked < self.settings.check_sink_every {
            return Ok(());
        }
        self.sink_checked = now;
        self.journal.check()
    }

    /// Emits the reports of the trigger box, including those before a failure.
    fn observe_box(&mut self) -> Result<(), ControllerError> {
        let Some(trigger) = &mut self.trigger_box else {
            return Ok(());
        };
        let mut reports = Vec::new();
        let answer = trigger.poll(&mut reports);
        if !reports.is_empty() {
            let t = self.clock.now();
            self.journal.emit(Record::BoxReports { t, reports })?;
        }
        match answer {
            // An event was lost, and the box continues: the alignment certificate accounts for missing events.
            Err(e @ DeviceError::State { .. }) => {
                let (t, text) = (self.clock.now(), e.to_string());
                self.journal.problem("", e);
                self.journal.emit(Record::Note { t, text })
            }
            other => Ok(other?),
        }
    }

    fn observe_poses(&mut self) -> Result<(), ControllerError> {
        let mut fresh = std::mem::take(&mut self.fresh);
        fresh.clear();
        let answer = self.indenter.poll(self.clock.as_ref(), &mut fresh);
        for sample in &fresh {
            if let Some(tracker) = self.open.as_mut().and_then(|o| o.tracker.as_mut()) {
                tracker.feed(sample);
            }
            if let Some(touch) = &mut self.touch {
                touch.feed(sample);
            }
            if let Some(settling) = &mut self.settling {
                settling.feed(sample);
            }
        }
        self.poses.extend_from_slice(&fresh);
        self.fresh = fresh;
        if self.poses.len() >= self.settings.pose_block {
            self.emit_poses()?;
        }
        answer
    }

    /// Emits all buffered samples.
    pub(crate) fn emit_poses(&mut self) -> Result<(), ControllerError> {
        if self.poses.is_empty() {
            return Ok(());
        }
        let block = std::mem::take(&mut self.poses);
        self.journal.emit(Record::Poses(block))
    }

    /// Emits the data of both cameras, including those before a failure. A camera that needs longer for a flush delivers
    /// the rest later: see [`Continuity::is_flushed_to`].
    pub(crate) fn collect(&mut self, how: Collect) -> Result<(), ControllerError> {
        let mut answer = Ok(());
        for camera in CameraId::ALL {
            let now = self.clock.now();
            let device = self.cameras[camera.index()].as_mut();
            let taken = match how {
                Collect::Poll => device.poll(&mut self.chunks),
                Collect::Flush => {
                    let flushed = device.flush(&mut self.chunks);
                    self.continuity[camera.index()].flush(now, flushed)
                }
            };
            let emitted = self.emit_chunks();
            answer = answer.and(emitted).and(taken.map_err(Into::into));
        }
        answer
    }

    /// Stops one camera, and emits its remaining data and its notes.
    pub(crate) fn stop_camera(&mut self, camera: CameraId) -> Result<(), ControllerError> {
        let device = &mut self.cameras[camera.index()];
        let stopped = device.stop(&mut self.chunks);
        let mut notes = Vec::new();
        device.take_notes(&mut notes);
        self.emit_chunks()?;
        for note in notes {
            let (t, text) = (self.now(), format!("{camera}: {note}"));
            self.journal.emit(Record::Note { t, text })?;
        }
        Ok(stopped?)
    }

    /// Emits the notes of the trigger box.
    pub(crate) fn emit_box_notes(&mut self) -> Result<(), ControllerError> {
        let Some(trigger) = &mut self.trigger_box else {
            return Ok(());
        };
        for note in trigger.take_notes() {
            let (t, text) = (self.now(), format!("trigger box: {note}"));
            self.journal.emit(Record::Note { t, text })?;
        }
        Ok(())
    }

    fn emit_chunks(&mut self) -> Result<(), ControllerError> {
        let mut answer = Ok(());
        for chunk in std::mem::take(&mut self.chunks) {
            let i = chunk.camera.index();
            let due = self.next_seq[i].unwrap_or(chunk.seq);
            if chunk.seq != due {
                answer = answer.and(Err(ControllerError::ChunkOrder {
                    camera: chunk.camera,
                    expected: due,
                    found: chunk.seq,
                }));
            }
            self.next_seq[i] = Some(chunk.seq + 1);
            if let Some(open) = &mut self.open {
                open.lost[i] += chunk.lost_before;
                open.bytes[i] += chunk.bytes.len() as u64;
                open.events[i] += chunk.facts.cd_events;
            }
            self.suspender.count(&chunk);
            if let Some(watch) = &mut self.watch {
                watch.observe(&chunk);
            }
            let followed = self.follow_stream(&chunk);
            let emitted = self.journal.emit(Record::Chunk(chunk));
            answer = answer.and(followed).and(emitted);
        }
        answer
    }

    /// Queues the marks for phases that have been reached.
    fn queue_marks(&mut self) {
        let Some(open) = &mut self.open else { return };
        let Some(tracker) = &open.tracker else { return };
        let came = |kind: &MarkKind| match kind {
            MarkKind::Approach => tracker.approach().is_some(),
            MarkKind::Contact => tracker.contact().is_some(),
            MarkKind::AtDepth => tracker.at_depth().is_some(),
            MarkKind::Retract => tracker.retract().is_some(),
            MarkKind::Release => tracker.release().is_some(),
        };
        let press = open.attempt.press;
        let (now_due, later) = open.marks.iter().copied().partition(came);
        open.marks = later;
        let now_due: Vec<MarkKind> = now_due;
        if self.marks.is_empty() {
            self.marks_since = self.clock.now();
        }
        self.marks
            .extend(now_due.into_iter().map(|kind| Mark { kind, press }));
    }

    /// Sends the next mark if the line is free.
    fn send_marks(&mut self) -> Result<(), ControllerError> {
        let (Some(mark), Some(trigger)) = (self.marks.front().copied(), &mut self.trigger_box)
        else {
            return Ok(());
        };
        let now = self.clock.now();
        if now < self.line_free_at {
            return Ok(());
        }
        match trigger.send(mark) {
            Ok(sent) => {
                self.marks.pop_front();
                self.marks_since = now;
                self.line_free_at = sent.t + trigger.capabilities().train_duration;
                self.journal.emit(Record::MarkSent(sent))
            }
            // In transit: the next turn polls for the answer.
            Err(DeviceError::Pending { .. }) => Ok(()),
            // Busy: the next turn tries again.
            Err(DeviceError::State { .. })
                if now - self.marks_since < self.settings.mark_within =>
            {
                Ok(())
            }
            Err(e) => Err(e.into()),
        }
    }

    /// Reserves the trigger line until `t`.
    pub(crate) const fn hold_line(&mut self, t: HostTime) {
        self.line_free_at = t;
    }

    /// True if no mark is queued or on the line.
    pub(crate) fn line_is_free(&self) -> bool {
        self.marks.is_empty() && self.now() >= self.line_free_at
    }

    /// End of the mark on the line.
    pub(crate) const fn line_free_at(&self) -> HostTime {
        self.line_free_at
    }

    /// Handles the operator's requests.
    pub(crate) fn handle_requests(&mut self) -> Result<(), Halt> {
        self.write_notes()?;
        let asked = self.control.requests_made();
        for request in self.control.take() {
            let before = self.machine.state();
            let (event, kind, words) = match request {
                Request::Halt => return Err(Halt::Halted),
                Request::Abort => return Err(Halt::Aborted),
                Request::Stop => (Event::Stop, InterruptionKind::Stop, "operator: stop"),
                Request::PauseNow => (
                    Event::PauseNow,
                    InterruptionKind::PauseNow,
                    "operator: pause now",
                ),
                Request::Pause => (Event::Pause, InterruptionKind::Pause, "operator: pause"),
                Request::Resume => (Event::Resume, InterruptionKind::Resume, "operator: resume"),
            };
            let took_over = self.suspender.release();
            self.machine.fire(event);
            // Requests without effect are not recorded.
            if took_over || self.machine.state() != before {
                let t = self.now();
                self.journal.emit(Record::Interruption {
                    kind,
                    t,
                    reason: words.to_owned(),
                })?;
            }
        }
        self.control.acknowledge(asked);
        if self.breakable && self.machine.state() == State::PausingNow {
            self.breakable = false;
            return Err(Halt::PausedNow);
        }
        Ok(())
    }

    /// Emits the operator's notes.
    pub(crate) fn write_notes(&mut self) -> Result<(), ControllerError> {
        for text in self.control.take_notes() {
            let t = self.now();
            self.journal.emit(Record::Note { t, text })?;
            self.control.count_note();
        }
        Ok(())
    }

    /// During the end of a run: true once the operator has requested a halt. Other requests have no effect then.
    pub(crate) fn check_halt(&mut self) -> bool {
        let asked = self.control.requests_made();
        let is_halted = self.take_halt();
        self.control.acknowledge(asked);
        is_halted
    }

    fn take_halt(&mut self) -> bool {
        if self.control.is_halted() && self.halted_at.is_none() {
            self.halted_at = Some(self.now());
            self.machine.fire(Event::Halt);
        }
        self.halted_at.is_some()
    }

    /// Speed and longest duration of a motion over `distance_mm` that is not part of the plan.
    pub(crate) fn own_motion(&self, distance_mm: f64) -> (f64, HostDuration) {
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

/// How to read the cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Collect {
    /// Full chunks only.
    Poll,
    /// All data up to now.
    Flush,
}
