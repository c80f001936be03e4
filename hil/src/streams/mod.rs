//! The cameras of a bench, and its trigger box, while they stream for a check: started in order, looked at, stopped whatever
//! happens. Every wait ends.

mod seen;

use skinrig_device::{CameraSettings, DeviceError, EventCamera, SyncMode};
use skinrig_model::{BoxReport, CameraId, HostDuration, HostTime, Mark, RawChunk};
use skinrig_nightly::{Evidence, EvidenceKind};

use self::seen::Live;
use crate::bench::{Bench, Devices, Trouble};
use crate::findings::Findings;
use crate::trouble::{self, COMPUTER};

pub use self::seen::Seen;

/// From one look at the devices to the next.
const STEP: HostDuration = HostDuration::from_millis(10);
/// Bytes that do not fill a chunk are fetched this often.
const FLUSH_EVERY: HostDuration = HostDuration::from_millis(200);
/// A box that sends a train of its own is free again within this.
const LINE_WITHIN: HostDuration = HostDuration::from_millis(1_000);
/// A look that comes this much later than asked for is evidence of a computer that was held up.
const HELD_UP: HostDuration = HostDuration::from_millis(1_000);

/// The streaming devices of a bench. The cameras stop with this value.
pub struct Streams<'a> {
    devices: &'a mut Devices,
    cameras: [Live; 2],
    box_trouble: Option<Trouble>,
    box_noise: Option<Trouble>,
    /// Whether the check needs the box.
    box_matters: bool,
    reports: Vec<BoxReport>,
    chunks: Vec<RawChunk>,
    flushed_at: HostTime,
    patience: HostDuration,
    held_up: Option<Trouble>,
    measuring: bool,
    /// Whether everything is to end soon.
    stop: Box<dyn Fn() -> bool>,
}

impl<'a> Streams<'a> {
    /// Configures both cameras as for a run, lets `prepare` do the rest, and starts them, slaves before their master.
    pub fn start(
        bench: &'a mut dyn Bench,
        prepare: &mut dyn FnMut(CameraId, &mut dyn EventCamera) -> Result<(), DeviceError>,
    ) -> Self {
        let (patience, stop) = (bench.patience(), bench.stopping());
        let settings = CameraId::ALL.map(|camera| bench.camera_settings(camera));
        let devices = bench.devices();
        let now = devices.clock.now();
        let mut streams = Self {
            cameras: [Live::default(), Live::default()],
            box_trouble: match &devices.trigger_box {
                Some(Err(trouble)) => Some(trouble.clone()),
                _ => None,
            },
            devices,
            box_noise: None,
            box_matters: true,
            reports: Vec::new(),
            chunks: Vec::new(),
            flushed_at: now,
            patience,
            held_up: None,
            measuring: false,
            stop,
        };
        let is_slave = |c: &CameraId| {
            settings[c.index()]
                .as_ref()
                .is_ok_and(|s| s.sync == SyncMode::Slave)
        };
        let (slaves, others): (Vec<_>, Vec<_>) = CameraId::ALL.into_iter().partition(is_slave);
        for camera in slaves.iter().chain(&others).copied() {
            let started = match &settings[camera.index()] {
                Ok(settings) => streams.start_one(camera, settings, prepare),
                Err(trouble) => Err(trouble.clone()),
            };
            streams.cameras[camera.index()].trouble = started.err();
        }
        let now = streams.now();
        for live in &mut streams.cameras {
            live.moved_at = now;
        }
        streams.listen();
        streams.reports.clear();
        streams
    }

    fn start_one(
        &mut self,
        id: CameraId,
        settings: &CameraSettings,
        prepare: &mut dyn FnMut(CameraId, &mut dyn EventCamera) -> Result<(), DeviceError>,
    ) -> Result<(), Trouble> {
        let camera = match &mut self.devices.cameras[id.index()] {
            Ok(camera) => camera.as_mut(),
            Err(trouble) => return Err(trouble.clone()),
        };
        // An earlier check may have been cut off.
        let stopped = camera.stop(&mut self.chunks);
        self.chunks.clear();
        let told = stopped
            .and_then(|()| camera.configure(settings).map(drop))
            .and_then(|()| prepare(id, camera))
            .and_then(|()| camera.start());
        // What was noticed before says nothing about this stream.
        camera.take_notes(&mut Vec::new());
        told.map_err(|e| trouble::of(&e))
    }

