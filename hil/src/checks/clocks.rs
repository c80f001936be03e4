//! Checks: the cameras' clocks against the trigger box's.

use std::collections::BTreeMap;

use skinrig_analysis::clock::{Line, Pair, fit_line};
use skinrig_analysis::distributions::student_quantile;
use skinrig_model::pulse::decode_marks;
use skinrig_model::{BoxReport, CameraId, HostDuration, Label, RawChunk, TriggerEdge};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};

use super::trigger::{Edges, mark};
use crate::bench::Bench;
use crate::findings::Findings;
use crate::streams::Streams;
use crate::trouble;

const METRICS: &[&str] = &["drift", "residual"];

/// From one mark to the next: between the trains that the box sends by itself.
const PERIOD: HostDuration = HostDuration::from_millis(200);
/// The cameras stream for so long before the first mark, and after the last.
const MARGIN: HostDuration = HostDuration::from_millis(300);
/// Trains that a line needs: with fewer its slope is not worth an interval.
const LEAST_TRAINS: u64 = 10;
/// Residuals are not judged finer than this, µs, when outliers are looked for: both clocks show whole µs.
const FLOOR_US: f64 = 1.0;

/// Makes the check.
pub fn clocks(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::Clocks { duration } = check.measure else {
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
    let (mut n, mut next) = (0, streams.now());
    let end = next + duration;
    while next <= end && streams.send(mark(n), see) {
        (n, next) = (n + 1, next + PERIOD);
        let rest = next - streams.now();
        streams.pass(rest, see);
    }
    streams.pass(MARGIN, see);
    let reports = streams.reports().to_vec();
    let is_cut_off = next <= end;
    let seen = streams.finish(found, METRICS, see);
    let told = told(&reports);
    let mut instants = [BTreeMap::new(), BTreeMap::new()];
    for camera in CameraId::ALL {
        if seen[camera.index()].is_none() {
            continue;
        }
        let on = edges.on(camera, channels[camera.index()]);
        let read = read(&on);
        if is_cut_off {
            for metric in METRICS {
                found.unmeasured(trouble::of_camera(camera), metric);
            }
        } else {
            one_clock(camera, &told, &read, found);
        }
        instants[camera.index()] = read;
    }
    offset(&instants, found);
}

/// When the trains were sent, on the box's clock, µs: those since its last reset, each under its name.
fn told(reports: &[BoxReport]) -> BTreeMap<Label, u64> {
    let is_reset = |r: &BoxReport| matches!(r, BoxReport::Reset { .. });
    let since = reports.iter().rposition(is_reset).map_or(0, |k| k + 1);
    let train = |r: &BoxReport| match *r {
        BoxReport::Mark { mark, at } => Some((Label::Mark(mark), at.us)),
        BoxReport::Sync { count, at } => Some((Label::Sync(count), at.us)),
        _ => None,
    };
    reports[since..].iter().filter_map(train).collect()
}

/// When trains were seen, on the camera's clock, µs.
fn read(edges: &[TriggerEdge]) -> BTreeMap<Label, u64> {
    let read = decode_marks(edges);
    let marks = read.marks.iter().map(|m| (Label::Mark(m.mark), m.t_us));
    let syncs = read.syncs.iter().map(|s| (Label::Sync(s.count), s.t_us));
    marks.chain(syncs).collect()
}

/// Drift and residual of one camera.
fn one_clock(
    camera: CameraId,
    told: &BTreeMap<Label, u64>,
    read: &BTreeMap<Label, u64>,
    found: &mut Findings,
) {
    let subject = trouble::of_camera(camera);
    let both: Vec<(u64, u64)> = told
        .iter()
        .filter_map(|(label, box_us)| Some((*box_us, *read.get(label)?)))
        .collect();
    let n = both.len();
    // Relative to one of them, so that large counters lose nothing.
    let Some(&(box_0, camera_0)) = both.first() else {
        return nothing(subject, told.len(), n, found);
    };
    let relative = |us: u64, zero: u64| us.wrapping_sub(zero) as i64 as f64;
    let pairs: Vec<Pair> = both
        .iter()
        .map(|(box_us, camera_us)| Pair {
            host_us: relative(*box_us, box_0),
            camera_us: relative(*camera_us, camera_0),
        })
        .collect();
    let Some(line) = fit_line(&pairs, FLOOR_US) else {
        return nothing(subject, told.len(), n, found);
    };
    let half_ppm = student_quantile(0.975, line.n() as f64 - 2.0) * line.drift_se * 1e6;
    let drift_ppm = line.drift * 1e6;
    let drift = found.value(subject, "drift", drift_ppm).of(n, LEAST_TRAINS);
    drift.interval = Some([drift_ppm - half_ppm, drift_ppm + half_ppm]);
    let residual_s = rms_us(&line, &pairs) * 1e-6;
    let rejected = n - line.n();
    let residual = found
        .value(subject, "residual", residual_s)
        .of(n, LEAST_TRAINS);
    if rejected > 0 {
        residual.noting(format!(
            "{rejected} of {n} trains lie off the line of the others"
        ));
    }
}

/// RMS distance of all pairs from the line, also of those that it was not fitted to: a clock that jumps must show.
fn rms_us(line: &Line, pairs: &[Pair]) -> f64 {
    let squares = pairs.iter().map(|p| line.residual_us(*p).powi(2));
    (squares.sum::<f64>() / pairs.len() as f64).sqrt()
}

/// There is no line.
fn nothing(subject: &str, sent: usize, n: usize, found: &mut Findings) {
    for metric in METRICS {
        found.unmeasured(subject, metric);
    }
    let what = format!("expected the {sent} trains that the box sent, found {n} that can be read");
    let next =
        "check the trigger cable, its channel in the rig file, and levels (docs/how-to/bench.md)";
    found
        .evidence
        .push(Evidence::new(EvidenceKind::TriggerFault, subject, what).next(next));
}

/// Camera 1's time minus camera 2's, at the first train that both saw.
fn offset(instants: &[BTreeMap<Label, u64>; 2], found: &mut Findings) {
    let [one, two] = instants;
    let both = one
        .iter()
        .filter_map(|(label, t1)| Some((*t1, *two.get(label)?)));
    if let Some((t1, t2)) = both.min() {
        let offset_s = t1.wrapping_sub(t2) as i64 as f64 * 1e-6;
        found
            .value(trouble::of_camera(CameraId::One), "offset", offset_s)
            .noting("at the first train that both cameras saw");
    }
}
