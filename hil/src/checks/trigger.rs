//! Check `trigger_loopback`: coded trains from the trigger box through both cameras.

use std::collections::BTreeSet;

use skinrig_analysis::timebase::{CameraClockError, Wire, WireTrain, wire};
use skinrig_model::pulse::{MAX_MARKED_PRESS, PULSES_PER_TRAIN, decode_marks};
use skinrig_model::{
    BoxReport, CameraId, HostDuration, Label, Mark, MarkKind, PressId, RawChunk, TriggerEdge,
};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};

use crate::bench::Bench;
use crate::device_evidence;
use crate::findings::Findings;
use crate::streams::Streams;

const METRICS: &[&str] = &["lost_pulses", "extra_pulses", "unread_trains", "jitter"];

/// Minimum pause after a train, so that the box can send a train of its own.
const PAUSE: HostDuration = HostDuration::from_millis(15);
/// Streaming time before the first train and after the last; skips start-up bursts and receives
/// late reports.
const MARGIN: HostDuration = HostDuration::from_millis(300);
/// Trains needed for a verdict: with fewer there is no fit, and pulses are indistinguishable from noise.
const MIN_TRAINS: u64 = 3;
/// Rising edges needed for the jitter, as many as two trains have.
const MIN_EDGES: u64 = 64;
/// Resolution of the camera clock, s.
const TICK_S: f64 = 1e-6;

/// The `n`-th mark of a check. All marks differ, and consecutive ones differ in many bits.
pub(super) fn mark(n: u32) -> Mark {
    /// Odd, so that 2^17 consecutive marks have different numbers.
    const STRIDE: u32 = 52_361;
    Mark {
        kind: MarkKind::ALL[n as usize % MarkKind::ALL.len()],
        press: PressId::from_index(n.wrapping_mul(STRIDE) & MAX_MARKED_PRESS),
    }
}

/// Trigger edges by camera, in order of arrival.
#[derive(Default)]
pub(super) struct Edges(pub [Vec<TriggerEdge>; 2]);

impl Edges {
    /// Adds the edges of `chunk`.
    pub(super) fn add(&mut self, chunk: &RawChunk) {
        self.0[chunk.camera.index()].extend_from_slice(&chunk.triggers);
    }

    /// Edges of `camera` on `channel`.
    pub(super) fn on_channel(&self, camera: CameraId, channel: u8) -> Vec<TriggerEdge> {
        let edges = self.0[camera.index()].iter().copied();
        edges.filter(|e| e.channel == channel).collect()
    }

    /// Other channels of `camera` with edges.
    fn other_channels(&self, camera: CameraId, channel: u8) -> Vec<u8> {
        let edges = self.0[camera.index()].iter().map(|e| e.channel);
        let others: BTreeSet<u8> = edges.filter(|c| *c != channel).collect();
        others.into_iter().collect()
    }
}

/// Runs the check.
pub(super) fn trigger_loopback(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::TriggerLoopback { trains } = check.measure else {
        return;
    };
    if bench.rig().trigger_box.is_none() {
        findings.not_applicable = Some("the rig file has no `trigger_box`".to_owned());
        return;
    }
    let channels = bench.rig().cameras.each_ref().map(|c| c.trigger_channel);
    let mut edges = Edges::default();
    let mut streams = Streams::start(bench, &mut |_, _| Ok(()));
    let on_chunk = &mut |chunk: &RawChunk| edges.add(chunk);
    streams.pass(MARGIN, on_chunk);
    let mut sent = Vec::new();
    for n in 0..trains {
        if !streams.send(mark(n), on_chunk) {
            break;
        }
        sent.push(mark(n));
        streams.pass(PAUSE, on_chunk);
    }
    streams.pass(MARGIN, on_chunk);
    streams.wait_for_reports(&sent, on_chunk);
    let reports = trim_to_marks(streams.reports(), &sent);
    let every_report_came = streams.box_reports_are_complete();
    let stats = streams.finish(findings, METRICS, on_chunk);
    let seen = CameraId::ALL.map(|c| edges.on_channel(c, channels[c.index()]));
    let reports_complete = every_report_came
        && !has_missing_syncs(&reports)
        && !has_unreported(&reports, &sent, &seen);
    if reports.iter().any(|r| matches!(r, BoxReport::Reset { .. })) {
        let what = "expected the box's clock to continue, found a reset of the box";
        let subject = device_evidence::subject(skinrig_model::DeviceRole::TriggerBox);
        let next = "check the box's power and its cable";
        findings
            .evidence
            .push(Evidence::new(EvidenceKind::TriggerFault, subject, what).next(next));
    }
    for camera in CameraId::ALL {
        if stats[camera.index()].is_none() {
            continue;
        }
        let subject = device_evidence::camera_subject(camera);
        // Without complete reports, a missing train may be lost or may never have been sent.
        if sent.len() < trains as usize || !reports_complete {
            for metric in METRICS {
                let value = findings.unmeasured(subject, metric);
                if !reports_complete {
                    value.with_note("the box did not report every train that it sent");
                }
            }
            continue;
        }
        let channel = channels[camera.index()];
        let line = LineQuality::measure(&sent, &reports, &seen[camera.index()], channel);
        line.report(subject, &edges.other_channels(camera, channel), findings);
    }
}

/// Quality of one camera's trigger line.
struct LineQuality {
    sent: usize,
    unread: usize,
    lost_pulses: u64,
    extra_edges: u64,
    /// Jitter, s, and the number of edges behind it.
    jitter: Option<(f64, u64)>,
    /// Why the camera clock could not be fitted. Pulses are then only counted, not matched.
    unfitted: Option<CameraClockError>,
}

