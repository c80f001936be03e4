//! Checks: data rate and loss, at rest and under the test pattern.

use skinrig_device::{DeviceError, EventCamera, PatternScan, TestPattern};
use skinrig_model::{CameraId, HostDuration};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};

use super::pixels::{Reader, watch};
use crate::bench::Bench;
use crate::findings::Findings;
use crate::streams::{Seen, Streams};
use crate::trouble;

const IDLE: &[&str] = &["data_rate", "lost", "gaps"];
const PATTERN: &[&str] = &["received", "lost", "gaps"];

/// Start-up bursts do not count: the stream is looked at this long before it does.
const SETTLE: HostDuration = HostDuration::from_millis(500);

/// Makes the check.
pub fn idle(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::Idle { duration } = check.measure else {
        return;
    };
    let mut readers = [None, None];
    let mut prepare = |id: CameraId, camera: &mut dyn EventCamera| -> Result<(), DeviceError> {
        readers[id.index()] = Some(Reader::of_time(&camera.capabilities()));
        Ok(())
    };
    let streams = Streams::start(bench, &mut prepare);
    for (camera, seen, reader) in watch(streams, [SETTLE, duration], readers, found, IDLE) {
        let subject = trouble::of_camera(camera);
        let Some(span_s) = seen.span_s() else {
            for metric in IDLE {
                found.unmeasured(subject, metric);
            }
            continue;
        };
        found.value(subject, "data_rate", seen.bytes as f64 / span_s);
        losses(subject, &seen, reader.counts.jumps, 0, found);
    }
}

/// Makes the check.
pub fn test_pattern(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::TestPattern {
        duration,
        rate_ev_s,
    } = check.measure
    else {
        return;
    };
    let mut readers = [None, None];
    let mut scans: [Option<PatternScan>; 2] = [None, None];
    let mut prepare = |id: CameraId, camera: &mut dyn EventCamera| -> Result<(), DeviceError> {
        if let Some(scan) = camera.test_pattern(Some(TestPattern { rate_ev_s }))? {
            scans[id.index()] = Some(scan);
            let reader = Reader::of_scan(&camera.capabilities(), scan.columns, scan.rows);
            readers[id.index()] = Some(reader);
        }
        Ok(())
    };
    let streams = Streams::start(bench, &mut prepare);
    let watched = watch(streams, [SETTLE, duration], readers, found, PATTERN);
    give_pixels_back(bench, found);
    let refused = |e: &&Evidence| e.kind == EvidenceKind::Refused;
    if scans == [None, None] && found.evidence.iter().filter(refused).count() == scans.len() {
        let whats = found.evidence.iter().map(|e| e.what.as_str());
        found.not_here = Some(whats.collect::<Vec<_>>().join("; "));
        return;
    }
    for (camera, seen, reader) in watched {
        let subject = trouble::of_camera(camera);
        let (Some(span_s), Some(scan)) = (seen.span_s(), scans[camera.index()]) else {
            for metric in PATTERN {
                found.unmeasured(subject, metric);
            }
            continue;
        };
        let expected = scan.rate_ev_s * span_s;
        let events = reader.counts.events;
        let followed = reader.counts.scan;
        let (columns, rows) = followed.as_ref().map_or((0, 0), |s| s.largest);
        found
            .value(subject, "received", events as f64 / expected * 100.0)
            .noting(format!(
                "{events} of {expected:.0} events at {:.0} events/s; up to column {columns} and row {rows} of {} x {}",
                scan.rate_ev_s, scan.columns, scan.rows
            ));
        let breaks = followed.map_or(0, |s| s.breaks);
        losses(subject, &seen, reader.counts.jumps, breaks, found);
    }
}

/// Bytes lost, and gaps: losses, steps of the time base, and events that a scan misses.
fn losses(subject: &str, seen: &Seen, jumps: u64, breaks: u64, found: &mut Findings) {
    let lost = found.value(subject, "lost", seen.lost_bytes as f64);
    if !seen.notes.is_empty() {
        lost.noting(seen.notes.join("; "));
    }
    let gaps = seen.losses + jumps + breaks;
    found.value(subject, "gaps", gaps as f64);
    if gaps > 0 {
        let what = format!(
            "expected a stream without gaps, found {} losses of {} bytes together, {jumps} jumps of the time base and {breaks} breaks of the pattern",
            seen.losses, seen.lost_bytes
        );
        let next = "look at the cable, the port (USB 3, no hub) and what else runs on the computer";
        found
            .evidence
            .push(Evidence::new(EvidenceKind::DataLost, subject, what).next(next));
    }
}

/// Both cameras see again; one that does not is told.
fn give_pixels_back(bench: &mut dyn Bench, found: &mut Findings) {
    for camera in bench.devices().cameras.iter_mut().flatten() {
        if let Err(e) = camera.test_pattern(None) {
            found.evidence.push(*trouble::of(&e));
        }
    }
}
