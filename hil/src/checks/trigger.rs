//! Checks: coded trains through both cameras.

use std::collections::BTreeSet;

use skinrig_analysis::timebase::{Wire, wire};
use skinrig_model::pulse::{MAX_MARKED_PRESS, PULSES_PER_TRAIN, decode_marks};
use skinrig_model::{
    BoxReport, CameraId, HostDuration, Label, Mark, MarkKind, PressId, RawChunk, TriggerEdge,
};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};

use crate::bench::Bench;
use crate::findings::Findings;
use crate::streams::Streams;
use crate::trouble;

const METRICS: &[&str] = &["lost_pulses", "extra_pulses", "unread_trains", "jitter"];

/// After a train the line rests for so long, at least: the box may send one of its own.
const REST: HostDuration = HostDuration::from_millis(15);
/// The cameras stream for so long before the first train, and after the last: start-up bursts, and reports on their way.
const MARGIN: HostDuration = HostDuration::from_millis(300);
/// Trains that a verdict needs: through fewer there is no line, and pulses cannot be told from noise.
const LEAST_TRAINS: u64 = 3;
/// Rising edges that the jitter needs: two trains' worth.
const LEAST_EDGES: u64 = 64;
/// What a camera's time counts in, s.
const US: f64 = 1e-6;

/// The n-th mark of a check: every one has a name of its own, and neighbours differ in many bits.
pub(super) fn mark(n: u32) -> Mark {
    /// Odd, so that the numbers of 2^17 marks are all different.
    const STRIDE: u32 = 52_361;
    Mark {
        kind: MarkKind::ALL[n as usize % MarkKind::ALL.len()],
        press: PressId::from_index(n.wrapping_mul(STRIDE) & MAX_MARKED_PRESS),
    }
}

/// Trigger edges by camera, as they come.
#[derive(Default)]
pub(super) struct Edges(pub [Vec<TriggerEdge>; 2]);

impl Edges {
    /// Takes those of `chunk`.
    pub fn see(&mut self, chunk: &RawChunk) {
        self.0[chunk.camera.index()].extend_from_slice(&chunk.triggers);
    }

    /// Those of `camera` on `channel`.
    pub fn on(&self, camera: CameraId, channel: u8) -> Vec<TriggerEdge> {
        let edges = self.0[camera.index()].iter().copied();
        edges.filter(|e| e.channel == channel).collect()
    }

    /// The other channels of `camera` that had edges.
    fn elsewhere(&self, camera: CameraId, channel: u8) -> Vec<u8> {
        let edges = self.0[camera.index()].iter().map(|e| e.channel);
        let others: BTreeSet<u8> = edges.filter(|c| *c != channel).collect();
        others.into_iter().collect()
    }
}

/// Makes the check.
pub fn trigger_loopback(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::TriggerLoopback { trains } = check.measure else {
        return;
    };
    if bench.rig().trigger_box.is_none() {
        found.not_here = Some("the rig file has no `trigger_box`".to_owned());
        return;
    }
    let channels = bench.rig().cameras.each_ref().map(|c| c.trigger_channel);
    let mut edges = Edges::default();
    let mut streams = Streams::start(bench, &mut |_, _| Ok(()));
    let see = &mut |chunk: &RawChunk| edges.see(chunk);
    streams.pass(MARGIN, see);
    let mut sent = Vec::new();
    for n in 0..trains {
        if !streams.send(mark(n), see) {
            break;
        }
        sent.push(mark(n));
        streams.pass(REST, see);
    }
    streams.pass(MARGIN, see);
    let reports = streams.reports().to_vec();
    let seen = streams.finish(found, METRICS, see);
    if reports.iter().any(|r| matches!(r, BoxReport::Reset { .. })) {
        let what = "expected the box's clock to go on, found that the box was reset";
        let subject = trouble::subject(skinrig_model::DeviceRole::TriggerBox);
        let next = "look at the box's power and its cable";
        found
            .evidence
            .push(Evidence::new(EvidenceKind::TriggerFault, subject, what).next(next));
    }
    for camera in CameraId::ALL {
        if seen[camera.index()].is_none() {
            continue;
        }
        let subject = trouble::of_camera(camera);
        if sent.len() < trains as usize {
            for metric in METRICS {
                found.unmeasured(subject, metric);
            }
            continue;
        }
        let channel = channels[camera.index()];
        let line = Line::of(&sent, &reports, &edges.on(camera, channel), channel);
        line.tell(subject, &edges.elsewhere(camera, channel), found);
    }
}

