//! Suspension: a run waits at clearance height while something disturbs it, and goes on by itself when that is over.

use skinrig_device::DeviceError;
use skinrig_model::{CameraId, HostDuration, HostTime, InterruptionKind, RawChunk, Record};
use skinrig_protocol::{Suspend, Threshold, UnderWay};

use crate::core::{Collect, Core};
use crate::error::{ControllerError, Halt};
use crate::states::{Event, State};

/// How the reason of every suspension begins.
pub(crate) const SUSPENDED: &str = "suspended";
/// Over so long rates are taken.
const WINDOW: HostDuration = HostDuration::from_millis(1_000);

/// What a value did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// It has been beyond the level for long enough.
    Tripped,
    /// It has been well again for long enough.
    Cleared,
}

/// Follows one value: it trips after it was beyond one level without a break for some time, and clears after it was on the
/// calm side of another level without a break for some time. Between the levels nothing changes.
#[derive(Debug, Clone)]
pub struct Hysteresis {
    threshold: Threshold,
    resume_after: HostDuration,
    tripped: bool,
    /// Since when the value has been on the side that changes this.
    since: Option<HostTime>,
}

impl Hysteresis {
    /// One that is calm.
    #[must_use]
    pub const fn new(threshold: Threshold, resume_after: HostDuration) -> Self {
        Self {
            threshold,
            resume_after,
            tripped: false,
            since: None,
        }
    }

    /// True from a trip until it clears.
    #[must_use]
    pub const fn is_tripped(&self) -> bool {
        self.tripped
    }

    /// Takes the value at `t`.
    pub fn feed(&mut self, t: HostTime, value: f64) -> Option<Turn> {
        let (turns, lasting, turn) = if self.tripped {
            let calm = self.threshold.is_calm(value);
            (calm, self.resume_after, Turn::Cleared)
        } else {
            let beyond = self.threshold.is_beyond(value);
            (beyond, self.threshold.lasting, Turn::Tripped)
        };
        if !turns {
            self.since = None;
            return None;
        }
        let since = *self.since.get_or_insert(t);
        if t - since < lasting {
            return None;
        }
        self.tripped = !self.tripped;
        self.since = None;
        Some(turn)
    }
}

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Measure {
    Storm,
    Dark,
    Loss,
    Temperature,
    Disk,
}

impl Measure {
    /// Its name and unit.
    const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Storm => ("event rate", "ev/s"),
            Self::Dark => ("dark scene: event rate", "ev/s"),
            Self::Loss => ("lost data", "B/s"),
            Self::Temperature => ("temperature", "°C"),
            Self::Disk => ("free space", "B"),
        }
    }
}

/// One condition.
#[derive(Debug, Clone)]
struct Watched {
    measure: Measure,
    follow: Hysteresis,
}

/// What was measured over a window, besides what chunks tell.
#[derive(Debug, Clone, Copy, Default)]
struct Measured {
    /// °C.
    temperatures_c: [Option<f64>; 2],
    free_b: Option<f64>,
}

/// All conditions of a run, and whether one of them holds it.
#[derive(Debug)]
pub(crate) struct Suspender {
    settings: Suspend,
    /// Storm, dark, loss, temperature: for each camera; then the disk.
    cameras: [Vec<Watched>; 2],
    disk: Option<Watched>,
    window_from: Option<HostTime>,
    events: [u64; 2],
    lost: [u64; 2],
    /// What tripped while the run was not running.
    pending: Option<String>,
    /// The run waits because of this, since then.
    holding: Option<(HostTime, String)>,
}

impl Suspender {
    pub(crate) fn new(settings: Suspend) -> Self {
        let watched = |measure, threshold: Option<Threshold>| {
            threshold.map(|t| Watched {
                measure,
                follow: Hysteresis::new(t, settings.resume_after),
            })
        };
        let of_camera = || {
            [
                watched(Measure::Storm, settings.event_rate),
                watched(Measure::Dark, settings.dark),
                watched(Measure::Loss, settings.lost_bytes),
                watched(Measure::Temperature, settings.temperature),
            ]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
        };
        Self {
            cameras: [of_camera(), of_camera()],
            disk: watched(Measure::Disk, settings.disk_free),
            settings,
            window_from: None,
            events: [0; 2],
            lost: [0; 2],
            pending: None,
            holding: None,
        }
    }

    /// Counts what a camera delivered.
    pub(crate) fn count(&mut self, chunk: &RawChunk) {
        let i = chunk.camera.index();
        self.events[i] += chunk.facts.cd_events;
        self.lost[i] += chunk.lost_before;
    }

    /// The operator paused or went on: whether the run waits is no longer for this to say. True when it was.
    pub(crate) fn let_go(&mut self) -> bool {
        self.holding.take().is_some()
    }

    /// Why the run waits because of this.
    pub(crate) fn reason(&self) -> Option<&str> {
        self.holding.as_ref().map(|(_, reason)| reason.as_str())
    }

    fn is_asleep(&self) -> bool {
        self.disk.is_none() && self.cameras.iter().all(Vec::is_empty)
    }

    fn watches_heat(&self, camera: CameraId) -> bool {
        let watched = &self.cameras[camera.index()];
        watched.iter().any(|w| w.measure == Measure::Temperature)
    }

    /// This camera cannot tell its temperature.
    fn leave_heat(&mut self, camera: CameraId) {
        self.cameras[camera.index()].retain(|w| w.measure != Measure::Temperature);
    }

    fn is_calm(&self) -> bool {
        let mut all = self.cameras.iter().flatten().chain(&self.disk);
        !all.any(|w| w.follow.is_tripped())
    }

