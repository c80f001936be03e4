//! Suspension: a run waits at clearance height during a disturbance, and continues automatically afterwards.

use skinrig_device::DeviceError;
use skinrig_model::{CameraId, HostDuration, HostTime, InterruptionKind, RawChunk, Record};
use skinrig_protocol::{Suspend, Threshold, UnderWay};

use crate::error::{ControllerError, Halt};
use crate::executor::{Collect, Executor};
use crate::states::{Event, State};

/// Prefix of the reason of every suspension.
pub(crate) const SUSPENDED: &str = "suspended";
/// Averaging time of rates.
const WINDOW: HostDuration = HostDuration::from_millis(1_000);

/// Change of a [`Hysteresis`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transition {
    /// The value has been beyond the trip level for long enough.
    Tripped,
    /// The value has been back to normal for long enough.
    Cleared,
}

/// Hysteresis of one value: trips after it was beyond one level without interruption for some time, and clears after it was on
/// the normal side of another level without interruption for some time. Between the levels nothing changes.
#[derive(Debug, Clone)]
pub struct Hysteresis {
    threshold: Threshold,
    resume_after: HostDuration,
    tripped: bool,
    /// Since when the value has been on the side that leads to a change.
    since: Option<HostTime>,
}

impl Hysteresis {
    /// A hysteresis that has not tripped.
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