impl LineQuality {
    fn measure(sent: &[Mark], reports: &[BoxReport], edges: &[TriggerEdge], channel: u8) -> Self {
        let read = decode_marks(edges);
        // A train decoded out of order counts as unread.
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
            unfitted: None,
        };
        match wire(reports, edges, channel) {
            Ok(wire) => Self {
                lost_pulses: lost_pulses(&wire, sent),
                extra_edges: wire.counts.doubled + wire.counts.spurious,
                jitter: wire.jitter.map(|(us, n)| (us * TICK_S, n)),
                ..line
            },
            Err(why) => Self {
                lost_pulses: unread as u64 * PULSES_PER_TRAIN,
                extra_edges: read.stray_edges,
                unfitted: Some(why),
                ..line
            },
        }
    }

    fn report(self, subject: &str, other_channels: &[u8], findings: &mut Findings) {
        let trains = self.sent;
        for (metric, count) in [
            ("lost_pulses", self.lost_pulses),
            ("extra_pulses", self.extra_edges),
            ("unread_trains", self.unread as u64),
        ] {
            let value = findings
                .value(subject, metric, count as f64)
                .with_samples(trains, MIN_TRAINS);
            if let Some(why) = &self.unfitted {
                value.with_note(format!("counted only, not matched edge by edge: {why}"));
            }
        }
        match self.jitter {
            Some((jitter_s, n)) => {
                // Standard error of a standard deviation from n nearly normal samples.
                let half = 1.96 * jitter_s / (2.0 * n as f64).sqrt();
                let value = findings.value(subject, "jitter", jitter_s);
                value.with_samples(n as usize, MIN_EDGES).interval =
                    Some([(jitter_s - half).max(0.0), jitter_s + half]);
            }
            None => drop(findings.unmeasured(subject, "jitter")),
        }
        if self.lost_pulses + self.extra_edges + self.unread as u64 == 0 {
            return;
        }
        let mut what = format!(
            "expected {} pulses in {trains} trains, found {} missing pulses, {} extra edges and {} unread trains",
            trains as u64 * PULSES_PER_TRAIN,
            self.lost_pulses,
            self.extra_edges,
            self.unread,
        );
        if !other_channels.is_empty() {
            what += &format!("; edges on channel {other_channels:?}");
        }
        let next = "check the trigger cable, its channel in the rig file, and levels (docs/how-to/bench.md)";
        findings
            .evidence
            .push(Evidence::new(EvidenceKind::TriggerFault, subject, what).next(next));
    }
}

/// `reports` without trains before the first sent mark and after the last one: the cameras may have
/// received only parts of those.
fn trim_to_marks(reports: &[BoxReport], sent: &[Mark]) -> Vec<BoxReport> {
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

/// Whether the counters of the sync trains in `reports` have a gap.
fn has_missing_syncs(reports: &[BoxReport]) -> bool {
    let counts = reports.iter().filter_map(|r| match r {
        BoxReport::Sync { count, .. } => Some(*count),
        _ => None,
    });
    let counts: Vec<u32> = counts.collect();
    counts
        .windows(2)
        .any(|c| c[1] != (c[0] + 1) & MAX_MARKED_PRESS)
}

/// Whether a camera read a mark in `sent` that `reports` does not have: it was sent, and nothing is known of its pulses.
fn has_unreported(reports: &[BoxReport], sent: &[Mark], seen: &[Vec<TriggerEdge>; 2]) -> bool {
    let is_reported = |sent: Mark| {
        let of = |r: &BoxReport| matches!(r, BoxReport::Mark { mark, .. } if *mark == sent);
        reports.iter().any(of)
    };
    let read = seen.iter().flat_map(|edges| decode_marks(edges).marks);
    read.map(|m| m.mark)
        .any(|mark| sent.contains(&mark) && !is_reported(mark))
}

/// Lost pulses. A mark that the box did not report, nor a camera read, was not sent: it counts as completely lost.
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
    use skinrig_model::{BoxTime, PulseTrain};

    /// A report that is late or lost says nothing about the line of the camera that read its mark.
    #[test]
    fn a_mark_that_was_read_and_not_reported_is_no_lost_pulse() {
        let edges = |n| -> Vec<TriggerEdge> {
            let train = PulseTrain::new(mark(n)).unwrap();
            let edge = |(offset, rising): (u64, bool)| TriggerEdge {
                t_us: 1_000_000 * u64::from(n) + offset,
                channel: 0,
                rising,
            };
            train.edges().map(edge).collect()
        };
        let reports = [BoxReport::Mark {
            mark: mark(0),
            at: BoxTime { us: 0 },
        }];
        let sent = [mark(0), mark(1)];
        assert!(!has_unreported(&reports, &sent, &[edges(0), edges(0)]));
        let both = [edges(0), edges(1)].concat();
        assert!(has_unreported(&reports, &sent, &[edges(0), both.clone()]));
        // A mark that no one asked for is not missing.
        assert!(!has_unreported(&reports, &sent[..1], &[both, Vec::new()]));
    }

    #[test]
    fn trains_between_the_first_and_the_last_mark_count_and_a_missing_one_is_detected() {
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
        let within = trim_to_marks(&reports, &sent);
        assert_eq!(within, reports[1..6]);
        assert!(!has_missing_syncs(&within));
        assert!(has_missing_syncs(&reports));
        let reset = BoxReport::Reset {
            noticed: skinrig_model::HostTime(9),
        };
        reports.push(reset);
        assert_eq!(trim_to_marks(&reports, &sent).last(), Some(&reset));
        assert_eq!(trim_to_marks(&reports[..1], &sent), []);
    }
}
