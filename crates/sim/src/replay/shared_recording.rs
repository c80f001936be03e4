//! The recording with its reading positions and the replayed clock, shared by the replayed devices.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use skinrig_device::{Clock, DeviceError};
use skinrig_model::{
    BoxReport, CameraId, DeviceIdentity, DeviceRole, HostDuration, HostTime, MotionCommand,
    PoseSample, RawChunk, RigidTransform, Robot, SentMark, Setting, Skin,
};

use super::recording::{Recording, RecordingError};
use skinrig_device::limits::millimetres;

/// Time after its last pose at which a recording ends. Shorter than any controller waits for a pose (0.1 s), longer than its ticks.
const LONGEST_GAP: HostDuration = HostDuration::from_millis(50);

/// Reading positions in a recording.
pub(super) struct Reader {
    recording: Box<dyn Recording>,
    now: HostTime,
    command: Option<(HostTime, MotionCommand)>,
    commands_read: u64,
    poses: VecDeque<PoseSample>,
    last_pose: Option<HostTime>,
    mark: Option<SentMark>,
    marks_read: u64,
    /// The next report of the trigger box, once read.
    report: Option<Option<(HostTime, BoxReport)>>,
    chunks: [Option<RawChunk>; 2],
    chunks_read: [bool; 2],
    /// Failed read of the next command; reported at the next request.
    failure: Option<RecordingError>,
}

/// A shared handle of the recording.
#[derive(Clone)]
pub(crate) struct SharedRecording {
    reader: Arc<Mutex<Reader>>,
    skin_from_robot: RigidTransform<Skin, Robot>,
}

impl SharedRecording {
    /// At the start of `recording`.
    #[must_use]
    pub(crate) fn new(
        recording: Box<dyn Recording>,
        skin_from_robot: RigidTransform<Skin, Robot>,
    ) -> Self {
        let mut reader = Reader {
            recording,
            now: HostTime::ZERO,
            command: None,
            commands_read: 0,
            poses: VecDeque::new(),
            last_pose: None,
            mark: None,
            marks_read: 0,
            report: None,
            chunks: [None, None],
            chunks_read: [false; 2],
            failure: None,
        };
        reader.read_command();
        match reader.recording.next_mark() {
            Ok(mark) => reader.mark = mark,
            Err(e) => reader.failure = Some(e),
        }
        Self {
            reader: Arc::new(Mutex::new(reader)),
            skin_from_robot,
        }
    }

