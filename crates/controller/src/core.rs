//! The devices of a run and the loop that looks at them.

use std::collections::VecDeque;

use skinrig_device::{CameraSettings, Clock, DeviceError, EventCamera, Rig, TriggerBox};
use skinrig_model::{
    AttemptId, CameraId, HostDuration, HostTime, InterruptionKind, Mark, MarkKind, MotionCommand,
    Point3, PoseSample, PreflightCheck, RawChunk, Record, RigidTransform, Robot, RunHeader, Skin,
};
use skinrig_protocol::plan::Plan;

use crate::checks::{Preflight, Watch};
use crate::continuity::Continuity;
use crate::control::{ControlHandle, Request};
use crate::error::{ControllerError, Halt};
use crate::guard::GuardedIndenter;
use crate::invalid_run::InvalidRun;
use crate::journal::Journal;
use crate::machine::Machine;
use crate::moments::{PressTracker, Settling};
use crate::press_fault::PressFault;
use crate::run::{Resume, RunReport};
use crate::settings::ControllerSettings;
use crate::sink::RecordSink;
use crate::states::{Event, State};
use crate::suspend::Suspender;
use crate::touch::TouchDetector;

/// A press under way.
pub(crate) struct OpenPress {
    pub(crate) attempt: AttemptId,
    pub(crate) tracker: Option<PressTracker>,
    pub(crate) marks: Vec<MarkKind>,
    pub(crate) lost: [u64; 2],
    pub(crate) bytes: [u64; 2],
    pub(crate) events: [u64; 2],
    /// When its intent was made.
    pub(crate) began: HostTime,
    /// What spoilt its data, besides lost bytes.
    pub(crate) spoilt: Vec<PressFault>,
}

/// Everything that a run holds. Dropped before its end, it brings the rig to rest first.
pub(crate) struct Core<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) settings: ControllerSettings,
    pub(crate) header: Option<Box<RunHeader>>,
    /// When this is a further leg of a session.
    pub(crate) resume: Option<Resume>,
    /// Presses taken again at once so far.
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
    /// When the present repetition (or sync block) began, moved on by pauses.
    pub(crate) begin: HostTime,
    pub(crate) open: Option<OpenPress>,
    pub(crate) settling: Option<Settling>,
    /// The search for the surface under way.
    pub(crate) touch: Option<TouchDetector>,
    pub(crate) invalid_run: InvalidRun,
    /// What was wrong with each attempt so far.
    pub(crate) press_faults: Vec<(AttemptId, PressFault)>,
    /// What to check before arming; nothing when absent.
    pub(crate) preflight: Option<Preflight>,
    pub(crate) checks: Vec<PreflightCheck>,
    /// While the cameras are checked: what they deliver.
    pub(crate) watch: Option<Watch>,
    pub(crate) suspender: Suspender,
    /// While ending: cameras and the trigger box no longer stop anything.
    pub(crate) ending: bool,
    /// A motion is under way that the operator's `pause_now` breaks off.
    pub(crate) breakable: bool,
    /// When the operator's halt was heard.
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

impl<'a> Core<'a> {
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
                .within(plan.surroundings.clone()),
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

    /// Commands a straight motion and gives the instant after it was taken.
    pub(crate) fn command(
        &mut self,
        target: Point3<Skin>,
        speed_mm_s: f64,
    ) -> Result<HostTime, ControllerError> {
        // A slow consumer of records may have held up the loop: look again before moving.
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

    /// One turn of the loop: waits for at most a tick, and not beyond `due`, then looks at the devices
    /// and at the operator's requests.
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
        self.hear()
    }

    /// Looks at every device without waiting.
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

    /// Asks now and then whether what was recorded is still there.
    fn check_sink(&mut self) -> Result<(), ControllerError> {
        let now = self.now();
        if now - self.sink_checked < self.settings.check_sink_every {
            return Ok(());
        }
        self.sink_checked = now;
        self.journal.check()
    }

    /// Takes what the trigger box reported and emits it, also what came before it failed.
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
            // Something went by, and the box goes on: the alignment certificate weighs what is missing.
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

    /// Emits the samples that are still kept back.
    pub(crate) fn emit_poses(&mut self) -> Result<(), ControllerError> {
        if self.poses.is_empty() {
            return Ok(());
        }
        let block = std::mem::take(&mut self.poses);
        self.journal.emit(Record::Poses(block))
    }

    /// Takes what both cameras have and emits it, also what came before one failed. A camera that needs longer for a flush hands over
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

    /// Stops one camera and emits what it still had, and what it has to say about its stream.
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

    /// Records what the trigger box has to say about the run.
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
                watch.see(&chunk);
            }
            let followed = self.follow_stream(&chunk);
            let emitted = self.journal.emit(Record::Chunk(chunk));
            answer = answer.and(followed).and(emitted);
        }
        answer
    }

    /// Queues the marks of moments that have come.
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

    /// Sends the next mark when the line is free.
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
            // On its way: the next turn asks for the answer.
            Err(DeviceError::Pending { .. }) => Ok(()),
            // Still busy: the next turn tries again.
            Err(DeviceError::State { .. })
                if now - self.marks_since < self.settings.mark_within =>
            {
                Ok(())
            }
            Err(e) => Err(e.into()),
        }
    }

    /// The trigger line is taken until `t`.
    pub(crate) const fn hold_line(&mut self, t: HostTime) {
        self.line_free_at = t;
    }

    /// True when no mark waits and none is on the line.
    pub(crate) fn line_is_free(&self) -> bool {
        self.marks.is_empty() && self.now() >= self.line_free_at
    }

    /// When the mark on the line ends.
    pub(crate) const fn line_free_at(&self) -> HostTime {
        self.line_free_at
    }

    /// Listens to the operator.
    pub(crate) fn hear(&mut self) -> Result<(), Halt> {
        self.write_notes()?;
        let asked = self.control.asked();
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
            let took_over = self.suspender.let_go();
            self.machine.fire(event);
            // A request without effect is not told.
            if took_over || self.machine.state() != before {
                let t = self.now();
                self.journal.emit(Record::Interruption {
                    kind,
                    t,
                    reason: words.to_owned(),
                })?;
            }
        }
        self.control.hear_up_to(asked);
        if self.breakable && self.machine.state() == State::PausingNow {
            self.breakable = false;
            return Err(Halt::PausedNow);
        }
        Ok(())
    }

    /// Writes the operator's remarks.
    pub(crate) fn write_notes(&mut self) -> Result<(), ControllerError> {
        for text in self.control.take_notes() {
            let t = self.now();
            self.journal.emit(Record::Note { t, text })?;
            self.control.note_written();
        }
        Ok(())
    }

    /// While ending: true once the operator wants the motors off. Nothing else that is asked for has an effect then.
    pub(crate) fn hear_halt(&mut self) -> bool {
        let asked = self.control.asked();
        let is_halted = self.heard_halt();
        self.control.hear_up_to(asked);
        is_halted
    }

    fn heard_halt(&mut self) -> bool {
        if self.control.is_halted() && self.halted_at.is_none() {
            self.halted_at = Some(self.now());
            self.machine.fire(Event::Halt);
        }
        self.halted_at.is_some()
    }

    /// The longest time that a motion outside the plan over `distance_mm` may take, and its speed.
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

/// How to take what cameras have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Collect {
    /// Full chunks.
    Poll,
    /// Everything up to now.
    Flush,
}
