//! Suspension: a run waits at clearance height while something disturbs it, and goes on by itself when that is over.

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

/// One condition.
#[derive(Debug, Clone)]
struct Watched {
    what: &'static str,
    unit: &'static str,
    follow: Hysteresis,
}

/// All conditions of a run, and whether one of them holds it.
#[derive(Debug)]
pub(crate) struct Suspender {
    settings: Suspend,
    /// Storm, dark, loss: for each camera; then the disk.
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
        let watched = |what, unit, threshold: Option<Threshold>| {
            threshold.map(|t| Watched {
                what,
                unit,
                follow: Hysteresis::new(t, settings.resume_after),
            })
        };
        let of_camera = || {
            [
                watched("event rate", "ev/s", settings.event_rate),
                watched("dark scene: event rate", "ev/s", settings.dark),
                watched("lost data", "B/s", settings.lost_bytes),
            ]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
        };
        Self {
            cameras: [of_camera(), of_camera()],
            disk: watched("free space", "B", settings.disk_free),
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
        self.disk.is_none() && self.cameras[0].is_empty()
    }

    fn is_calm(&self) -> bool {
        let mut all = self.cameras.iter().flatten().chain(&self.disk);
        !all.any(|w| w.follow.is_tripped())
    }

    /// Takes a whole window; gives what tripped, in words.
    fn judge(&mut self, t: HostTime, seconds: f64, free_b: Option<f64>) -> Option<String> {
        let mut words = None;
        let mut feed = |w: &mut Watched, of: &str, value: f64| {
            if w.follow.feed(t, value) == Some(Turn::Tripped) {
                let Threshold { trip, .. } = w.follow.threshold;
                let side = if value > trip { "at most" } else { "at least" };
                words.get_or_insert_with(|| {
                    format!(
                        "{of}{}: expected {side} {trip} {unit}, found {value:.0} {unit}",
                        w.what,
                        unit = w.unit
                    )
                });
            }
        };
        for camera in CameraId::ALL {
            let i = camera.index();
            for w in &mut self.cameras[i] {
                let count = if w.unit == "B/s" {
                    self.lost[i]
                } else {
                    self.events[i]
                };
                feed(w, &format!("{camera}: "), count as f64 / seconds);
            }
        }
        if let (Some(disk), Some(free_b)) = (&mut self.disk, free_b) {
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
        // A chunk may take long to fill, and what it holds belongs to this window.
        self.collect(Collect::Flush)?;
        self.suspender.window_from = Some(now);
        let mut free_b = None;
        if self.suspender.disk.is_some() {
            free_b = self.journal.free_bytes().map(|b| b as f64);
            if free_b.is_none() {
                self.suspender.disk = None;
                let text = "suspend.disk_free: expected to know the free space, found nobody who tells it: not watched";
                self.journal.emit(Record::Note {
                    t: now,
                    text: text.to_owned(),
                })?;
            }
        }
        let tripped = self
            .suspender
            .judge(now, (now - from).as_secs_f64(), free_b);
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