    /// Transform from robot to skin coordinates.
    #[must_use]
    pub(crate) const fn skin_from_robot(&self) -> RigidTransform<Skin, Robot> {
        self.skin_from_robot
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Reader> {
        self.reader.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Reader {
    fn read_command(&mut self) {
        match self.recording.next_command() {
            Ok(command) => self.command = command,
            Err(e) => {
                self.command = None;
                self.failure = Some(e);
            }
        }
    }

    pub(super) fn identity(&self, role: DeviceRole) -> DeviceIdentity {
        let recorded = self.recording.identity(role);
        let of = |what: &str| format!("replayed {what}");
        match recorded {
            Some(id) => DeviceIdentity {
                model: of(&id.model),
                ..id
            },
            None => DeviceIdentity {
                model: of("device that the recording does not name"),
                serial: "none".to_owned(),
                firmware: "none".to_owned(),
            },
        }
    }

    pub(super) fn settings(&self, role: DeviceRole) -> Vec<Setting> {
        self.recording.settings(role)
    }

    fn lost(&self, role: DeviceRole, error: &RecordingError) -> DeviceError {
        DeviceError::Lost {
            role,
            serial: self.identity(role).serial,
            detail: error.to_string(),
        }
    }

    /// The recorded run ended: no request can be served.
    pub(super) fn ended(&self, role: DeviceRole) -> DeviceError {
        DeviceError::Lost {
            role,
            serial: self.identity(role).serial,
            detail: format!(
                "the recording ends here, at {}; expected no further request",
                self.now
            ),
        }
    }

    pub(super) fn check(&self, role: DeviceRole) -> Result<(), DeviceError> {
        match &self.failure {
            None => Ok(()),
            Some(e) => Err(self.lost(role, e)),
        }
    }

    pub(super) const fn now(&self) -> HostTime {
        self.now
    }

    /// Advances to `t`, or only to the time of the next command before it.
    fn wait_until(&mut self, t: HostTime) {
        let stop = match self.command {
            Some((at, _)) if self.now < at && at < t => at,
            _ => t,
        };
        self.now = self.now.max(stop);
    }

    /// Compares with the next recorded command and sets the clock to its time.
    pub(super) fn take_command(&mut self, found: MotionCommand) -> Result<(), DeviceError> {
        self.check(DeviceRole::Indenter)?;
        let at = format!("command {}", self.commands_read);
        let show = |c: &MotionCommand| {
            format!(
                "a move to {} mm at {:.3} mm/s",
                millimetres(c.target.to_array()),
                c.speed_mm_s
            )
        };
        let Some((t, recorded)) = self.command else {
            return Err(self.ended(DeviceRole::Indenter));
        };
        // Nanometres: the round trip through the robot's frame.
        let same = recorded.target.distance_mm(found.target) <= 1e-6
            && (recorded.speed_mm_s - found.speed_mm_s).abs() <= 1e-9;
        if !same {
            return Err(DeviceError::Diverged {
                role: DeviceRole::Indenter,
                at: format!("{at} at {t}"),
                expected: show(&recorded),
                found: show(&found),
            });
        }
        self.now = self.now.max(t);
        self.commands_read += 1;
        self.read_command();
        Ok(())
    }

    /// Appends the poses up to now.
    pub(super) fn take_poses(&mut self, out: &mut Vec<PoseSample>) -> Result<(), DeviceError> {
        loop {
            while let Some(pose) = self.poses.front().filter(|p| p.t <= self.now) {
                self.last_pose = Some(pose.t);
                out.push(*pose);
                self.poses.pop_front();
            }
            if !self.poses.is_empty() {
                return Ok(());
            }
            match self.recording.next_poses() {
                Ok(Some(block)) => self.poses.extend(block),
                Ok(None) => {
                    return match self.last_pose {
                        Some(t) if self.now > t + LONGEST_GAP => {
                            Err(self.ended(DeviceRole::Indenter))
                        }
                        _ => Ok(()),
                    };
                }
                Err(e) => return Err(self.lost(DeviceRole::Indenter, &e)),
            }
        }
    }

    pub(super) const fn next_mark(&self) -> Option<SentMark> {
        self.mark
    }

    pub(super) const fn marks_read(&self) -> u64 {
        self.marks_read
    }

    pub(super) fn pass_mark(&mut self) {
        self.marks_read += 1;
        match self.recording.next_mark() {
            Ok(mark) => self.mark = mark,
            Err(e) => {
                self.mark = None;
                self.failure = Some(e);
            }
        }
    }

    /// Appends the trigger box reports up to now.
    pub(super) fn take_reports(&mut self, out: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        loop {
            let next = match self.report.take() {
                Some(next) => next,
                None => match self.recording.next_box_report() {
                    Ok(next) => next,
                    Err(e) => return Err(self.lost(DeviceRole::TriggerBox, &e)),
                },
            };
            match next {
                Some((t, report)) if t <= self.now => out.push(report),
                later => {
                    self.report = Some(later);
                    return Ok(());
                }
            }
        }
    }

    /// Appends the chunks up to now; all remaining ones if `rest` and no command is left.
    pub(super) fn take_chunks(
        &mut self,
        camera: CameraId,
        rest: bool,
        out: &mut Vec<RawChunk>,
    ) -> Result<(), DeviceError> {
        let all = rest && self.command.is_none();
        let k = camera.index();
        loop {
            if !self.chunks_read[k] {
                match self.recording.next_chunk(camera) {
                    Ok(chunk) => self.chunks[k] = chunk,
                    Err(e) => return Err(self.lost(DeviceRole::of_camera(camera), &e)),
                }
                self.chunks_read[k] = true;
            }
            match self.chunks[k].take_if(|c| all || c.host_time <= self.now) {
                Some(chunk) => {
                    out.push(chunk);
                    self.chunks_read[k] = false;
                }
                None => return Ok(()),
            }
        }
    }
}

/// The clock of a replayed rig.
pub(crate) struct ReplayClock {
    recording: SharedRecording,
}

impl ReplayClock {
    /// The clock of `recording`.
    #[must_use]
    pub(crate) const fn new(recording: SharedRecording) -> Self {
        Self { recording }
    }
}

impl Clock for ReplayClock {
    fn now(&self) -> HostTime {
        self.recording.lock().now()
    }

    /// Returns early, once, at the time of a recorded command.
    fn wait_until(&mut self, t: HostTime) {
        self.recording.lock().wait_until(t);
    }
}
