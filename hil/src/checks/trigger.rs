//! Checks: coded trains through both cameras.

use std::collections::BTreeSet;

use skinrig_analysis::timebase::{Wire, WireTrain, wire};
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
    let reports = among(streams.reports(), &sent);
    let told_of_all = streams.box_was_heard_well() && !skips(&reports);
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
        // Of a train that the box's reports leave out nothing says whether it was lost or nobody sent it.
        if sent.len() < trains as usize || !told_of_all {
            for metric in METRICS {
                let value = found.unmeasured(subject, metric);
                if !told_of_all {
                    value.noting("the box did not tell of every train that it sent");
                }
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
        let next = "check the trigger cable, its channel in the rig file, and levels (docs/how-to/bench.md)";
        found
            .evidence
            .push(Evidence::new(EvidenceKind::TriggerFault, subject, what).next(next));
    }
}

/// The reports without the trains before the first of the marks that were sent, and without those after the last: the cameras may have
/// seen a part of these only.
fn among(reports: &[BoxReport], sent: &[Mark]) -> Vec<BoxReport> {
    let is_ours = |r: &BoxReport| matches!(r, BoxReport::Mark { mark, .. } if sent.contains(mark));
    let (first, last) = (
        reports.iter().position(is_ours),
        reports.iter().rposition(is_ours),
    );
    let within = |k: usize| first.is_some_and(|f| f <= k) && last.is_some_and(|l| k <= l);
    let is_train = |r: &BoxReport| matches!(r, BoxReport::Mark { .. } | BoxReport::Sync { .. });
    let kept = reports
        .iter()
        .enumerate()
        .filter(|(k, r)| within(*k) || !is_train(r));
    kept.map(|(_, r)| *r).collect()
}

/// Whether sync trains, which the box counts, are missing among `reports`.
fn skips(reports: &[BoxReport]) -> bool {
    let counts = reports.iter().filter_map(|r| match r {
        BoxReport::Sync { count, .. } => Some(*count),
        _ => None,
    });
    let counts: Vec<u32> = counts.collect();
    counts
        .windows(2)
        .any(|c| c[1] != (c[0] + 1) & MAX_MARKED_PRESS)
}

/// Pulses that did not come through whole. A mark that the box does not know of is lost as a whole.
fn lost_pulses(wire: &Wire, sent: &[Mark]) -> u64 {
    let is_ours = |t: &&WireTrain| matches!(t.label, Label::Mark(m) if sent.contains(&m));
    let known = wire.trains.iter().filter(is_ours).count();
    let unknown = sent.len().saturating_sub(known) as u64;
    let trains = wire.trains.iter();
    trains.map(|t| u64::from(t.lost_pulses)).sum::<u64>() + unknown * PULSES_PER_TRAIN
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::BoxTime;

    #[test]
    fn trains_between_the_first_mark_and_the_last_count_and_a_hole_among_them_shows() {
        let sync = |count, us| BoxReport::Sync {
            count,
            at: BoxTime { us },
        };
        let marked = |n, us| BoxReport::Mark {
            mark: mark(n),
            at: BoxTime { us },
        };
        let sent = [mark(0), mark(1)];
        let mut reports = vec![sync(MAX_MARKED_PRESS - 3, 0), marked(0, 1), marked(7, 2)];
        reports.extend([
            sync(MAX_MARKED_PRESS, 3),
            sync(0, 4),
            marked(1, 5),
            sync(8, 6),
        ]);
        let within = among(&reports, &sent);
        assert_eq!(within, reports[1..6]);
        assert!(!skips(&within));
        assert!(skips(&reports));
        let reset = BoxReport::Reset {
            noticed: skinrig_model::HostTime(9),
        };
        reports.push(reset);
        assert_eq!(among(&reports, &sent).last(), Some(&reset));
        assert_eq!(among(&reports[..1], &sent), []);
    }
}
