//! Progress of a run for display, derived from its records alone.

use std::collections::{BTreeMap, VecDeque};

use skinrig_model::pulse::decode_marks;
use skinrig_model::{
    CameraId, HostDuration, HostTime, PlannedPress, Point2, PressHistory, PressId, PressVerdict,
    PulseTrain, RawChunk, Record, RunEnd, TriggerEdge, Verdict,
};

use crate::touch_progress::TouchProgress;

/// Event rates are averages over this span of rig time.
const RATE_SPAN: HostDuration = HostDuration::from_millis(1_000);

/// Progress of one camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraProgress {
    /// CD events so far.
    pub events: u64,
    /// Bytes so far.
    pub bytes: u64,
    /// Bytes known to be lost so far.
    pub lost_bytes: u64,
    /// CD events per second of rig time over about the last second; `None` with fewer than two chunks.
    pub events_per_s: Option<f64>,
    /// Complete marks received on the trigger input.
    pub marks_seen: u64,
}

/// Progress of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Progress {
    /// Presses of the plan.
    pub planned: usize,
    /// Presses that have ended, including missed ones.
    pub done: usize,
    /// Valid presses.
    pub valid: usize,
    /// Invalid presses.
    pub invalid: usize,
    /// Missed presses.
    pub missed: usize,
    /// Presses excluded by a rule.
    pub excluded: usize,
    /// Attempts beyond the first at a press, in this process.
    pub retaken: usize,
    /// The current press, or the last one.
    pub press: Option<PlannedPress>,
    /// Measured position of the tip on the skin, and its height in mm.
    pub tip: Option<(Point2, f64)>,
    /// Progress of both cameras.
    pub cameras: [CameraProgress; 2],
    /// Marks that the trigger box sent.
    pub marks_sent: u64,
    /// Rig time since the first record with a time.
    pub elapsed: HostDuration,
    /// Expected remaining rig time; `None` without an expected duration or after the end.
    pub eta: Option<HostDuration>,
    /// What was felt; `None` until the run feels touches.
    pub touch: Option<TouchProgress>,
    /// True between a pause and its end.
    pub paused: bool,
    /// End of the run, if it has ended.
    pub end: Option<RunEnd>,
}

/// Tracks the progress of a run from its records.
#[derive(Debug, Clone, Default)]
pub struct ProgressTracker {
    progress: Progress,
    presses: Vec<PlannedPress>,
    /// Last verdict of each press, if any.
    verdicts: Vec<Option<Verdict>>,
    /// Presses that ended before this process and are not repeated.
    before: usize,
    expected: Option<HostDuration>,
    first: Option<HostTime>,
    chunks: [VecDeque<(HostTime, u64)>; 2],
    edges: [BTreeMap<u8, Vec<TriggerEdge>>; 2],
}

impl ProgressTracker {
    /// A tracker for a plan with the expected duration `expected` in rig time.
    #[must_use]
    pub fn new(expected: Option<HostDuration>) -> Self {
        Self {
            expected,
            ..Self::default()
        }
    }

    /// Continues a session with these press histories, of which the `pending` ones remain to be done.
    #[must_use]
    pub fn resumed(
        mut self,
        presses: &[PlannedPress],
        histories: &[PressHistory],
        pending: &[bool],
    ) -> Self {
        self.plan(presses);
        for ((last, history), pending) in self.verdicts.iter_mut().zip(histories).zip(pending) {
            *last = match &history.verdict {
                _ if *pending => None,
                Some(PressVerdict::Missed(_)) | None => None,
                Some(verdict) => Some(verdict.kind()),
            };
        }
        self.count();
        self.before = self.progress.done;
        self
    }

    fn plan(&mut self, presses: &[PlannedPress]) {
        self.presses = presses.to_vec();
        self.verdicts = vec![None; presses.len()];
        self.progress.planned = presses.len();
    }

    fn ended(&mut self, press: PressId, verdict: Verdict) {
        if let Some(f) = self.verdicts.get_mut(press.index() as usize) {
            *f = Some(verdict);
        }
        self.count();
    }

    fn count(&mut self) {
        let n = |verdict| {
            self.verdicts
                .iter()
                .filter(|f| **f == Some(verdict))
                .count()
        };
        let p = &mut self.progress;
        (p.valid, p.invalid) = (n(Verdict::Valid), n(Verdict::Invalid));
        (p.missed, p.excluded) = (n(Verdict::Missed), n(Verdict::Excluded));
        p.done = p.valid + p.invalid + p.missed + p.excluded;
    }

    /// Progress after the last record.
    #[must_use]
    pub const fn progress(&self) -> &Progress {
        &self.progress
    }

