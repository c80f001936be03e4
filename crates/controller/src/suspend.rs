//! The conditions that suspend a run: each with its hysteresis, evaluated once per window.

use skinrig_model::{CameraId, HostDuration, HostTime, RawChunk, Suspension, WatchedQuantity};
use skinrig_protocol::{PressHandling, Suspend, Threshold};

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

/// A monitored condition.
#[derive(Debug, Clone)]
struct Condition {
    quantity: WatchedQuantity,
    hysteresis: Hysteresis,
}

/// Values measured over a window, other than those from chunks.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct WindowMeasurements {
    /// °C; `None` if not measured in this window.
    pub(crate) temperatures_c: [Option<f64>; 2],
    /// Free space at the session file, bytes.
    pub(crate) free_b: Option<f64>,
}

/// End of a suspension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SuspensionEnd {
    /// Every condition is back to normal.
    Calm(Suspension),
    /// The suspension has reached its limit.
    TooLong {
        /// The suspension.
        suspension: Suspension,
        /// Longest suspension.
        limit: HostDuration,
    },
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
    pending: Option<Suspension>,
    /// The current suspension and its start.
    holding: Option<(HostTime, Suspension)>,
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
                watched(WatchedQuantity::Storm, settings.event_rate),
                watched(WatchedQuantity::Dark, settings.dark),
                watched(WatchedQuantity::Loss, settings.lost_bytes),
                watched(WatchedQuantity::Temperature, settings.temperature),
            ]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
        };
        Self {
            cameras: [of_camera(), of_camera()],
            disk: watched(WatchedQuantity::Disk, settings.disk_free),
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

    /// The current suspension.
    pub(crate) fn current(&self) -> Option<Suspension> {
        self.holding.map(|(_, suspension)| suspension)
    }

    /// True if nothing is monitored.
    pub(crate) fn is_idle(&self) -> bool {
        self.disk.is_none() && self.cameras.iter().all(Vec::is_empty)
    }

    pub(crate) fn monitors_temperature(&self, camera: CameraId) -> bool {
        let watched = &self.cameras[camera.index()];
        watched
            .iter()
            .any(|w| w.quantity == WatchedQuantity::Temperature)
    }

    /// Stops monitoring the temperature of a camera that cannot measure it.
    pub(crate) fn stop_monitoring_temperature(&mut self, camera: CameraId) {
        self.cameras[camera.index()].retain(|w| w.quantity != WatchedQuantity::Temperature);
    }

    pub(crate) const fn monitors_disk(&self) -> bool {
        self.disk.is_some()
    }

    /// Stops monitoring the free space of a sink that does not report it.
    pub(crate) fn stop_monitoring_disk(&mut self) {
        self.disk = None;
    }

    /// How a suspension treats the press in progress.
    pub(crate) const fn press_under_way(&self) -> PressHandling {
        self.settings.press
    }

    /// Time up to which the data of the current window must be complete, once the window has passed.
    pub(crate) fn due_window(&mut self, now: HostTime) -> Option<HostTime> {
        let from = *self.window_from.get_or_insert(now);
        (now - from >= WINDOW).then(|| from + WINDOW)
    }

    /// Starts the next window; returns the length of the last one in seconds.
    pub(crate) fn next_window(&mut self, now: HostTime) -> f64 {
        let from = self.window_from.replace(now).unwrap_or(now);
        (now - from).as_secs_f64()
    }

    /// Evaluates a whole window. A condition that begins during another wait suspends the run once that ends.
    pub(crate) fn evaluate(&mut self, t: HostTime, seconds: f64, measured: WindowMeasurements) {
        let tripped = self.feed(t, seconds, measured);
        if tripped.is_some() {
            self.pending = tripped;
        }
        if self.is_calm() {
            self.pending = None;
        }
    }

    /// The suspension of a run that is running now. An earlier suspension is over then, because the operator resumed.
    pub(crate) fn take_pending(&mut self) -> Option<Suspension> {
        self.holding = None;
        self.pending.take()
    }

    /// Starts a suspension.
    pub(crate) fn hold(&mut self, t: HostTime, suspension: Suspension) {
        self.holding = Some((t, suspension));
    }

    /// Ends the current suspension if it is over or too long. Without `may_continue` it can only be too long.
    pub(crate) fn end(&mut self, now: HostTime, may_continue: bool) -> Option<SuspensionEnd> {
        let (since, suspension) = self.holding?;
        let limit = self.settings.give_up_after;
        if self.is_calm() && may_continue {
            self.holding = None;
            return Some(SuspensionEnd::Calm(suspension));
        }
        (now - since >= limit).then_some(SuspensionEnd::TooLong { suspension, limit })
    }

    fn is_calm(&self) -> bool {
        let mut all = self.cameras.iter().flatten().chain(&self.disk);
        !all.any(|w| w.hysteresis.is_tripped())
    }

    /// Passes the values of a window to the conditions; returns the first one that tripped.
    fn feed(
        &mut self,
        t: HostTime,
        seconds: f64,
        measured: WindowMeasurements,
    ) -> Option<Suspension> {
        let mut first = None;
        let mut feed = |w: &mut Condition, camera: Option<CameraId>, found: f64| {
            if w.hysteresis.feed(t, found) == Some(Transition::Tripped) {
                first.get_or_insert(Suspension {
                    camera,
                    quantity: w.quantity,
                    trip: w.hysteresis.threshold.trip,
                    found,
                });
            }
        };
        for camera in CameraId::ALL {
            let i = camera.index();
            for w in &mut self.cameras[i] {
                let value = match w.quantity {
                    WatchedQuantity::Storm | WatchedQuantity::Dark => {
                        Some(self.events[i] as f64 / seconds)
                    }
                    WatchedQuantity::Loss => Some(self.lost[i] as f64 / seconds),
                    WatchedQuantity::Temperature => measured.temperatures_c[i],
                    WatchedQuantity::Disk => None,
                };
                if let Some(value) = value {
                    feed(w, Some(camera), value);
                }
            }
        }
        if let (Some(disk), Some(free_b)) = (&mut self.disk, measured.free_b) {
            feed(disk, None, free_b);
        }
        (self.events, self.lost) = ([0; 2], [0; 2]);
        first
    }
}