    /// The present.
    #[must_use]
    pub fn now(&self) -> HostTime {
        self.devices.clock.now()
    }

    /// Whether this camera still streams.
    #[must_use]
    pub(crate) fn is_live(&self, camera: CameraId) -> bool {
        self.cameras[camera.index()].trouble.is_none()
    }

    /// What the box reported so far.
    #[must_use]
    pub fn reports(&self) -> &[BoxReport] {
        &self.reports
    }

    /// Whether everything that came from the box could be read, and the box says that it told everything.
    #[must_use]
    pub(crate) fn box_was_heard_well(&self) -> bool {
        self.box_trouble.is_none() && self.box_noise.is_none()
    }

    /// What becomes of the trigger box is no matter of this check: told here, it would excuse what is wrong with a camera.
    pub fn without_box(mut self) -> Self {
        self.box_matters = false;
        self
    }

    /// From now on what comes counts.
    pub fn begin(&mut self, see: &mut dyn FnMut(&RawChunk)) {
        self.look(true, see);
        self.measuring = true;
        self.cameras.iter_mut().for_each(Live::begin);
    }

    /// Looks at the devices for `span`, or until everything is to end, and hands each chunk to `see`.
    pub fn pass(&mut self, span: HostDuration, see: &mut dyn FnMut(&RawChunk)) {
        let end = self.now() + span;
        while self.now() < end && !(self.stop)() {
            self.step(end, see);
        }
    }

    /// Sends a mark as soon as the line is free, and looks at the devices meanwhile until its train is over. False when it was not
    /// sent: the box is of no more use ([`Self::finish`] tells why), or everything is to end.
    pub fn send(&mut self, mark: Mark, see: &mut dyn FnMut(&RawChunk)) -> bool {
        let until = self.now() + LINE_WITHIN + self.patience;
        while self.box_trouble.is_none() && !(self.stop)() {
            let Some(Ok(trigger)) = &mut self.devices.trigger_box else {
                return false;
            };
            match trigger.send(mark) {
                Ok(sent) => {
                    let over = sent.t + trigger.capabilities().train_duration;
                    while self.now() < over {
                        self.step(over, see);
                    }
                    return true;
                }
                Err(DeviceError::Pending { .. }) => self.step(self.now() + STEP, see),
                Err(DeviceError::State { .. }) if self.now() < until => self.step(until, see),
                Err(e) => self.box_trouble = Some(trouble::of(&e)),
            }
        }
        false
    }