    /// Processes the value at `t`.
    pub fn feed(&mut self, t: HostTime, value: f64) -> Option<Transition> {
        let (turns, lasting, turn) = if self.tripped {
            let calm = self.threshold.is_calm(value);
            (calm, self.resume_after, Transition::Cleared)
        } else {
            let beyond = self.threshold.is_beyond(value);
            (beyond, self.threshold.lasting, Transition::Tripped)
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

/// Monitored quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Storm,
    Dark,
    Loss,
    Temperature,
    Disk,
}

impl Quantity {
    /// Name and unit.
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

/// A monitored condition.
#[derive(Debug, Clone)]
struct Condition {
    quantity: Quantity,
    hysteresis: Hysteresis,
}

/// Values measured over a window, other than those from chunks.
#[derive(Debug, Clone, Copy, Default)]
struct WindowMeasurements {
    /// °C.
    temperatures_c: [Option<f64>; 2],
    free_b: Option<f64>,
}

/// All conditions of a run, and whether one of them suspends it.
#[derive(Debug)]
pub(crate) struct Suspender {
    settings: Suspend,
    /// Event storm, darkness, loss and temperature per camera.
    cameras: [Vec<Condition>; 2],
    disk: Option<Condition>,
    window_from: Option<HostTime>,
    events: [u64; 2],
    lost: [u64; 2],
    /// Condition that tripped while the run was not running.
    pending: Option<String>,
    /// Start and reason of the current suspension.
    holding: Option<(HostTime, String)>,
}

impl Suspender {
    pub(crate) fn new(settings: Suspend) -> Self {
        let watched = |quantity, threshold: Option<Threshold>| {
            threshold.map(|t| Condition {
                quantity,
                hysteresis: Hysteresis::new(t, settings.resume_after),
            })
        };
        let of_camera = || {
            [
                watched(Quantity::Storm, settings.event_rate),
                watched(Quantity::Dark, settings.dark),
                watched(Quantity::Loss, settings.lost_bytes),
                watched(Quantity::Temperature, settings.temperature),
            ]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
        };
        Self {
            cameras: [of_camera(), of_camera()],
            disk: watched(Quantity::Disk, settings.disk_free),
            settings,
            window_from: None,
            events: [0; 2],
            lost: [0; 2],
            pending: None,
            holding: None,
        }
    }

    /// Counts the data of a camera.
    pub(crate) fn count(&mut self, chunk: &RawChunk) {
        let i = chunk.camera.index();
        self.events[i] += chunk.facts.cd_events;
        self.lost[i] += chunk.lost_before;
    }

    /// Ends the suspension because the operator paused or resumed. Returns true if there was one.
    pub(crate) fn release(&mut self) -> bool {
        self.holding.take().is_some()
    }

    /// Reason of the current suspension.
    pub(crate) fn reason(&self) -> Option<&str> {
        self.holding.as_ref().map(|(_, reason)| reason.as_str())
    }

    fn is_idle(&self) -> bool {
        self.disk.is_none() && self.cameras.iter().all(Vec::is_empty)
    }

    fn monitors_temperature(&self, camera: CameraId) -> bool {
        let watched = &self.cameras[camera.index()];
        watched.iter().any(|w| w.quantity == Quantity::Temperature)
    }

    /// Stops monitoring the temperature of a camera that cannot measure it.
    fn stop_monitoring_temperature(&mut self, camera: CameraId) {
        self.cameras[camera.index()].retain(|w| w.quantity != Quantity::Temperature);
    }

    fn is_calm(&self) -> bool {
        let mut all = self.cameras.iter().flatten().chain(&self.disk);
        !all.any(|w| w.hysteresis.is_tripped())
    }

    /// Evaluates a whole window; returns a description of the condition that tripped.
    fn evaluate(
        &mut self,
        t: HostTime,
        seconds: f64,
        measured: WindowMeasurements,
    ) -> Option<String> {
        let mut words = None;
        let mut feed = |w: &mut Condition, of: &str, value: f64| {
            if w.hysteresis.feed(t, value) == Some(Transition::Tripped) {
                let Threshold { trip, .. } = w.hysteresis.threshold;
                let side = if value > trip { "at most" } else { "at least" };
                let (what, unit) = w.quantity.words();
                words.get_or_insert_with(|| {
                    format!("{of}{what}: expected {side} {trip} {unit}, found {value:.0} {unit}")
                });
            }
        };
        for camera in CameraId::ALL {
            let i = camera.index();
            for w in &mut self.cameras[i] {
                let value = match w.quantity {
                    Quantity::Storm | Quantity::Dark => Some(self.events[i] as f64 / seconds),
                    Quantity::Loss => Some(self.lost[i] as f64 / seconds),
                    Quantity::Temperature => measured.temperatures_c[i],
                    Quantity::Disk => None,
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

impl Executor<'_> {
    /// Evaluates the conditions of the plan once per window; suspends, resumes or ends the run.
    pub(crate) fn suspend(&mut self) -> Result<(), Halt> {
        let running = matches!(
            self.machine.state(),
            State::Running | State::Pausing | State::PausingNow | State::Paused
        );
        if self.suspender.is_idle() || !running || self.ending {
            return Ok(());
        }
        let now = self.now();
        let from = *self.suspender.window_from.get_or_insert(now);
        if now - from < WINDOW {
            return Ok(());
        }
        // A chunk may take long to fill, and its data belong to this window. If it is not yet complete, the next turn tries again.
        if !self.is_flushed_to(from + WINDOW) {
            self.collect(Collect::Flush)?;
        }
        if !self.is_flushed_to(from + WINDOW) {
            return Ok(());
        }
        self.suspender.window_from = Some(now);
        let measured = WindowMeasurements {
            temperatures_c: self.temperatures(now)?,
            free_b: self.free_space(now)?,
        };
        let seconds = (now - from).as_secs_f64();
        let tripped = self.suspender.evaluate(now, seconds, measured);
        if self.machine.state() == State::Running {
            self.suspender.holding = None; // the operator resumed
        }
        // A condition that begins during another wait suspends the run once that ends.
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

    /// Reads the temperatures of the monitored cameras. No answer is a fault, as in any other call.
    fn temperatures(&mut self, t: HostTime) -> Result<[Option<f64>; 2], ControllerError> {
        let mut found = [None; 2];
        for camera in CameraId::ALL {
            if !self.suspender.monitors_temperature(camera) {
                continue;
            }
            let told = match self.cameras[camera.index()].temperature_c() {
                Err(DeviceError::Pending { .. }) => continue, // read in the next window
                other => other?,
            };
            if told.is_none() {
                self.suspender.stop_monitoring_temperature(camera);
                let text = format!(
                    "suspend.temperature: {camera} cannot measure its temperature: not monitored"
                );
                self.journal.emit(Record::Note { t, text })?;
            }
            found[camera.index()] = told;
        }
        Ok(found)
    }

    /// Free space at the session file in bytes, if monitored.
    fn free_space(&mut self, t: HostTime) -> Result<Option<f64>, ControllerError> {
        if self.suspender.disk.is_none() {
            return Ok(None);
        }
        let free_b = self.journal.free_bytes().map(|b| b as f64);
        if free_b.is_none() {
            self.suspender.disk = None;
            let text = "suspend.disk_free: the free space is unknown: not monitored";
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