/// What came through one camera's line.
struct Line {
    sent: usize,
    unread: usize,
    lost_pulses: u64,
    extra_edges: u64,
    /// s, and the edges behind it.
    jitter: Option<(f64, u64)>,
    /// Why the pulses could only be counted, when no clock could be laid on them.
    unclocked: Option<String>,
}

impl Line {
    fn of(sent: &[Mark], reports: &[BoxReport], edges: &[TriggerEdge], channel: u8) -> Self {
        let read = decode_marks(edges);
        // In the order in which they were sent: a train that is read out of turn is not read.
        let mut turn = sent.iter();
        let read_in_turn = read
            .marks
            .iter()
            .filter(|m| turn.any(|s| *s == m.mark))
            .count();
        let unread = sent.len() - read_in_turn.min(sent.len());
        let line = Self {
            sent: sent.len(),
            unread,
            lost_pulses: 0,
            extra_edges: 0,
            jitter: None,
            unclocked: None,
        };
        match wire(reports, edges, channel) {
            Ok(wire) => Self {
                lost_pulses: lost_pulses(&wire, sent),
                extra_edges: wire.counts.doubled + wire.counts.spurious,
                jitter: wire.jitter.map(|(us, n)| (us * US, n)),
                ..line
            },
            Err(why) => Self {
                lost_pulses: unread as u64 * PULSES_PER_TRAIN,
                extra_edges: read.stray_edges,
                unclocked: Some(why),
                ..line
            },
        }
    }

    fn tell(self, subject: &str, elsewhere: &[u8], found: &mut Findings) {
        let trains = self.sent;
        for (metric, count) in [
            ("lost_pulses", self.lost_pulses),
            ("extra_pulses", self.extra_edges),
            ("unread_trains", self.unread as u64),
        ] {
            let value = found
                .value(subject, metric, count as f64)
                .of(trains, LEAST_TRAINS);
            if let Some(why) = &self.unclocked {
                value.noting(format!("only counted, not followed edge by edge: {why}"));
            }
        }
        match self.jitter {
            Some((jitter_s, n)) => {
                // Of a standard deviation from n samples, which are nearly normal.
                let half = 1.96 * jitter_s / (2.0 * n as f64).sqrt();
                let value = found.value(subject, "jitter", jitter_s);
                value.of(n as usize, LEAST_EDGES).interval =
                    Some([(jitter_s - half).max(0.0), jitter_s + half]);
            }
            None => drop(found.unmeasured(subject, "jitter")),
        }
        if self.lost_pulses + self.extra_edges + self.unread as u64 == 0 {
            return;
        }
        let mut what = format!(
            "expected {} pulses in {trains} trains, found {} of them missing, {} edges too many and {} trains unread",
            trains as u64 * PULSES_PER_TRAIN,
            self.lost_pulses,
            self.extra_edges,
            self.unread,
        );
        if !elsewhere.is_empty() {
            what += &format!("; edges on channel {elsewhere:?}");
        }
        let next =
            "check the trigger cable, its channel in the rig file, and levels (docs/bench.md)";
        found
            .evidence
            .push(Evidence::new(EvidenceKind::TriggerFault, subject, what).next(next));
    }
}

/// Pulses that did not come through whole, of the marks that were sent and of what the box sent by itself among them. A mark that
/// the box does not know of is lost as a whole.
fn lost_pulses(wire: &Wire, sent: &[Mark]) -> u64 {
    let marks: BTreeSet<Mark> = sent.iter().copied().collect();
    let is_ours = |label: Label| matches!(label, Label::Mark(m) if marks.contains(&m));
    let ours = || wire.trains.iter().filter(|t| is_ours(t.label));
    let Some(first) = ours().map(|t| t.box_us).min() else {
        return sent.len() as u64 * PULSES_PER_TRAIN;
    };
    let last = ours().map(|t| t.box_us).max().unwrap_or(first);
    let among = wire
        .trains
        .iter()
        .filter(|t| (first..=last).contains(&t.box_us));
    let unknown = marks.len().saturating_sub(ours().count()) as u64;
    among.map(|t| u64::from(t.lost_pulses)).sum::<u64>() + unknown * PULSES_PER_TRAIN
}
