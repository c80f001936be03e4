//! Check `clocks`: drift of the camera clocks against the trigger box.

use std::collections::BTreeMap;

use skinrig_analysis::clock::{Line, Pair, fit_line};
use skinrig_model::pulse::decode_marks;
use skinrig_model::{BoxReport, CameraId, HostDuration, Label, RawChunk, TriggerEdge};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};
use skinrig_statistics::distributions::student_quantile;

use super::trigger::{Edges, mark};
use crate::bench::Bench;
use crate::device_evidence;
use crate::findings::Findings;
use crate::streams::Streams;

const METRICS: &[&str] = &["drift", "residual"];

/// Interval of the marks; they must fit between the trains that the box sends by itself.
const PERIOD: HostDuration = HostDuration::from_millis(200);
/// Streaming time before the first mark and after the last.
const MARGIN: HostDuration = HostDuration::from_millis(300);
/// Trains needed for a useful confidence interval of the slope.
const MIN_TRAINS: u64 = 10;
/// Smallest residual that counts as an outlier, µs: both clocks tick in microseconds.
const RESIDUAL_FLOOR_US: f64 = 1.0;

/// Runs the check.
pub(super) fn clocks(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::Clocks { duration } = check.measure else {
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
    let (mut n, mut next) = (0, streams.now());
    let end = next + duration;
    while next <= end && streams.send(mark(n), on_chunk) {
        (n, next) = (n + 1, next + PERIOD);
        let rest = next - streams.now();
        streams.pass(rest, on_chunk);
    }
    streams.pass(MARGIN, on_chunk);
    let reports = streams.reports().to_vec();
    let is_cut_off = next <= end;
    let stats = streams.finish(findings, METRICS, on_chunk);
    let sent_trains = sent_trains(&reports);
    let mut train_times = [BTreeMap::new(), BTreeMap::new()];
    for camera in CameraId::ALL {
        if stats[camera.index()].is_none() {
            continue;
        }
        let on = edges.on_channel(camera, channels[camera.index()]);
        let received = received_trains(&on);
        if is_cut_off {
            for metric in METRICS {
                findings.unmeasured(device_evidence::camera_subject(camera), metric);
            }
        } else {
            measure_camera(camera, &sent_trains, &received, findings);
        }
        train_times[camera.index()] = received;
    }
    offset(&train_times, findings);
}

/// Times of the trains on the box's clock since its last reset, by label, µs.
fn sent_trains(reports: &[BoxReport]) -> BTreeMap<Label, u64> {
    let is_reset = |r: &BoxReport| matches!(r, BoxReport::Reset { .. });
    let since = reports.iter().rposition(is_reset).map_or(0, |k| k + 1);
    let train = |r: &BoxReport| match *r {
        BoxReport::Mark { mark, at } => Some((Label::Mark(mark), at.us)),
        BoxReport::Sync { count, at } => Some((Label::Sync(count), at.us)),
        _ => None,
    };
    reports[since..].iter().filter_map(train).collect()
}

/// Times of the received trains on the camera's clock, by label, µs.
fn received_trains(edges: &[TriggerEdge]) -> BTreeMap<Label, u64> {
    let read = decode_marks(edges);
    let marks = read.marks.iter().map(|m| (Label::Mark(m.mark), m.t_us));
    let syncs = read.syncs.iter().map(|s| (Label::Sync(s.count), s.t_us));
    marks.chain(syncs).collect()
}

/// Drift and residual of one camera.
fn measure_camera(
    camera: CameraId,
    sent_trains: &BTreeMap<Label, u64>,
    received: &BTreeMap<Label, u64>,
    findings: &mut Findings,
) {
    let subject = device_evidence::camera_subject(camera);
    let both: Vec<(u64, u64)> = sent_trains
        .iter()
        .filter_map(|(label, box_us)| Some((*box_us, *received.get(label)?)))
        .collect();
    let n = both.len();
    // Relative to the first pair, because large counters would lose precision as f64.
    let Some(&(box_origin, camera_origin)) = both.first() else {
        return too_few_trains(subject, sent_trains.len(), n, findings);
    };
    let relative = |us: u64, zero: u64| us.wrapping_sub(zero) as i64 as f64;
    let pairs: Vec<Pair> = both
        .iter()
        .map(|(box_us, camera_us)| Pair {
            host_us: relative(*box_us, box_origin),
            camera_us: relative(*camera_us, camera_origin),
        })
        .collect();
    let Ok(line) = fit_line(&pairs, RESIDUAL_FLOOR_US) else {
        return too_few_trains(subject, sent_trains.len(), n, findings);
    };
    let half_ppm = student_quantile(0.975, line.n() as f64 - 2.0) * line.drift_se * 1e6;
    let drift_ppm = line.drift * 1e6;
    let drift = findings
        .value(subject, "drift", drift_ppm)
        .with_samples(n, MIN_TRAINS);
    drift.interval = Some([drift_ppm - half_ppm, drift_ppm + half_ppm]);
    let residual_s = rms_us(&line, &pairs) * 1e-6;
    let rejected = n - line.n();
    let residual = findings
        .value(subject, "residual", residual_s)
        .with_samples(n, MIN_TRAINS);
    if rejected > 0 {
        residual.with_note(format!(
            "{rejected} of {n} trains are outliers of the fitted line"
        ));
    }
}

/// RMS residual of all pairs. It includes outliers, so that a clock jump is visible.
fn rms_us(line: &Line, pairs: &[Pair]) -> f64 {
    let squares = pairs.iter().map(|p| line.residual_us(*p).powi(2));
    (squares.sum::<f64>() / pairs.len() as f64).sqrt()
}

/// Records that a fit has too few trains.
fn too_few_trains(subject: &str, sent: usize, n: usize, findings: &mut Findings) {
    for metric in METRICS {
        findings.unmeasured(subject, metric);
    }
    let what = format!("expected the {sent} trains that the box sent, found {n} decoded");
    let next =
        "check the trigger cable, its channel in the rig file, and levels (docs/how-to/bench.md)";
    findings
        .evidence
        .push(Evidence::new(EvidenceKind::TriggerFault, subject, what).next(next));
}

/// Time of camera 1 minus time of camera 2, at the first train that both received.
fn offset(train_times: &[BTreeMap<Label, u64>; 2], findings: &mut Findings) {
    let [one, two] = train_times;
    let both = one
        .iter()
        .filter_map(|(label, t1)| Some((*t1, *two.get(label)?)));
    if let Some((t1, t2)) = both.min() {
        let offset_s = t1.wrapping_sub(t2) as i64 as f64 * 1e-6;
        findings
            .value(
                device_evidence::camera_subject(CameraId::One),
                "offset",
                offset_s,
            )
            .with_note("at the first train seen by both cameras");
    }
}