    /// Waits until both cameras' streams go beyond the present, or are known to stand still; then stops the cameras. Everything
    /// that came in the end is counted too. Troubles go to `found`, with `metrics` unmeasured on the camera that had them.
    pub fn finish(
        mut self,
        found: &mut Findings,
        metrics: &[&'static str],
        see: &mut dyn FnMut(&RawChunk),
    ) -> [Option<Seen>; 2] {
        let end = self.now();
        while CameraId::ALL
            .iter()
            .any(|c| self.is_live(*c) && self.cameras[c.index()].moved_at <= end)
        {
            self.flushed_at = self.flushed_at.min(end - FLUSH_EVERY);
            self.step(self.now() + STEP, see);
        }
        for camera in CameraId::ALL {
            if let Ok(device) = &mut self.devices.cameras[camera.index()] {
                let stopped = device.stop(&mut self.chunks);
                let live = &mut self.cameras[camera.index()];
                device.take_notes(&mut live.seen.notes);
                if let Err(e) = stopped {
                    live.trouble.get_or_insert_with(|| trouble::of(&e));
                }
            }
            self.take(see);
        }
        if let (Some(trouble), Some(slot)) = (&self.box_trouble, &mut self.devices.trigger_box) {
            *slot = Err(trouble.clone());
        }
        let of_box = [self.box_trouble.take(), self.box_noise.take()];
        let of_box = of_box.into_iter().filter(|_| self.box_matters);
        let others = of_box.chain([self.held_up.take()]);
        found.evidence.extend(others.flatten().map(|t| *t));
        CameraId::ALL.map(|camera| {
            let live = std::mem::take(&mut self.cameras[camera.index()]);
            match live.trouble {
                None => Some(live.seen),
                Some(trouble) => {
                    if trouble.kind == EvidenceKind::DeviceLost {
                        // Only opening it again helps, and the bench does so for whoever asks next.
                        self.devices.cameras[camera.index()] = Err(trouble.clone());
                    }
                    found.trouble(*trouble, trouble::of_camera(camera), metrics);
                    None
                }
            }
        })
    }

    /// Waits for the next look, not beyond `end`, and looks.
    fn step(&mut self, end: HostTime, see: &mut dyn FnMut(&RawChunk)) {
        let due = (self.now() + STEP).min(end);
        self.devices.clock.wait_until(due);
        let now = self.now();
        let late = now - due;
        if late > HELD_UP + self.patience {
            let what = format!(
                "expected to look at the devices every {} ms, found {:.1} s without a look",
                STEP.0 / 1_000_000,
                late.as_secs_f64()
            );
            let evidence = Evidence::new(EvidenceKind::HostLate, COMPUTER, what)
                .next("see what else ran at that time (`journalctl`, backups, sleep)");
            self.held_up = Some(Box::new(evidence));
        }
        self.look(now - self.flushed_at >= FLUSH_EVERY, see);
    }

    /// Fetches what the devices have; `all` of it, or full chunks only.
    fn look(&mut self, all: bool, see: &mut dyn FnMut(&RawChunk)) {
        let now = self.now();
        if all {
            self.flushed_at = now;
        }
        for camera in CameraId::ALL {
            let i = camera.index();
            if self.cameras[i].trouble.is_some() {
                continue;
            }
            let Ok(device) = &mut self.devices.cameras[i] else {
                continue;
            };
            let fetched = match all {
                true => device.flush(&mut self.chunks),
                false => device.poll(&mut self.chunks),
            };
            self.take(see);
            let live = &mut self.cameras[i];
            let fetched = match fetched {
                Err(DeviceError::Pending { .. }) => Ok(()), // the rest comes with a later look
                other => other,
            };
            if let Err(e) = fetched {
                live.trouble = Some(trouble::of(&e));
            } else if all {
                live.trouble = live.stalled(camera, now, self.patience);
            }
        }
        self.listen();
    }

    /// Counts the chunks that came, and hands them over.
    fn take(&mut self, see: &mut dyn FnMut(&RawChunk)) {
        let now = self.devices.clock.now();
        for chunk in self.chunks.drain(..) {
            self.cameras[chunk.camera.index()].see(&chunk, now, self.measuring);
            see(&chunk);
        }
    }

    /// Fetches the box's reports.
    fn listen(&mut self) {
        let Some(Ok(trigger)) = &mut self.devices.trigger_box else {
            return;
        };
        match trigger.poll(&mut self.reports) {
            Ok(()) => {}
            Err(e @ (DeviceError::Lost { .. } | DeviceError::Silent { .. })) => {
                self.box_trouble.get_or_insert_with(|| trouble::of(&e));
            }
            // Something unreadable on its line: it goes on.
            Err(e) => {
                self.box_noise.get_or_insert_with(|| trouble::of(&e));
            }
        }
    }
}

impl Drop for Streams<'_> {
    fn drop(&mut self) {
        for camera in self.devices.cameras.iter_mut().flatten() {
            // After `finish` they are stopped; before, somebody gave up and has said why.
            let _ = camera.stop(&mut self.chunks);
        }
    }
}