    /// Takes a whole window; gives what tripped, in words.
    fn judge(&mut self, t: HostTime, seconds: f64, measured: Measured) -> Option<String> {
        let mut words = None;
        let mut feed = |w: &mut Watched, of: &str, value: f64| {
            if w.follow.feed(t, value) == Some(Turn::Tripped) {
                let Threshold { trip, .. } = w.follow.threshold;
                let side = if value > trip { "at most" } else { "at least" };
                let (what, unit) = w.measure.words();
                words.get_or_insert_with(|| {
                    format!("{of}{what}: expected {side} {trip} {unit}, found {value:.0} {unit}")
                });
            }
        };
        for camera in CameraId::ALL {
            let i = camera.index();
            for w in &mut self.cameras[i] {
                let value = match w.measure {
                    Measure::Storm | Measure::Dark => Some(self.events[i] as f64 / seconds),
                    Measure::Loss => Some(self.lost[i] as f64 / seconds),
                    Measure::Temperature => measured.temperatures_c[i],
                    Measure::Disk => None,
                };
                if let Some(value) = value {
                    feed(w, &format!("{camera}: "), value);
                }
            }
        }
        if let (Some(disk), Some(free_b)) = (&mut self.disk, measured.free_b) {
            feed(disk, "", free_b);
        }
        (self.events, self.lost) = ([0; 2], [0; 2]);
        words
    }
}

impl Core<'_> {
    /// Looks at the conditions of the plan once in every window, waits, goes on, or gives up.
    pub(crate) fn suspend(&mut self) -> Result<(), Halt> {
        let running = matches!(
            self.machine.state(),
            State::Running | State::Pausing | State::PausingNow | State::Paused
        );
        if self.suspender.is_asleep() || !running || self.ending {
            return Ok(());
        }
        let now = self.now();
        let from = *self.suspender.window_from.get_or_insert(now);
        if now - from < WINDOW {
            return Ok(());
        }
        // A chunk may take long to fill, and what it holds belongs to this window. Not handed over yet: the next turn looks again.
        if !self.is_flushed_to(from + WINDOW) {
            self.collect(Collect::Flush)?;
        }
        if !self.is_flushed_to(from + WINDOW) {
            return Ok(());
        }
        self.suspender.window_from = Some(now);
        let measured = Measured {
            temperatures_c: self.temperatures(now)?,
            free_b: self.free_space(now)?,
        };
        let seconds = (now - from).as_secs_f64();
        let tripped = self.suspender.judge(now, seconds, measured);
        if self.machine.state() == State::Running {
            self.suspender.holding = None; // the operator went on
        }
        // What begins while the run waits for another reason holds it when it would go on.
        if tripped.is_some() {
            self.suspender.pending = tripped;
        }
        if self.suspender.is_calm() {
            self.suspender.pending = None;
        }
        if self.machine.state() == State::Running
            && let Some(words) = self.suspender.pending.take()
        {
            let reason = format!("{SUSPENDED}: {words}");
            let (event, kind) = match self.suspender.settings.press {
                UnderWay::Finish => (Event::Pause, InterruptionKind::Pause),
                UnderWay::BreakOff => (Event::PauseNow, InterruptionKind::PauseNow),
            };
            self.interrupt(event, kind, now, reason.clone())?;
            self.suspender.holding = Some((now, reason));
        }
        let Some((since, reason)) = &self.suspender.holding else {
            return Ok(());
        };
        let limit = self.suspender.settings.give_up_after;
        if self.suspender.is_calm() && self.machine.state() != State::PausingNow {
            let words = format!("no longer {reason}");
            self.suspender.holding = None;
            return self.interrupt(Event::Resume, InterruptionKind::Resume, now, words);
        }
        if now - *since >= limit {
            let reason = reason.clone();
            return Err(ControllerError::Suspended { reason, limit }.into());
        }
        Ok(())
    }

    /// Asks the cameras that are watched for their temperature. A camera that does not answer is a fault, as in any other call.
    fn temperatures(&mut self, t: HostTime) -> Result<[Option<f64>; 2], ControllerError> {
        let mut found = [None; 2];
        for camera in CameraId::ALL {
            if !self.suspender.watches_heat(camera) {
                continue;
            }
            let told = match self.cameras[camera.index()].temperature_c() {
                Err(DeviceError::Pending { .. }) => continue, // told in the next window
                other => other?,
            };
            if told.is_none() {
                self.suspender.leave_heat(camera);
                let text = format!(
                    "suspend.temperature: expected {camera} to tell its temperature, found one that cannot: not watched"
                );
                self.journal.emit(Record::Note { t, text })?;
            }
            found[camera.index()] = told;
        }
        Ok(found)
    }

    /// The free space where the session is written, in bytes, when it is watched.
    fn free_space(&mut self, t: HostTime) -> Result<Option<f64>, ControllerError> {
        if self.suspender.disk.is_none() {
            return Ok(None);
        }
        let free_b = self.journal.free_bytes().map(|b| b as f64);
        if free_b.is_none() {
            self.suspender.disk = None;
            let text = "suspend.disk_free: expected to know the free space, found nobody who tells it: not watched";
            self.journal.emit(Record::Note {
                t,
                text: text.to_owned(),
            })?;
        }
        Ok(free_b)
    }

    fn interrupt(
        &mut self,
        event: Event,
        kind: InterruptionKind,
        t: HostTime,
        reason: String,
    ) -> Result<(), Halt> {
        self.machine.fire(event);
        Ok(self
            .journal
            .emit(Record::Interruption { kind, t, reason })?)
    }
}