    /// Processes the next record.
    pub fn update(&mut self, record: &Record) -> &Progress {
        let p = &mut self.progress;
        match record {
            Record::Started(header) => self.plan(&header.presses),
            Record::Intent { attempt, t } => {
                let known = self.verdicts.get(attempt.press.index() as usize);
                p.retaken += usize::from(known.is_some_and(Option::is_some));
                p.press = self.presses.get(attempt.press.index() as usize).copied();
                if let (Some(touch), Some(press)) = (&mut p.touch, p.press) {
                    touch.attempt(press.role);
                }
                self.reached(*t);
            }
            Record::Poses(block) => {
                if let Some(last) = block.last() {
                    p.tip = Some((last.measured.plane(), last.measured.z_mm));
                    self.reached(last.t);
                }
            }
            Record::MarkSent(sent) => {
                p.marks_sent += 1;
                self.reached(sent.t);
            }
            Record::BoxReports { t, .. } => self.reached(*t),
            Record::Chunk(chunk) => self.chunk(chunk),
            Record::Outcome(outcome) => {
                self.ended(outcome.attempt.press, outcome.verdict.kind());
            }
            Record::Missed(attempt, _) => self.ended(attempt.press, Verdict::Missed),
            Record::Interruption { kind, t, .. } => {
                use skinrig_model::InterruptionKind as K;
                p.paused = matches!(kind, K::Pause | K::PauseNow);
                self.reached(*t);
            }
            Record::Ended { t, end } => {
                p.end = Some(end.clone());
                self.reached(*t);
                self.progress.eta = None;
            }
            Record::Preflight(_) | Record::Resumed(_) => {}
            Record::Command { t, .. } | Record::Note { t, .. } => self.reached(*t),
            Record::Touch(estimate) => {
                TouchProgress::add(&mut p.touch, *estimate);
                self.reached(estimate.t);
            }
            Record::Device { .. } | Record::Notification(_) => {}
        }
        &self.progress
    }

    fn reached(&mut self, t: HostTime) {
        let first = *self.first.get_or_insert(t);
        let p = &mut self.progress;
        p.elapsed = p.elapsed.max(t - first);
        p.eta = remaining(p, self.before, self.expected).filter(|_| p.end.is_none());
    }

    fn chunk(&mut self, chunk: &RawChunk) {
        let i = chunk.camera.index();
        let camera = &mut self.progress.cameras[i];
        camera.events += chunk.facts.cd_events;
        camera.bytes += chunk.bytes.len() as u64;
        camera.lost_bytes += chunk.lost_before;

        let recent = &mut self.chunks[i];
        recent.push_back((chunk.host_time, chunk.facts.cd_events));
        // Keep one chunk before the span: the events of the others came after it.
        while recent
            .get(1)
            .is_some_and(|(t, _)| chunk.host_time - *t >= RATE_SPAN)
        {
            recent.pop_front();
        }
        let oldest = recent.front().map_or(chunk.host_time, |(t, _)| *t);
        let span = (chunk.host_time - oldest).as_secs_f64();
        if span > 0.0 {
            let events: u64 = recent.iter().skip(1).map(|(_, n)| n).sum();
            camera.events_per_s = Some(events as f64 / span);
        }

        for edge in &chunk.triggers {
            self.edges[i].entry(edge.channel).or_default().push(*edge);
        }
        let decoded: u64 = self.edges[i].values_mut().map(take_marks).sum();
        self.progress.cameras[i].marks_seen += decoded;
        self.reached(chunk.host_time);
    }

    /// Press number (from 1) and total, for example `12/2500`.
    #[must_use]
    pub fn press_label(&self) -> String {
        let at = self.progress.press.map_or(0, |p| p.id.number());
        format!("{at}/{}", self.progress.planned)
    }

    /// CD events per second of `camera`; see [`CameraProgress::events_per_s`].
    #[must_use]
    pub fn events_per_s(&self, camera: CameraId) -> Option<f64> {
        self.progress.cameras[camera.index()].events_per_s
    }
}

/// Expected remaining time: from the plan at first, then increasingly from the pace of finished presses.
fn remaining(p: &Progress, before: usize, expected: Option<HostDuration>) -> Option<HostDuration> {
    let planned = HostDuration((expected?.0 - p.elapsed.0).max(0));
    let (done, of) = (p.done - before.min(p.done), p.planned - before);
    if done == 0 || of == 0 {
        return Some(planned);
    }
    let share = done as f64 / of as f64;
    let pace = p.elapsed.as_secs_f64() * (1.0 - share) / share;
    Some(HostDuration::from_secs_f64(
        share * pace + (1.0 - share) * planned.as_secs_f64(),
    ))
}

/// Decodes the trains at the front of a channel's edges and counts the marks.
fn take_marks(edges: &mut Vec<TriggerEdge>) -> u64 {
    let Some(newest) = edges.last().map(|e| e.t_us) else {
        return 0;
    };
    let decoded = decode_marks(edges);
    let marks = decoded.marks.iter().map(|m| m.t_us);
    let read = marks.chain(decoded.syncs.iter().map(|s| s.t_us)).max();
    // Edges older than a train that remain undecoded never will be.
    let done = read
        .map_or(0, |t| t + PulseTrain::DURATION_US)
        .max(newest.saturating_sub(2 * PulseTrain::DURATION_US));
    edges.retain(|e| e.t_us >= done);
    decoded.marks.len() as u64
}
